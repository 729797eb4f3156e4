"""Damped least squares from many starts at once, with residuals that are computed in batches."""

from collections.abc import Callable

import numpy as np

from legbench.signals import Floats, Ints

ROUNDS = 8
"""Number of steps from each start [-]."""
DAMPINGS = (1e-3, 1e-1, 10.0)
"""Factors of the present damping that are tried in each round [-]."""
FIRST_DAMPING = 1.0
"""Damping of the first round, in units of the normal matrix's diagonal [-]."""
LARGEST_DAMPING = 1e6
"""Damping beyond which a start has arrived [-]."""


def refine(
    residuals: Callable[[Floats, Ints], Floats],
    starts: Floats,
    low: Floats,
    high: Floats,
    steps: Floats,
) -> Floats:
    """Points (s, d) near starts (s, d) with smaller sums of squares, between `low` and `high`.

    The method of Levenberg and Marquardt with forward differences; no point is worse than its
    start.

    Args:
        residuals: residuals (n, m) of points (n, d), computed together, each point belonging to the
            start of that number (n,).
        starts: points to begin with.
        low: lower bounds of each start (s, d).
        high: upper bounds of each start (s, d).
        steps: lengths of the differences of each start (s, d).
    """
    points, count = starts.copy(), starts.shape[1]
    damping = np.full(len(points), FIRST_DAMPING)
    rows = np.arange(len(points))
    values = residuals(points, rows)
    for _ in range(ROUNDS):
        if np.all(damping >= LARGEST_DAMPING):
            break
        # Forward, or backward at the upper bound.
        signed = np.where(points + steps > high, -steps, steps)
        moved = points[:, np.newaxis] + signed[:, :, np.newaxis] * np.eye(count)
        beside = residuals(moved.reshape(-1, count), np.repeat(rows, count))
        beside = beside.reshape(len(points), count, -1)
        slopes = (beside - values[:, np.newaxis]) / signed[:, :, np.newaxis]
        tried = _tried(points, values, slopes, damping, low, high)
        found = residuals(tried.reshape(-1, count), np.repeat(rows, len(DAMPINGS)))
        found = found.reshape(len(points), len(DAMPINGS), -1)
        cost = np.sum(np.square(found), axis=-1)
        best = np.argmin(cost, axis=1)
        better = cost[rows, best] < np.sum(np.square(values), axis=-1)
        points[better] = tried[rows, best][better]
        values[better] = found[rows, best][better]
        factor = np.where(better, np.array(DAMPINGS)[best], 10.0 * DAMPINGS[-1])
        damping = np.clip(damping * factor, 1e-9, LARGEST_DAMPING)
    return points


def _tried(
    points: Floats, values: Floats, slopes: Floats, damping: Floats, low: Floats, high: Floats
) -> Floats:
    """Points (s, k, d) that each damping leads to, within the bounds."""
    normal = np.einsum("sdm,sem->sde", slopes, slopes)
    downhill = -np.einsum("sdm,sm->sd", slopes, values)
    diagonal = np.einsum("sdd->sd", normal)
    # A coordinate without any effect stays where it is.
    diagonal = np.where(diagonal > 0.0, diagonal, 1.0)
    found = []
    for factor in DAMPINGS:
        added = (factor * damping)[:, np.newaxis] * diagonal
        matrix = normal + added[:, :, np.newaxis] * np.eye(points.shape[1])
        move = np.linalg.solve(matrix, downhill[:, :, np.newaxis])[..., 0]
        found.append(np.clip(points + move, low, high))
    return np.stack(found, axis=1)
