"""Instants of a run that another run has, too, so that both can be laid over each other there."""

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from legbench.errors import RecordingError
from legbench.metrics.analysis import Analysis
from legbench.metrics.roles import resting
from legbench.metrics.source import Recorded
from legbench.metrics.stance import MINIMUM_PHASE
from legbench.recording.description import RunDescription
from legbench.signals import Floats


class CommonEvent(StrEnum):
    """Kind of event on which runs are aligned."""

    TOUCHDOWN = "touchdown"
    """The foot meets the ground."""
    LIFTOFF = "liftoff"
    """The foot leaves the ground."""
    SWITCH = "switch"
    """The controller goes from one phase to the next, as the bang-bang controller's motors do."""
    ACTION = "action"
    """The first control action."""
    CLOCK = "clock"
    """Plant time zero: no event at all."""


BEST_FIRST = (CommonEvent.TOUCHDOWN, CommonEvent.SWITCH, CommonEvent.ACTION)
"""Events in the order in which the first is chosen that every run has."""


def event_times(run: Analysis, event: CommonEvent) -> Floats:
    """Times of all events of one kind in a run, in order (m,) [s].

    Touchdown and lift-off lie between the rows if there is truth. A leg that is put down in its
    first rows does not land.
    """
    gait = run.gait
    if event is CommonEvent.CLOCK:
        return np.zeros(1)
    if event is CommonEvent.ACTION:
        return run.time[run.first_action : run.first_action + 1]
    if event is CommonEvent.SWITCH:
        phase = run["phase"]
        acts = ~resting(phase, run.description.phases)
        changed = np.flatnonzero((phase[1:] != phase[:-1]) & acts[1:] & acts[:-1]) + 1
        return run.time[changed]
    down = event is CommonEvent.TOUCHDOWN
    ends = (gait.stance.start, gait.flight.end) if down else (gait.stance.end, gait.flight.start)
    times = np.unique(np.concatenate(ends))
    return times[times > run.time[0] + MINIMUM_PHASE] if len(run.time) else times


def common_event(runs: Sequence[Analysis]) -> CommonEvent:
    """Best kind of event that all runs have; the clock where they share none."""
    for event in BEST_FIRST:
        if all(len(event_times(run, event)) for run in runs):
            return event
    return CommonEvent.CLOCK


def event_time(run: Analysis, event: CommonEvent, number: int = 1) -> float:
    """Time of one event of a run [s].

    Args:
        run: the run.
        event: its kind.
        number: which one, from 1; -1 is the last.

    Raises:
        RecordingError: the run has no such event; says how many it has.
    """
    times = event_times(run, event)
    if number == 0 or abs(number) > len(times):
        raise RecordingError(
            f"{run.path} has {len(times)} events of kind {event.value}, so none is number {number};"
            " align on another event, such as action or clock"
        )
    return float(times[number - 1 if number > 0 else number])


@final
class Shifted:
    """A run whose time is counted from an instant of its own.

    Attributes:
        description: what the run says of itself.
        time: time of every row since that instant (n,) [s].
        has_truth: whether a simulation filled the truth signals.
    """

    def __init__(self, run: Recorded, instant: float) -> None:
        self._run = run
        self.description: RunDescription = run.description
        self.time: Floats = run.time - instant
        self.has_truth: bool = run.has_truth

    @property
    def path(self) -> Path:
        """The run folder."""
        return self._run.path

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Rows of the signal `name`; raises as the run does."""
        return self._run[name]
