"""Thinning of the lines of long runs, which have more points than a picture has dots."""

from typing import Any, Final

import numpy as np

from legbench.signals import Floats, Ints
from legbench.viz.print._matplotlib import Axes

MOST_POINTS: Final = 1 << 16
"""Points of one line up to which all are drawn, at once: a minute at 1 kHz."""
CHUNK_POINTS: Final = 1 << 13
"""Points of a longer line that are drawn at once: a path takes memory for every dot that it
crosses, a hundred megabytes for so many back and forth through a panel."""
PLANE_FREQ: Final = 200.0
"""Lowest rate at which a trajectory in a plane looks smooth, forty points a jump [Hz]."""


def stride(rows: int) -> int:
    """Step from point to point at which a line over time of so many rows is drawn."""
    return max(1, -(-rows // MOST_POINTS))


def plane_stride(time: Floats) -> int:
    """Step at which the trajectory in a plane is drawn of rows with these times (n,) [s]."""
    step = stride(len(time))
    if step == 1:
        return 1
    return max(1, min(step, int(1.0 / (PLANE_FREQ * float(np.median(np.diff(time)))) + 1e-6)))


def draw_line(panel: Axes, x: Floats, y: Floats, *, label: str = "_", **look: Any) -> None:
    """Draw y over x (n,) as matplotlib's `plot` does, a long line in parts that are joined."""
    size = len(x) if len(x) <= MOST_POINTS else CHUNK_POINTS
    for first in range(0, max(len(x), 1), max(size, 1)):
        part = slice(first, first + size + 1)
        panel.plot(x[part], y[part], label="_" if first else label, **look)


def peaks(values: Floats, step: int) -> Ints:
    """Rows, in order, of the smallest and the largest of each 2 * `step` values (n,).

    They have the same outline as all the rows, which is what a line over time shows.
    """
    if step == 1:
        return np.arange(len(values))
    size = 2 * step
    whole = len(values) // size * size
    parts = np.where(np.isnan(values[:whole]), np.inf, values[:whole]).reshape(-1, size)
    lowest = np.argmin(parts, axis=1)
    parts[np.isinf(parts)] = -np.inf
    rows = np.stack([lowest, np.argmax(parts, axis=1)], axis=1)
    rows = np.sort(rows, axis=1) + np.arange(0, whole, size)[:, None]
    return np.concatenate([rows.ravel(), np.arange(whole, len(values))])
