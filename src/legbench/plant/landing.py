"""End of a run on drives: on the ground and at rest, before its power goes."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import final

STILL_RANGE = 0.01
"""A leg at rest keeps every link within this of where it was [rad]: half a degree, 100 counts of
the bench's encoders, 1 mm at the foot of the paper's leg."""
STILL_TIME = 0.5
"""Time for which it must [s]; a leg that flies may be as quiet, but falls 0.3 m within it."""
PATIENCE = 30.0
"""Time at the posture after which power goes anyway [s]. A jump of the paper's leg dies out in 4 to
7 s. Pinned by its foot it loses a factor e in 3.6 to 5.4 s and rests after 11 to 20 s. Motors that
hold cost nothing meanwhile; a leg that swings for longer is no fault."""


class End(StrEnum):
    """End of a run on drives that has lasted its time."""

    REST = "rest"
    """The motors are led to the controller's rest posture, the leg comes to rest, power goes."""
    STOP = "stop"
    """Quick stop at once, wherever the leg is, in mid-flight, too."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Landing:
    """Report of the way to rest, between the last row of a run and the end of its power."""

    motor_pos: tuple[float, ...]
    """Motor positions that the leg was led to [rad]."""
    duration: float
    """Duration of the way to rest [s]."""
    rested: bool
    """Whether the leg came to rest."""
    swing: float
    """Half of the range that the link that moved most went through in the last 0.5 s [rad]."""
    interrupted: bool
    """Whether ^C ended the way to rest."""

    @property
    def trouble(self) -> str | None:
        """What a person beside the leg has to know: it still swung when its power went."""
        if self.rested or self.interrupted:
            return None
        return (
            f"the leg still swung by {self.swing:.3f} rad after {PATIENCE:g} s in its rest "
            f"posture, one at rest by less than {STILL_RANGE:g} rad; its power went then"
        )


def towards(wanted: Sequence[float], applied: Sequence[float], step: float) -> tuple[float, ...]:
    """Return the next command (one value a motor) on the way to `wanted`, `step` long at most.

    Args:
        wanted: where the motors are to go [rad].
        applied: the last command as it was let through [rad].
        step: longest way of a motor in one period [rad].
    """
    return tuple(
        last + min(max(target - last, -step), step)
        for target, last in zip(wanted, applied, strict=True)
    )


@final
class StillWatch:
    """Detector of links that have been still for long enough, however coarse their encoders are."""

    def __init__(self, period: float) -> None:
        self._needed = round(STILL_TIME / period)
        self._seen: deque[tuple[float, ...]] = deque(maxlen=self._needed)
        self._around: tuple[float, ...] = ()
        self._count = 0

    def see(self, link_pos: Sequence[float]) -> bool:
        """Take the link angles of a period [rad]; returns whether the leg rests by now."""
        self._seen.append(tuple(link_pos))
        near = len(self._around) == len(link_pos) and all(
            abs(value - middle) <= STILL_RANGE
            for value, middle in zip(link_pos, self._around, strict=True)
        )
        if near:
            self._count += 1
        else:
            self._around, self._count = tuple(link_pos), 0
        return self._count >= self._needed

    @property
    def swing(self) -> float:
        """Half of the range that the widest link went through in the time that counts [rad]."""
        return max(
            (0.5 * (max(link) - min(link)) for link in zip(*self._seen, strict=True)), default=0.0
        )


def land(
    exchange: Callable[[Sequence[float]], tuple[Sequence[float], Sequence[float]]],
    motor_pos: Sequence[float],
    applied: Sequence[float],
    *,
    speed: float,
    period: float,
    interrupted: Callable[[], bool],
) -> Landing:
    """Lead motors to a posture, then wait there until the leg rests, 30 s at most.

    Args:
        exchange: sends a command for a period; what was applied of it and the link angles [rad].
        motor_pos: the posture [rad].
        applied: where the last command led the motors [rad].
        speed: of the way there [rad/s].
        period: of an exchange [s].
        interrupted: asked before every exchange; ends the landing when it says so.

    Raises:
        PlantFault: as `exchange`.
    """
    wanted, last = tuple(motor_pos), tuple(applied)
    still, cycles, waited = StillWatch(period), 0, 0
    rested = under_way = False
    while not (stopped := interrupted()) and not rested and waited < round(PATIENCE / period):
        reached, links = exchange(towards(wanted, last, speed * period))
        # Limits may keep the motors from the posture: where they stay is as far as it goes.
        under_way = tuple(reached) != last
        last = tuple(reached)
        waited = 0 if under_way else waited + 1
        rested = still.see(links) and not under_way
        cycles += 1
    return Landing(
        motor_pos=last,
        duration=cycles * period,
        rested=rested,
        swing=still.swing,
        interrupted=stopped,
    )
