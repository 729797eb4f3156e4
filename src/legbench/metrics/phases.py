"""Stance and flight of a hopping run: touchdown, lift-off, apexes, and the jumps they make.

Touchdown is the foot meeting the ground on its way down, lift-off the vertical contact force
reaching zero (section IV-A). A simulation shows both; on a real leg the controller's phase, which
follows the spring torques, stands in for them, to the row.
"""

from dataclasses import dataclass

import numpy as np

from legbench.kinematics import leg_points
from legbench.metrics.roles import FLIGHT, STANCE, UNKNOWN
from legbench.metrics.rows import extreme, runs_of, zeros_before
from legbench.metrics.source import Recorded
from legbench.signals import Floats, Ints


@dataclass(frozen=True, slots=True, kw_only=True)
class Intervals:
    """Complete phases of one kind, in order; a phase cut by an end of the run is not one."""

    first: Ints
    """First row of each phase (m,)."""
    stop: Ints
    """Row after the last one of each phase (m,)."""
    start: Floats
    """Touchdown of a stance, lift-off of a flight; between the rows if there is truth (m,) [s]."""
    end: Floats
    """Lift-off of a stance, touchdown of a flight (m,) [s]."""
    apex: Floats
    """Time of the lowest trunk in stance, the highest in flight (m,) [s]; NaN for a real flight."""
    apex_height: Floats
    """Height of the hip above the ground at the apex (m,) [m]; NaN for a real flight."""

    def __len__(self) -> int:
        return len(self.first)

    @property
    def duration(self) -> Floats:
        """Duration of each phase (m,) [s]."""
        return self.end - self.start


@dataclass(frozen=True, slots=True, kw_only=True)
class Jumps:
    """Complete jumps: one flight between two complete stances, lower apex to lower apex."""

    takeoff: Ints
    """Index of the stance before each jump (m,)."""
    flight: Ints
    """Index of the flight of each jump (m,)."""
    landing: Ints
    """Index of the stance after each jump (m,)."""
    start: Floats
    """Time of the lower apex before each jump (m,) [s]."""
    end: Floats
    """Time of the lower apex after each jump (m,) [s]."""

    def __len__(self) -> int:
        return len(self.flight)


@dataclass(frozen=True, slots=True, kw_only=True)
class Gait:
    """All complete phases and jumps of a run."""

    stance: Intervals
    flight: Intervals
    jumps: Jumps


def find_gait(recording: Recorded, states: Ints) -> Gait:
    """Phases and jumps of a run, from the state of the foot in every row (n,)."""
    runs = runs_of(states)
    known = runs.value != UNKNOWN
    complete = np.zeros(len(known), dtype=bool)
    complete[1:-1] = known[1:-1] & known[:-2] & known[2:]
    height = _trunk_height(recording, states)
    kinds = []
    for kind in (STANCE, FLIGHT):
        chosen = complete & (runs.value == kind)
        kinds.append(_intervals(recording, height, kind, runs.first[chosen], runs.stop[chosen]))
    return Gait(stance=kinds[0], flight=kinds[1], jumps=_jumps(*kinds))


def _trunk_height(recording: Recorded, states: Ints) -> Floats:
    """Hip above the ground (n,) [m]; a real leg only knows it while its foot stands there."""
    if recording.has_truth:
        return recording["trunk_pos"][:, 1]
    lengths = recording.description.design.lengths
    above_foot = -leg_points(recording["joint_pos"], lengths)[:, 3, 1]
    return np.where(states == STANCE, above_foot, np.nan)


def _intervals(
    recording: Recorded, height: Floats, kind: int, first: Ints, stop: Ints
) -> Intervals:
    apexes = [
        _apex(recording.time, height, kind, low, high)
        for low, high in zip(first.tolist(), stop.tolist(), strict=True)
    ]
    apex, apex_height = np.array(apexes, dtype=np.float64).reshape(-1, 2).T
    start, end = (first, stop) if kind == STANCE else (stop, first)
    touchdown, liftoff = _touchdowns(recording, start), _liftoffs(recording, end)
    return Intervals(
        first=first,
        stop=stop,
        start=touchdown if kind == STANCE else liftoff,
        end=liftoff if kind == STANCE else touchdown,
        apex=apex,
        apex_height=apex_height,
    )


def _apex(time: Floats, height: Floats, kind: int, first: int, stop: int) -> tuple[float, float]:
    inside = height[first:stop]
    if not np.all(np.isfinite(inside)):
        return np.nan, np.nan
    row = np.argmin(inside) if kind == STANCE else np.argmax(inside)
    return extreme(time, height, first + int(row))


def _touchdowns(recording: Recorded, rows: Ints) -> Floats:
    if not recording.has_truth:
        return recording.time[rows]
    return zeros_before(recording.time, recording["foot_pos"][:, 1], rows, otherwise=1.0)


def _liftoffs(recording: Recorded, rows: Ints) -> Floats:
    if not recording.has_truth:
        return recording.time[rows]
    return zeros_before(recording.time, recording["contact_force"][:, 1], rows, otherwise=0.5)


def _jumps(stance: Intervals, flight: Intervals) -> Jumps:
    whole = np.isin(flight.first, stance.stop) & np.isin(flight.stop, stance.first)
    takeoff = np.searchsorted(stance.stop, flight.first[whole])
    landing = np.searchsorted(stance.first, flight.stop[whole])
    return Jumps(
        takeoff=takeoff,
        flight=np.flatnonzero(whole),
        landing=landing,
        start=stance.apex[takeoff],
        end=stance.apex[landing],
    )
