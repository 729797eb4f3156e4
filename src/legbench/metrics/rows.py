"""Functions of sampled rows: stretches of equal values, and instants between the samples."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from legbench.signals import Bools, Floats, Ints


@dataclass(frozen=True, slots=True, kw_only=True)
class Runs:
    """Stretches of rows over which a column keeps its value; `m` of them, all rows covered."""

    first: Ints
    """First row of each stretch (m,)."""
    stop: Ints
    """Row after the last one of each stretch (m,)."""
    value: NDArray[Any]
    """Value of each stretch (m,)."""


def runs_of(column: NDArray[Any]) -> Runs:
    """Run-length encoding of a column (n,)."""
    if len(column) == 0:
        none = np.zeros(0, dtype=np.int64)
        return Runs(first=none, stop=none, value=column)
    edges = np.flatnonzero(column[1:] != column[:-1]) + 1
    first = np.concatenate([[0], edges])
    stop = np.concatenate([edges, [len(column)]])
    return Runs(first=first, stop=stop, value=column[first])


def without_short(time: Floats, column: Bools, value: bool, minimum: float) -> Bools:
    """Flip the stretches of `value` that are shorter than `minimum` [s]; those at the ends stay.

    A stretch lasts from its first row to the first row of the next; one at either end of the
    recording may have been longer than what was seen of it.
    """
    runs = runs_of(column)
    cleaned = column.copy()
    for first, stop in zip(runs.first[1:-1], runs.stop[1:-1], strict=True):
        if column[first] == value and time[stop] - time[first] < minimum:
            cleaned[first:stop] = not value
    return cleaned


def zeros_before(time: Floats, falling: Floats, rows: Ints, otherwise: float) -> Floats:
    """Time at which `falling` (n,) reached zero in the step before each of `rows` (m,) [s].

    On the line through the two samples before that step, clipped to it: what follows an event,
    impact or flight, obeys another law and is not interpolated into. Where those samples do not
    fall, the share `otherwise` of the step. Rows are 1 or more; their times need not be even.
    """
    last, before = rows - 1, np.maximum(rows - 2, 0)
    step = time[rows] - time[last]
    fall = falling[before] - falling[last]
    falls = fall > 0.0
    # The fall goes on over this step as it went over the one before, which may be a longer one.
    stretch = (time[last] - time[before]) / step
    share = np.where(falls, falling[last] / np.where(falls, fall, 1.0) * stretch, otherwise)
    return time[last] + np.clip(share, 0.0, 1.0) * step


def extreme(time: Floats, value: Floats, row: int) -> tuple[float, float]:
    """Time [s] and value of the parabola through three samples around the extreme sample `row`.

    The sample itself at either end of the column, or where the three lie on a line. The times of
    the samples need not be even.
    """
    if not 0 < row < len(value) - 1:
        return float(time[row]), float(value[row])
    left, right = np.diff(time[row - 1 : row + 2])
    fall, rise = np.diff(value[row - 1 : row + 2])
    # Divided differences: slope at the sample, and half of the second derivative.
    bend = (rise / right - fall / left) / (left + right)
    if not (np.isfinite(bend) and bend != 0.0):
        return float(time[row]), float(value[row])
    slope = (fall / left * right + rise / right * left) / (left + right)
    offset = float(np.clip(-0.5 * slope / bend, -0.5 * left, 0.5 * right))
    return float(time[row] + offset), float(value[row] + (slope + bend * offset) * offset)
