"""Oscillation periods of a leg in a fixed setup, from the turning points of its radial mode.

A period runs from one turning point of z2 to the next on the same side (section VI-B, Fig. 5).
"""

from dataclasses import dataclass

import numpy as np

from legbench.metrics.modal import Trajectory
from legbench.metrics.rows import runs_of
from legbench.phases import Counting
from legbench.signals import Floats, Ints

STILL = 0.02
"""Share of the fastest z2 rate below which the leg counts as still [-]: noise around zero makes
no turning point. Far below the slowest oscillation that Fig. 5 counts, a tenth of dz2."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Periods:
    """Complete oscillation periods, in order and without gaps."""

    start: Floats
    """Turning point that begins each period, between the rows (m,) [s]."""
    end: Floats
    """Turning point that ends each period (m,) [s]."""
    amplitude: Floats
    """Half of z2's range within each period (m,) [rad]."""
    first: Ints
    """First row of each period that is rated (m,)."""
    stop: Ints
    """Row after the last one of each period (m,)."""

    def __len__(self) -> int:
        return len(self.start)


def turning_points(time: Floats, rate: Floats) -> Floats:
    """Instants at which `rate` (n,) passes zero in the direction of its first motion (m,) [s].

    The first row is one of them when the leg is still there. A zero counts once the rate has
    exceeded `STILL` of its maximum on both sides of it; instants are interpolated linearly.
    """
    threshold = STILL * np.max(np.abs(rate), initial=0.0)
    moving = np.flatnonzero(np.abs(rate) > threshold)
    if len(moving) == 0:
        return np.zeros(0)
    direction = np.sign(rate[moving])
    runs = runs_of(direction)
    points = [time[0]] if moving[0] > 0 else []
    for begin in runs.first[1:][runs.value[1:] == direction[0]]:
        last, now = moving[begin - 1], moving[begin]
        ahead = direction[0] * rate[last : now + 1]
        row = last + int(np.flatnonzero(ahead[:-1] <= 0.0)[-1])
        share = rate[row] / (rate[row] - rate[row + 1])
        points.append(time[row] + share * (time[row + 1] - time[row]))
    return np.array(points, dtype=np.float64)


def find_periods(moved: Trajectory, first: int, counting: Counting, answer: int = 0) -> Periods:
    """Oscillation periods of a run that count, from its first control action on.

    Args:
        moved: how the run moved.
        first: row of its first control action.
        counting: which of the leading periods count.
        answer: row in which the motors first move; the leg is at rest in those before it, which
            belong to the first period's time but not to its rating.
    """
    points = turning_points(moved.time[first:], moved.modal_rate[first:, 1])
    periods = _between(moved.time, moved.modal[:, 1], points, answer)
    small = np.flatnonzero(periods.amplitude <= counting.smallest)
    count = int(small[0]) if len(small) else len(periods)
    return _leading(periods, count if counting.most is None else min(count, counting.most))


def _between(time: Floats, radial: Floats, points: Floats, answer: int) -> Periods:
    rows = np.searchsorted(time, points)
    first, stop = rows[:-1], rows[1:]
    amplitude = [0.5 * np.ptp(radial[low:high]) for low, high in zip(first, stop, strict=True)]
    return Periods(
        start=points[:-1],
        end=points[1:],
        amplitude=np.array(amplitude, dtype=np.float64),
        first=np.clip(answer, first, stop),
        stop=stop,
    )


def _leading(periods: Periods, count: int) -> Periods:
    return Periods(
        start=periods.start[:count],
        end=periods.end[:count],
        amplitude=periods.amplitude[:count],
        first=periods.first[:count],
        stop=periods.stop[:count],
    )
