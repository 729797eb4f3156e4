"""Figures of a hopping run: how high, how far, how often (section VI-C)."""

from dataclasses import dataclass

import numpy as np

from legbench.kinematics import joint_to_polar, polar_angle
from legbench.metrics.phases import Gait
from legbench.metrics.source import Recorded
from legbench.signals import Floats

LAST = 3
"""The paper reports three consecutive jumps (Fig. 6); here the last three, or what there is."""

SETTLE = 1.0
"""Time after the first control action in which the hop may still grow [s]; about five jumps."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JumpFigures:
    """Figures of the complete jumps of a run; NaN where no jump or no truth shows them.

    The limit-cycle figures, from `hop_freq` down, leave out the jumps before `first`.
    """

    count: int
    """Number of complete jumps in the whole run."""
    first: int
    """Index of the first jump of the limit cycle, the first that begins `settle` seconds or more
    after the first control action; equal to `count` when none does."""
    trunk_excursion: float
    """Largest rise of the hip from lower to upper apex in one of the last three jumps [m]."""
    foot_clearance: float
    """Highest foot tip above the ground in the last three flights [m]."""
    drift: float
    """Range of the hip's horizontal travel over the last three jumps together [m]."""
    foot_travel: float
    """Widest horizontal range of the foot tip in one of the last three flights, in the world
    [m]."""
    foot_travel_in_hip: float
    """Widest horizontal range of the foot tip seen from the hip [m]; known on a real leg, too."""
    hop_freq: float
    """Number of jumps per time, lower apex to lower apex [Hz]."""
    flight_time: float
    """Mean duration of the jumps' flights [s]."""
    stance_time: float
    """Mean duration of the stances that the jumps take off from [s]."""
    polar_max: float
    """Largest |x1| from the first to the last of these jumps [rad]."""
    apex_change: float
    """Largest change of the upper apex from one jump to the next [m]: zero in a limit cycle."""


def jump_figures(
    recording: Recorded, gait: Gait, action: int, settle: float = SETTLE
) -> JumpFigures:
    """Measure the complete jumps of a run whose first control action is in row `action`."""
    jumps = gait.jumps
    begin = recording.time[action] + settle if action < len(recording.time) else np.inf
    first = int(np.searchsorted(jumps.start, begin))
    limit_cycle = _limit_cycle(recording, gait, first)
    return JumpFigures(count=len(jumps), first=first, **_last_jumps(recording, gait), **limit_cycle)


def _last_jumps(recording: Recorded, gait: Gait) -> dict[str, float]:
    jumps, flight = gait.jumps, gait.flight
    trunk, foot = recording["trunk_pos"], recording["foot_pos"]
    flown = [
        slice(low, high)
        for low, high in zip(
            flight.first[jumps.flight][-LAST:], flight.stop[jumps.flight][-LAST:], strict=True
        )
    ]
    lowest = np.minimum(
        gait.stance.apex_height[jumps.takeoff], gait.stance.apex_height[jumps.landing]
    )
    rise = flight.apex_height[jumps.flight] - lowest
    whole = _rows(recording.time, jumps.start[-LAST:], jumps.end[-LAST:])
    return {
        "trunk_excursion": _largest(rise[-LAST:]),
        "foot_clearance": _largest([_largest(foot[rows, 1]) for rows in flown]),
        "drift": _range(trunk[whole, 0]),
        "foot_travel": _largest([_range(foot[rows, 0]) for rows in flown]),
        "foot_travel_in_hip": _largest([_range(_ahead(recording, rows)) for rows in flown]),
    }


def _ahead(recording: Recorded, rows: slice) -> Floats:
    """Horizontal place of the foot tip, seen from the hip, in some rows (m,) [m]."""
    shank = recording.description.design.shank.length
    polar = joint_to_polar(recording["joint_pos"][rows], shank)
    return polar[:, 1] * np.sin(polar[:, 0])


def _limit_cycle(recording: Recorded, gait: Gait, first: int) -> dict[str, float]:
    jumps = gait.jumps
    start, end = jumps.start[first:], jumps.end[first:]
    joint_pos = recording["joint_pos"][_rows(recording.time, start, end)]
    apex = gait.flight.apex_height[jumps.flight[first:]]
    period = _mean(end - start)
    return {
        "hop_freq": 1.0 / period if period > 0.0 else np.nan,
        "flight_time": _mean(gait.flight.duration[jumps.flight[first:]]),
        "stance_time": _mean(gait.stance.duration[jumps.takeoff[first:]]),
        "polar_max": _largest(np.abs(polar_angle(joint_pos))),
        "apex_change": _largest(np.abs(np.diff(apex))),
    }


def _rows(time: Floats, start: Floats, end: Floats) -> slice:
    """Rows from the first start to the last end."""
    if len(start) == 0:
        return slice(0, 0)
    low, high = np.searchsorted(time, [start[0], end[-1]])
    return slice(int(low), int(high))


def _largest(values: Floats | list[float]) -> float:
    return float(np.max(values)) if len(values) else np.nan


def _range(values: Floats) -> float:
    return float(np.ptp(values)) if len(values) else np.nan


def _mean(values: Floats) -> float:
    return float(np.mean(values)) if len(values) else np.nan
