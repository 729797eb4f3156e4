"""Thinning of the lines of long runs, which have more points than a picture has dots."""

from typing import Final

import numpy as np

from legbench.signals import Floats, Ints

MOST_POINTS: Final = 1 << 16
"""Points of one line up to which all are drawn: a minute at 1 kHz, some thirty a dot; to draw one
takes a kilobyte."""


def stride(rows: int) -> int:
    """Step from point to point at which a line of so many rows is drawn."""
    return max(1, -(-rows // MOST_POINTS))


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
