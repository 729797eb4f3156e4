"""Cross-check of the search by another method, differential evolution."""

import numpy as np
from scipy.optimize import differential_evolution

from legbench.design.requirements import Bounds
from legbench.signals import Floats
from legbench.synthesis.search import Cost, SearchResult

GENERATIONS = 600
POPULATION = 10
"""Number of candidates for each generation and decision variable."""


def evolve(bounds: Bounds, cost: Cost, seed: int) -> SearchResult:
    """Minimise `cost` within bounds by differential evolution, with no gradient step after it."""
    evaluations = 0

    def counted(columns: Floats) -> Floats:
        nonlocal evaluations
        evaluations += columns.shape[1] if columns.ndim == 2 else 1
        return cost(columns.T)

    result = differential_evolution(
        counted,
        np.stack((bounds.lower, bounds.upper), axis=-1),
        maxiter=GENERATIONS,
        popsize=POPULATION,
        tol=1e-9,
        rng=np.random.default_rng(seed),
        polish=False,
        updating="deferred",
        vectorized=True,
    )
    return SearchResult(
        free=np.asarray(result.x),
        cost=float(result.fun),
        evaluations=evaluations,
        complete=bool(result.success),
    )
