"""The move to a posture at a bounded speed, by commands of one step a cycle."""

from collections.abc import Sequence
from typing import Protocol

from legbench.drives.master.sample import Sample
from legbench.errors import PlantFault
from legbench.limits.guard import Guard

ARRIVED = 1e-9
"""Largest distance from a target that counts as reached [rad]."""


class Commanded(Protocol):
    """Drives that take one command a cycle, such as a `Link`."""

    def command(self, motor_pos: Sequence[float]) -> tuple[float, ...]:
        """Send a command for the coming period; what of it was applied [rad]."""
        ...

    def exchange(self) -> Sample:
        """Wait for the next tick and look at the drives."""
        ...


def move(drives: Commanded, guard: Guard, wanted: tuple[float, ...], step: float) -> Sample:
    """Lead drives to a posture, then hold it for two cycles; what the last one measured.

    The move ends, too, where a limit lets no command through any more; see `missed`.

    Args:
        drives: enabled drives.
        guard: limits of their commands.
        wanted: positions of the motors at the end [rad].
        step: largest change of a command in one cycle [rad].

    Raises:
        PlantFault: as `drives` raises it.
    """
    while guard.applied != wanted:
        before = guard.applied
        applied = drives.command(
            [
                target if abs(target - last) <= step else last + (step if target > last else -step)
                for target, last in zip(wanted, before, strict=True)
            ]
        )
        drives.exchange()
        if applied == before:
            break
    drives.command(guard.applied)
    drives.exchange()
    drives.command(guard.applied)
    return drives.exchange()


def missed(guard: Guard, wanted: Sequence[float]) -> PlantFault | None:
    """Fault of a move that has not led the motors as far towards a posture as the limits allow.

    Args:
        guard: limits of the commands.
        wanted: positions that the motors were to reach [rad].
    """
    applied, end = guard.applied, guard.reachable(wanted)
    if all(abs(a - b) < ARRIVED for a, b in zip(applied, end, strict=True)):
        return None
    return PlantFault(
        "start posture",
        f"the motors were led to {applied} rad, not to {end} rad; the move has failed",
    )
