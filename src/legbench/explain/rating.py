"""Oscillation periods and ratings of many runs at once, as `metrics` finds them one by one."""

from dataclasses import dataclass

import numpy as np

from legbench.metrics.periods import STILL
from legbench.metrics.rating import alignment
from legbench.phases import Counting
from legbench.signals import Bools, Floats, Ints


@dataclass(frozen=True, slots=True, kw_only=True)
class Shapes:
    """Ratings of the leading oscillation periods of n runs, NaN where there is no such period."""

    equilibrium: Floats
    """P^r of eq. (14) about the equilibrium, period by period (n, p) [-]."""
    motor: Floats
    """P^r about the motor (n, p) [-]."""
    amplitude: Floats
    """Half of z2's range within each period (n, p) [rad]."""
    counted: Ints
    """Number of leading periods that the paper would count (n,)."""
    broken: Bools
    """Whether the leg straightened or folded through, or ran away (n,)."""

    def __len__(self) -> int:
        return len(self.counted)

    @classmethod
    def unknown(cls, count: int, periods: int) -> "Shapes":
        """Ratings of so many runs that have still to be put in."""
        equilibrium, motor, amplitude = np.full((3, count, periods), np.nan)
        return cls(
            equilibrium=equilibrium,
            motor=motor,
            amplitude=amplitude,
            counted=np.zeros(count, dtype=np.int64),
            broken=np.zeros(count, dtype=np.bool_),
        )

    def put(self, places: Ints, some: "Shapes") -> None:
        """Put the ratings of some runs into their places (m,)."""
        for mine, theirs in (
            (self.equilibrium, some.equilibrium),
            (self.motor, some.motor),
            (self.amplitude, some.amplitude),
            (self.counted, some.counted),
            (self.broken, some.broken),
        ):
            mine[places] = theirs


@dataclass(frozen=True, slots=True, kw_only=True)
class Rows:
    """Rows of n runs from their first control action on, equally spaced in time."""

    radial: Floats
    """Modal coordinate z2 (n, t) [rad]."""
    radial_rate: Floats
    """Its rate (n, t) [rad/s]."""
    about_equilibrium: Floats
    """Deflection from the equilibrium (n, t, 2) [rad]."""
    about_motor: Floats
    """Deflection from the motor (n, t, 2) [rad]."""
    broken: Bools
    """Whether the run is none that can be rated (n,)."""

    def taken(self, chosen: Bools) -> "Rows":
        """Choose runs (n,)."""
        return Rows(
            radial=self.radial[chosen],
            radial_rate=self.radial_rate[chosen],
            about_equilibrium=self.about_equilibrium[chosen],
            about_motor=self.about_motor[chosen],
            broken=self.broken[chosen],
        )


def rate_rows(rows: Rows, periods: int, counting: Counting) -> Shapes:
    """Rate the leading `periods` periods of every run, whether the paper counts them or not."""
    legs, bounds, turns = turning_rows(rows.radial_rate)
    shown = min(periods, max(turns - 1, 0))
    place = np.arange(len(legs)) - np.searchsorted(legs, legs)
    starts = np.full((len(rows.radial), turns), -1, dtype=np.int64)
    starts[legs, place] = bounds
    sizes = np.full(starts.shape, np.nan)
    sizes[legs, place] = _half_range(rows.radial, legs, bounds)
    first, stop = starts[:, :shown], starts[:, 1 : shown + 1]
    known = stop >= 0
    found = [
        _padded(np.where(known, values, np.nan), periods)
        for values in (
            _mean_between(alignment(rows.about_equilibrium), first, stop),
            _mean_between(alignment(rows.about_motor), first, stop),
            sizes[:, :shown],
        )
    ]
    for each in found:
        each[rows.broken] = np.nan
    return Shapes(
        equilibrium=found[0],
        motor=found[1],
        amplitude=found[2],
        counted=count_leading(found[2], counting),
        broken=rows.broken,
    )


def count_leading(amplitude: Floats, counting: Counting) -> Ints:
    """Number of leading periods (n,) whose amplitudes (n, p) [rad] count."""
    small = ~(amplitude > counting.smallest)
    count = np.where(small.any(axis=1), np.argmax(small, axis=1), amplitude.shape[1])
    return count if counting.most is None else np.minimum(count, counting.most)


def turning_rows(rate: Floats) -> tuple[Ints, Ints, int]:
    """Rows after the turning points of rates (n, t), in the direction of each first motion.

    Returns the run and the row of every turning point, sorted, and the largest number in a run.
    The rule is that of `metrics.periods.turning_points`.
    """
    columns = np.arange(rate.shape[1])
    moving = np.abs(rate) > STILL * np.max(np.abs(rate), axis=1, keepdims=True)
    last = np.maximum.accumulate(np.where(moving, columns, -1), axis=1)
    begin = np.argmax(moving, axis=1)
    direction = np.sign(rate[np.arange(len(rate)), begin])[:, np.newaxis]
    ahead = direction * rate
    before = last[:, :-1]
    was = np.take_along_axis(ahead, np.maximum(before, 0), axis=1)
    crossed = moving[:, 1:] & (before >= 0) & (ahead[:, 1:] > 0.0) & (was < 0.0)
    behind = np.maximum.accumulate(np.where(ahead <= 0.0, columns, -1), axis=1)
    legs, places = np.nonzero(crossed)
    rows = behind[legs, places]
    # The first row at or after the interpolated zero.
    rows = rows + (ahead[legs, rows] < 0.0)
    still = np.flatnonzero(moving.any(axis=1) & (begin > 0))
    legs = np.concatenate([still, legs])
    rows = np.concatenate([np.zeros(len(still), dtype=rows.dtype), rows])
    order = np.lexsort((rows, legs))
    turns = np.bincount(legs, minlength=1).max() if len(legs) else 0
    return legs[order], rows[order], int(turns)


def _mean_between(aligned: Floats, first: Ints, stop: Ints) -> Floats:
    """Mean of `aligned` (n, t) over the rows [first, stop) of each period (n, p); NaNs left out."""
    known = np.isfinite(aligned)
    total = _running(np.where(known, aligned, 0.0))
    number = _running(known.astype(np.float64))
    sums, counts = (
        np.take_along_axis(each, stop, axis=1) - np.take_along_axis(each, first, axis=1)
        for each in (total, number)
    )
    return np.where(counts > 0.0, sums / np.maximum(counts, 1.0), np.nan)


def _running(values: Floats) -> Floats:
    """Sum of all columns before each one (n, t + 1)."""
    sums = np.zeros((len(values), values.shape[1] + 1))
    np.cumsum(values, axis=1, out=sums[:, 1:])
    return sums


def _half_range(radial: Floats, legs: Ints, rows: Ints) -> Floats:
    """Half of the range of z2 (n, t) from each turning point to the next of the same run."""
    if len(legs) == 0:
        return np.zeros(0)
    places = legs * radial.shape[1] + rows
    flat = radial.ravel()
    return 0.5 * (np.maximum.reduceat(flat, places) - np.minimum.reduceat(flat, places))


def _padded(values: Floats, width: int) -> Floats:
    missing = width - values.shape[1]
    return np.pad(values, ((0, 0), (0, missing)), constant_values=np.nan)
