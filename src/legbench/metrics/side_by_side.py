"""Several runs side by side: their figures, and how far apart they move after a common event."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from legbench.errors import RecordingError
from legbench.kinematics import polar_angle
from legbench.metrics.analysis import Analysis
from legbench.metrics.compare import differences
from legbench.metrics.events import CommonEvent, Shifted, common_event, event_time
from legbench.metrics.summary import Summary, summarise
from legbench.metrics.window import RowWindow
from legbench.recording.unlike import unlike
from legbench.signals import Floats
from legbench.strict_json import null_for_nan

BEFORE = 0.05
"""Time before the event over which runs are compared, too [s]."""
SPAN = 1.0
"""Time after the event over which runs are compared unless another is asked for [s]."""
SAME_LEG = ("design.name", "design.units")
"""Entries of a design that make no other leg of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Aligned:
    """Largest distances of a run from the first one, both counted from their event."""

    run: str
    """Folder of the run."""
    event: float
    """Time of its event [s]."""
    duration: float
    """Time over which both have rows and are compared [s]."""
    joint_max: float
    """Largest |dq| [rad]."""
    z2_max: float
    """Largest |dz2|, in the first run's modal convention [rad]."""
    x1_max: float
    """Largest |dx1| of the foot's polar angle [rad]."""
    other_leg: list[str]
    """Entries of the design in which the legs differ; none: it is the same leg."""
    otherwise_unlike: list[str]
    """Other entries of the experiment in which they differ, but for plant, linkage, numerics."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SideBySide:
    """Figures of several runs, and their distances from the first."""

    event: CommonEvent
    """Kind of event on which they are aligned."""
    number: int
    """Number of that event in each run, from 1; from the end where it is negative."""
    times: list[float]
    """Time of the event in each run [s]."""
    summaries: list[Summary]
    """Figures of each run."""
    apart: list[Aligned]
    """Distances of all runs but the first."""

    def to_json(self) -> dict[str, Any]:
        """Everything by name for strict JSON: NaN is None."""
        return {
            "event": self.event.value,
            "number": self.number,
            "runs": [
                each.to_json() | {"event_time": time}
                for each, time in zip(self.summaries, self.times, strict=True)
            ],
            "apart": [null_for_nan(asdict(each)) for each in self.apart],
        }


def side_by_side(
    runs: Sequence[Analysis],
    *,
    event: CommonEvent | None = None,
    number: int = 1,
    span: float = SPAN,
) -> SideBySide:
    """Put runs side by side, of the same leg or of different ones.

    Args:
        runs: the runs; distances are from the first.
        event: kind of event on which they are aligned; none: the best that all have.
        number: which of these events, from 1; -1 is the last.
        span: time after the event over which distances are measured [s].

    Raises:
        RecordingError: a run does not have that event, or no rows around it.
        FormatError: a run describes no leg.
    """
    chosen = common_event(runs) if event is None else event
    number = 1 if chosen in (CommonEvent.ACTION, CommonEvent.CLOCK) else number
    times = [event_time(run, chosen, number) for run in runs]
    first, *others = [Shifted(run, time) for run, time in zip(runs, times, strict=True)]
    return SideBySide(
        event=chosen,
        number=number,
        times=times,
        summaries=[summarise(run) for run in runs],
        apart=[
            _apart(first, other, time, span) for other, time in zip(others, times[1:], strict=True)
        ],
    )


def _apart(first: Shifted, other: Shifted, event: float, span: float) -> Aligned:
    both = [_near(run, span) for run in (first, other)]
    if not all(len(run.time) for run in both):
        raise RecordingError(f"{first.path} or {other.path} has no rows around their event")
    found = differences(*both)
    unequal = unlike(first.description, other.description)
    legs = [name for name in unequal if name.startswith("design.")]
    return Aligned(
        run=str(other.path),
        event=event,
        duration=float(found.time[-1] - found.time[0]),
        joint_max=_largest(found.joint),
        z2_max=_largest(found.z2),
        x1_max=_largest(polar_angle(found.joint)),
        other_leg=[name for name in legs if not name.startswith(SAME_LEG)],
        otherwise_unlike=[name for name in unequal if name not in legs],
    )


def _near(run: Shifted, span: float) -> RowWindow:
    """Rows of a run around its event."""
    first, stop = np.searchsorted(run.time, [-BEFORE, span])
    return RowWindow(run, int(first), int(stop))


def _largest(values: Floats) -> float:
    known = np.abs(values[np.isfinite(values)])
    return float(known.max()) if known.size else float("nan")
