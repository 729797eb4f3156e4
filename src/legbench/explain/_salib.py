"""The one door to SALib, the library behind the extra `screening`."""

from typing import Any

import numpy as np

from legbench.errors import MissingExtraError
from legbench.signals import Floats

try:
    from SALib.analyze import morris as morris_analysis  # pyrefly: ignore[missing-import]
    from SALib.analyze import sobol as sobol_analysis  # pyrefly: ignore[missing-import]
    from SALib.sample import morris as morris_sample  # pyrefly: ignore[missing-import]
    from SALib.sample import sobol as sobol_sample  # pyrefly: ignore[missing-import]
except ImportError as error:
    raise MissingExtraError(
        "SALib is not installed; screening needs it: pip install 'legbench[screening]'"
    ) from error

Problem = dict[str, Any]


def morris_points(problem: Problem, trajectories: int, levels: int, seed: int) -> Floats:
    """Points (n, d) of so many trajectories through a problem of d variables."""
    return morris_sample.sample(problem, trajectories, num_levels=levels, seed=seed)


def morris_effects(
    problem: Problem, points: Floats, values: Floats, levels: int, seed: int
) -> tuple[Floats, Floats]:
    """Mean size of each variable's elementary effects (d,), and their spread (d,)."""
    found = morris_analysis.analyze(problem, points, values, num_levels=levels, seed=seed)
    return np.asarray(found["mu_star"]), np.asarray(found["sigma"])


def sobol_points(problem: Problem, base: int, seed: int) -> Floats:
    """Points (base (d + 2), d) of Saltelli's scheme."""
    return sobol_sample.sample(problem, base, calc_second_order=False, seed=seed)


def sobol_shares(problem: Problem, values: Floats, seed: int) -> tuple[Floats, Floats]:
    """Share of the variance of each variable with all interactions (d,), and of it alone (d,)."""
    found = sobol_analysis.analyze(problem, values, calc_second_order=False, seed=seed)
    return np.asarray(found["ST"]), np.asarray(found["S1"])
