"""A run and everything that is measured of it, each computed once, when it is first asked for."""

from functools import cached_property
from pathlib import Path
from typing import Any, Final, final

from numpy.typing import NDArray

from legbench.metrics.budget import EnergyBudget, energy_budget
from legbench.metrics.changes import rows_before_change
from legbench.metrics.energy import Flows, energy_flows
from legbench.metrics.jump import JumpFigures, jump_figures
from legbench.metrics.modal import Trajectory, trajectory
from legbench.metrics.periods import Periods, find_periods
from legbench.metrics.phases import Gait, find_gait
from legbench.metrics.roles import first_action
from legbench.metrics.run_ratings import RunRatings, rate_run
from legbench.metrics.source import Recorded
from legbench.metrics.stance import states_of
from legbench.recording.description import RunDescription
from legbench.signals import Floats, Ints

KEPT_BYTES: Final = 1 << 28
"""Signals that are kept together at most [bytes]: all of a run of twenty minutes at 1 kHz; those
of a longer one are read again when they have not been asked for in a while."""


@final
class Analysis:
    """A recorded run that is measured; itself `Recorded`, with signals that are read once.

    What is kept of a long run is bounded by `KEPT_BYTES`.

    Attributes:
        description: what the run says of itself.
        time: plant time of every row (n,) [s].
        has_truth: whether a simulation filled the truth signals.

    Raises:
        FormatError: the run describes no leg.
    """

    def __init__(self, recording: Recorded) -> None:
        self._recording = recording
        self._signals: dict[str, NDArray[Any]] = {}
        self.description: RunDescription = recording.description
        self.time: Floats = recording.time
        self.has_truth: bool = recording.has_truth

    @property
    def path(self) -> Path:
        """The run folder."""
        return self._recording.path

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Rows of the signal `name`, read-only; raises as the recording does."""
        found = self._signals.pop(name, None)
        if found is None:
            found = self._recording[name]
            found.flags.writeable = False
            self._make_room(found.nbytes)
        # Last in order is what was asked for last.
        self._signals[name] = found
        return found

    def forget(self) -> None:
        """Forget the signals that are kept: they make room, and are read again when asked for."""
        self._signals.clear()

    def _make_room(self, size: int) -> None:
        """Forget the signals that have not been asked for the longest."""
        kept = sum(each.nbytes for each in self._signals.values())
        while self._signals and kept + size > KEPT_BYTES:
            kept -= self._signals.pop(next(iter(self._signals))).nbytes

    @cached_property
    def first_action(self) -> int:
        """Row of the first control action; the number of rows when there is none."""
        return first_action(self)

    @cached_property
    def first_answer(self) -> int:
        """Row in which the motors are first seen to move after the first control action.

        Row of that action itself if they never move, or if there is none.
        """
        action = self.first_action
        if action == len(self.time):
            return action
        return action + int(rows_before_change(self["motor_pos"][action:]))

    @cached_property
    def states(self) -> Ints:
        """STANCE, FLIGHT or UNKNOWN of every row (n,)."""
        return states_of(self)

    @cached_property
    def gait(self) -> Gait:
        """Complete stances, flights and jumps."""
        return find_gait(self, self.states)

    @cached_property
    def trajectory(self) -> Trajectory:
        """Polar and modal coordinates of every row."""
        return trajectory(self)

    @cached_property
    def periods(self) -> Periods:
        """Oscillation periods that count in the rating."""
        # What a long run's coordinates take is given back: they are not asked for again.
        moved = trajectory(self)
        return find_periods(
            moved, self.first_action, self.description.counting, answer=self.first_answer
        )

    @cached_property
    def ratings(self) -> RunRatings:
        """Ratings of stances and flights in a jump, of periods in any other setup."""
        return rate_run(self, self.gait, None if self.description.jumps else self.periods)

    @cached_property
    def jump_figures(self) -> JumpFigures:
        """Figures of the complete jumps."""
        return jump_figures(self, self.gait, self.first_action)

    @cached_property
    def flows(self) -> Flows:
        """Energy that flowed between any two rows."""
        return energy_flows(self)

    @cached_property
    def budget(self) -> EnergyBudget:
        """Energy of each complete jump."""
        return energy_budget(self, self.gait, self.flows)


def analysed(run: Recorded) -> Analysis:
    """Return the analysis of a run, which may be one already."""
    return run if isinstance(run, Analysis) else Analysis(run)
