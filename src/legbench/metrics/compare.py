"""Two runs side by side, in numbers: how far apart they moved, jumped and were rated.

Differences are the other run's value minus the run's. Both are taken from plant time zero and in
the run's modal convention; a run of shorter period is interpolated to the rows of the other.
"""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from math import isfinite, nan
from typing import Any

import numpy as np

from legbench.errors import RecordingError
from legbench.kinematics import joint_to_modal
from legbench.metrics.phases import Gait, find_gait
from legbench.metrics.ratings import rate_run
from legbench.metrics.source import Recorded, terms_of
from legbench.metrics.stance import MINIMUM_PHASE
from legbench.signals import Floats

ASKED = ("design", "setup", "controller", "conventions", "servo", "ground")
"""Tables of a manifest in which two runs of the same experiment agree."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Differences:
    """Another run minus a run, row by row, over the time that both have."""

    time: Floats
    """Of the rows of the longer period (n,) [s]."""
    joint: Floats
    """(n, 2) [rad]"""
    z2: Floats
    """In the run's modal convention (n,) [rad]."""


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
    """Entries of the manifest, other than plant and linkage, in which they differ."""
    period: float
    """Of the rows compared [s]."""
    duration: float
    """Time that both have [s]."""
    first_touchdown: float
    """When the first of them landed first [s]."""
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
    rating_stance: float
    """Difference of the mean P^r of all complete stances [-]."""
    rating_flight: float
    """Of all complete flights [-]."""
    rating_periods: float
    """Of all oscillation periods [-]."""

    def to_json(self) -> dict[str, Any]:
        """Fields by name for strict JSON: NaN is None, alone and in lists."""
        return {name: _plain(value) for name, value in asdict(self).items()}


def compare(recording: Recorded, other: Recorded) -> Comparison:
    """Measure how `other` differs from a run; designs, setups and periods may be different.

    Raises:
        FormatError: a manifest describes no leg, or an unknown setup or convention.
        RecordingError: they have no time in common.
    """
    apart = differences(recording, other)
    gaits = find_gait(recording), find_gait(other)
    landing = _first_touchdown((recording, other), gaits)
    before = apart.time < landing
    return Comparison(
        run=str(recording.path),
        other=str(other.path),
        run_name=name_of(recording.manifest),
        other_name=name_of(other.manifest),
        unlike=unlike(recording.manifest, other.manifest),
        period=round(_period(apart.time), 9),
        duration=float(apart.time[-1] - apart.time[0]),
        first_touchdown=landing,
        joint_before_touchdown=_largest(apart.joint[before]),
        z2_before_touchdown=_largest(apart.z2[before]),
        joint_max=_largest(apart.joint),
        z2_max=_largest(apart.z2),
        **_flights(*gaits),
        **_ratings((recording, other), gaits),
    )


def differences(recording: Recorded, other: Recorded) -> Differences:
    """Subtract a run's angles from another's at the rows of the longer period.

    Raises:
        FormatError: a manifest without a leg or with an unknown convention.
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
    convention = terms_of(recording.manifest).convention
    z2 = [joint_to_modal(joint, convention)[:, 1] for joint in (ours, theirs)]
    return Differences(time=time, joint=theirs - ours, z2=z2[1] - z2[0])


def first_touchdown(recording: Recorded, other: Recorded) -> float:
    """When the first of two runs lands first [s]; NaN where none does.

    Raises:
        FormatError: a manifest without a leg.
    """
    return _first_touchdown((recording, other), (find_gait(recording), find_gait(other)))


def name_of(manifest: Mapping[str, Any]) -> str:
    """Plant, linkage and design of a run, as far as its manifest names them.

    The analytic plant has no linkage: its equations are those of the ideal one.
    """
    plant = manifest.get("plant")
    linkage = manifest.get("linkage", {}).get("kind") if plant != "analytic" else None
    return " / ".join(filter(None, [plant, linkage, manifest.get("design", {}).get("name")]))


def unlike(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> list[str]:
    """Dotted entries in which two manifests differ, of the tables that both have."""
    both = [name for name in ASKED if name in ours and name in theirs]
    return [entry for name in both for entry in _unlike(name, ours[name], theirs[name])]


def _unlike(path: str, ours: Any, theirs: Any) -> Iterator[str]:
    if isinstance(ours, Mapping) and isinstance(theirs, Mapping):
        for key in sorted(ours.keys() | theirs.keys()):
            yield from _unlike(f"{path}.{key}", ours.get(key), theirs.get(key))
    elif ours != theirs:
        yield path


def _period(time: Floats) -> float:
    return float(np.median(np.diff(time))) if len(time) > 1 else 0.0


def _at(time: Floats, run: Recorded) -> Floats:
    """Joint angles of a run at some times, (n, 2) [rad]."""
    joint = run["joint_pos"]
    return np.stack([np.interp(time, run.time, angle) for angle in joint.T], axis=-1)


def _first_touchdown(runs: tuple[Recorded, Recorded], gaits: tuple[Gait, Gait]) -> float:
    """When the first of two runs lands [s]; a leg put down at its first rows does not land."""
    first = np.inf
    for run, gait in zip(runs, gaits, strict=True):
        landings = np.concatenate([gait.stance.start, gait.flight.end])
        later = landings[landings > run.time[0] + MINIMUM_PHASE]
        first = float(np.min(later, initial=first))
    return first if isfinite(first) else nan


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


def _ratings(runs: tuple[Recorded, Recorded], gaits: tuple[Gait, Gait]) -> dict[str, Any]:
    ours, theirs = (
        rate_run(run, terms_of(run.manifest), gait) for run, gait in zip(runs, gaits, strict=True)
    )
    names = ("rating_stance", "rating_flight", "rating_periods")
    return {name: _mean(theirs[name]) - _mean(ours[name]) for name in names}


def _mean(values: list[float]) -> float:
    known = [value for value in values if isfinite(value)]
    return float(np.mean(known)) if known else nan


def _largest(values: Floats) -> float:
    known = np.abs(values[np.isfinite(values)])
    return float(known.max()) if known.size else nan


def _plain(value: Any) -> Any:
    if isinstance(value, list):
        return [_plain(entry) for entry in value]
    return None if isinstance(value, float) and not isfinite(value) else value
