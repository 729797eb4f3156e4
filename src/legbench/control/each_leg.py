"""Control of a batch of legs by laws that know one leg each."""

from collections.abc import Iterator, Mapping, Sequence
from typing import final

import numpy as np

from legbench.control.abstract import AbstractController
from legbench.control.check import check_command
from legbench.signals import Command, Floats, Observation, Truth


@final
class EachLeg(AbstractController):
    """Controller of a batch made of one law a leg; the laws may be plain floats and ifs."""

    def __init__(self, laws: Sequence[AbstractController]) -> None:
        """Prepare for laws in the order of the legs, of which there is at least one."""
        self._laws = tuple(laws)
        self._start = np.array([law.start_motor_pos for law in self._laws])
        self._errors: dict[int, Exception] = {}
        self._last: list[Command | None] = [None] * len(self._laws)

    @property
    def start_motor_pos(self) -> Floats:
        """Start postures, one row for each leg (n, 2) [rad]."""
        return self._start

    @property
    def leg_errors(self) -> Mapping[int, Exception]:
        """What the laws that failed have raised, or returned instead of a command, by leg."""
        return self._errors

    def law_of(self, leg: int) -> AbstractController:
        """Controller of one leg."""
        return self._laws[leg]

    def reset(self, observation: Observation) -> None:
        """Show each law its leg at rest."""
        self._errors = {}
        self._last = [None] * len(self._laws)
        for leg, seen in enumerate(each_row(observation)):
            try:
                self._laws[leg].reset(seen)
            except Exception as error:  # Whatever a law raises ends its own leg alone.
                self._errors[leg] = error

    def step(self, observation: Observation) -> Command:
        """Ask each law for its leg; the command of a law that has failed is its last one."""
        for leg, seen in enumerate(each_row(observation)):
            if leg in self._errors:
                continue
            try:
                command = self._laws[leg].step(seen)
                check_command(command, seen)
            except Exception as error:  # as above
                self._errors[leg] = error
            else:
                self._last[leg] = command
        return self._joined()

    def _joined(self) -> Command:
        """The commands of all legs as one."""
        known = next((command for command in self._last if command is not None), None)
        if known is None:
            return Command.holding(self._start)
        width = None if known.signals is None else known.signals.shape
        commands = [
            Command(
                motor_pos=start,
                phase=np.zeros((), dtype=np.int64),
                signals=None if width is None else np.full(width, np.nan),
            )
            if command is None
            else command
            for command, start in zip(self._last, self._start, strict=True)
        ]
        signals = [command.signals for command in commands if command.signals is not None]
        return Command(
            motor_pos=np.array([command.motor_pos for command in commands]),
            phase=np.array([command.phase for command in commands], dtype=np.int64),
            signals=np.array(signals) if signals else None,
        )


def each_row(observation: Observation) -> Iterator[Observation]:
    """Observations of the single legs of a batch, as views of its rows."""
    truths = _truth_rows(observation.truth, len(observation.motor_pos))
    for row, truth in enumerate(truths):
        yield Observation(
            time=observation.time,
            motor_pos=observation.motor_pos[row],
            joint_pos=observation.joint_pos[row],
            joint_vel=observation.joint_vel[row],
            spring_torque=observation.spring_torque[row],
            applied_pos=observation.applied_pos[row],
            truth=truth,
        )


def _truth_rows(truth: Truth | None, count: int) -> Iterator[Truth | None]:
    for row in range(count):
        yield truth and Truth(
            trunk_pos=truth.trunk_pos[row],
            trunk_vel=truth.trunk_vel[row],
            foot_pos=truth.foot_pos[row],
            contact_force=truth.contact_force[row],
            contact=truth.contact[row],
            energy=truth.energy[row],
            loop_gap=truth.loop_gap[row],
        )
