"""Two runs side by side, in numbers: how far apart they moved, jumped and were rated.

Differences are the other run's value minus the run's. Both are taken from plant time zero and in
the run's modal convention; a run of shorter period is interpolated to the rows of the other.
"""

from dataclasses import asdict, dataclass
from math import isfinite, nan
from typing import Any

import numpy as np

from legbench.errors import RecordingError
from legbench.kinematics import joint_to_modal
from legbench.metrics.analysis import Analysis, analysed
from legbench.metrics.phases import Gait
from legbench.metrics.source import Recorded
from legbench.metrics.stance import MINIMUM_PHASE
from legbench.recording.unlike import unlike
from legbench.signals import Floats
from legbench.strict_json import null_for_nan


@dataclass(frozen=True, slots=True, kw_only=True)
class Differences:
    """Another run minus a run, row by row, over the time that both have."""

    time: Floats
    """Time of the rows of the longer period (n,) [s]."""
    joint: Floats
    """(n, 2) [rad]"""
    z2: Floats
    """Difference in z2, in the run's modal convention (n,) [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """How another run differs from a run; NaN where one of them does not show it.

    Lists hold one value per matched flight: the n-th of one run and the n-th of the other, as
    long as they overlap in time.
    """

    run: str
    """Folder of the run."""
    other: str
    """Folder of the other."""
    run_name: str
    """Plant, linkage and design of the run."""
    other_name: str
    unlike: list[str]
    """Entries of the experiment, other than plant and linkage, in which they differ."""
    period: float
    """Period of the rows compared [s]."""
    duration: float
    """Time that both have [s]."""
    first_touchdown: float
    """Time of the first touchdown of the run that lands first [s]."""
    joint_before_touchdown: float
    """Largest |dq| before that [rad]."""
    z2_before_touchdown: float
    """Largest |dz2| before that [rad]."""
    joint_max: float
    """Largest |dq| over the common time [rad]."""
    z2_max: float
    """Largest |dz2| over the common time [rad]."""
    liftoff: list[float]
    """Difference of lift-off [s]."""
    touchdown: list[float]
    """Difference of touchdown [s]."""
    apex_height: list[float]
    """Difference of the hip's height above the ground at the apex, over the run's [-]."""
    rating_reference: str
    """Reference of all ratings compared: that of the run, `motor` or `equilibrium`."""
    rating_stance: float
    """Difference of the mean P^r of all complete stances [-]."""
    rating_flight: float
    """Difference in the mean rating of all complete flights [-]."""
    rating_periods: float
    """Difference in the mean rating of all oscillation periods [-]."""

    def to_json(self) -> dict[str, Any]:
        """Fields by name for strict JSON: NaN is None, alone and in lists."""
        return null_for_nan(asdict(self))


def compare(recording: Recorded, other: Recorded) -> Comparison:
    """Measure how `other` differs from a run; designs, setups and periods may be different.

    Raises:
        FormatError: one of them describes no leg, or an unknown setup or convention.
        RecordingError: they have no time in common.
    """
    run, other = analysed(recording), analysed(other)
    for each in (run, other):
        _measure(each)
    apart = differences(run, other)
    landing = first_touchdown(run, other)
    before = apart.time < landing
    return Comparison(
        run=str(run.path),
        other=str(other.path),
        run_name=run.description.title,
        other_name=other.description.title,
        unlike=unlike(run.description, other.description),
        period=round(_period(apart.time), 9),
        duration=float(apart.time[-1] - apart.time[0]),
        first_touchdown=landing,
        joint_before_touchdown=_largest(apart.joint[before]),
        z2_before_touchdown=_largest(apart.z2[before]),
        joint_max=_largest(apart.joint),
        z2_max=_largest(apart.z2),
        **_flights(run.gait, other.gait),
        **_ratings(run, other),
    )


def _measure(run: Analysis) -> None:
    """Find phases and ratings, which are kept, and forget the signals: of two long runs only one at
    a time has them in memory.
    """
    _ = run.gait, run.ratings
    run.forget()


def differences(recording: Recorded, other: Recorded) -> Differences:
    """Subtract a run's angles from another's at the rows of the longer period.

    Raises:
        FormatError: one of them describes no leg.
        RecordingError: they have no time in common.
    """
    runs = (recording, other)
    for run in runs:
        if len(run.time) == 0:
            raise RecordingError(f"{run.path} has no rows: there is nothing to compare")
    begin = max(float(run.time[0]) for run in runs)
    end = min(float(run.time[-1]) for run in runs)
    coarse = max(runs, key=lambda run: _period(run.time)).time
    time = coarse[(coarse >= begin) & (coarse <= end)]
    if len(time) == 0:
        spans = " and ".join(f"{run.time[0]:g} to {run.time[-1]:g} s" for run in runs)
        raise RecordingError(f"{recording.path} and {other.path} have no time in common: {spans}")
    ours, theirs = (_at(time, run) for run in runs)
    convention = recording.description.convention
    # Copies, as a view of the second coordinate keeps the first.
    z2 = [joint_to_modal(joint, convention)[:, 1].copy() for joint in (ours, theirs)]
    return Differences(time=time, joint=theirs - ours, z2=z2[1] - z2[0])


def first_touchdown(recording: Recorded, other: Recorded) -> float:
    """Time at which the first of two runs lands first [s]; NaN where none does.

    A leg that is put down at its first rows does not land.

    Raises:
        FormatError: one of them describes no leg.
    """
    first = np.inf
    for run in (analysed(recording), analysed(other)):
        landings = np.concatenate([run.gait.stance.start, run.gait.flight.end])
        later = landings[landings > run.time[0] + MINIMUM_PHASE]
        first = float(np.min(later, initial=first))
    return first if isfinite(first) else nan


def _period(time: Floats) -> float:
    return float(np.median(np.diff(time))) if len(time) > 1 else 0.0


def _at(time: Floats, run: Recorded) -> Floats:
    """Joint angles of a run at some times, (n, 2) [rad]."""
    joint = run["joint_pos"]
    return np.stack([np.interp(time, run.time, angle) for angle in joint.T], axis=-1)


def _flights(ours: Gait, theirs: Gait) -> dict[str, Any]:
    a, b = ours.flight, theirs.flight
    count = min(len(a), len(b))
    apart = (a.start[:count] >= b.end[:count]) | (b.start[:count] >= a.end[:count])
    some = slice(0, int(np.argmax(apart)) if apart.any() else count)
    return {
        "liftoff": (b.start[some] - a.start[some]).tolist(),
        "touchdown": (b.end[some] - a.end[some]).tolist(),
        "apex_height": (b.apex_height[some] / a.apex_height[some] - 1.0).tolist(),
    }


def _ratings(run: Analysis, other: Analysis) -> dict[str, Any]:
    reference = run.ratings.reference
    ours, theirs = run.ratings.chosen, other.ratings.about(reference)
    return {
        "rating_reference": reference.value,
        "rating_stance": _mean(theirs.stance) - _mean(ours.stance),
        "rating_flight": _mean(theirs.flight) - _mean(ours.flight),
        "rating_periods": _mean(theirs.periods) - _mean(ours.periods),
    }


def _mean(values: list[float]) -> float:
    known = [value for value in values if isfinite(value)]
    return float(np.mean(known)) if known else nan


def _largest(values: Floats) -> float:
    known = np.abs(values[np.isfinite(values)])
    return float(known.max()) if known.size else nan
