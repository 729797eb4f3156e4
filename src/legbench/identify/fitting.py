"""Least squares by damped normal equations, over a horizon that grows, from several starts.

A swing that is predicted half a period off has no slope towards the truth. So the first seconds
are fitted first: within a tenth of a second no frequency can be wrong by half a period, and each
longer horizon starts where the shorter one ended.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from legbench.errors import PlantFault
from legbench.identify.prediction import Guess
from legbench.identify.problem import Misfit, Problem
from legbench.signals import Floats

HORIZONS: Final = (0.1, 0.3, 1.0, None)
"""Times after the first motion of the motors that are fitted one after the other [s]."""
ROUGH_STEPS: Final = 15
"""Most steps of a horizon that is not the whole run [-]."""
MOST_STEPS: Final = 60
"""Most steps of the whole run [-]."""
SMALLEST_GAIN: Final = 1e-9
"""Share of the sum of squares below which a step has gained nothing [-]."""
ROUGH_GAIN: Final = 1e-3
"""Such share for a horizon that is not the whole run [-]."""
LONGEST_STEP: Final = 1.0
"""Longest step in any logarithm or scale [-]: a factor of e."""
FIRST_DAMPING, MOST_DAMPING = 1e-3, 1e9
"""Damping of the normal equations at first, and where a fit gives up [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LeastSquaresFit:
    """End of a fit."""

    misfit: Misfit
    evaluations: int
    """Number of times that all runs were predicted."""
    converged: bool
    """Whether it ended because nothing was left to gain."""


def fit(
    problem: Problem, guess: Guess, horizons: Sequence[float | None] = HORIZONS
) -> LeastSquaresFit:
    """Fit a problem from one guess.

    Raises:
        PlantFault: no leg can be predicted from the guess.
    """
    longest = max(float(trial.time[-1] - trial.time[0]) for trial in problem.trials)
    found: LeastSquaresFit | None = None
    evaluations = 0
    for horizon in horizons:
        if horizon is not None and horizon > longest:
            continue
        found = _descend(problem, guess if found is None else found.misfit.guess, horizon)
        evaluations += found.evaluations
    if found is None:
        raise PlantFault("no horizon", "no horizon of the fit is as short as the runs")
    return LeastSquaresFit(misfit=found.misfit, evaluations=evaluations, converged=found.converged)


def _descend(problem: Problem, guess: Guess, horizon: float | None) -> LeastSquaresFit:
    """Levenberg's and Marquardt's method over one horizon."""
    rough = horizon is not None
    gain, most = (ROUGH_GAIN, ROUGH_STEPS) if rough else (SMALLEST_GAIN, MOST_STEPS)
    best, evaluations, damping = problem.misfit(guess, horizon), 1, FIRST_DAMPING
    for _ in range(most):
        matrix, right = best.normal()
        better = None
        while better is None and damping < MOST_DAMPING:
            step = damped_step(matrix, right, damping)
            evaluations += 1
            better = _try(problem, best, step, horizon)
            damping = max(damping / 10.0, 1e-12) if better is not None else damping * 4.0
        if better is None:
            # No step helps any more, however short: the bottom, to rounding.
            return LeastSquaresFit(misfit=best, evaluations=evaluations, converged=True)
        gained = best.cost - better.cost
        best = better
        if gained <= gain * best.cost and damping < 1.0:
            return LeastSquaresFit(misfit=best, evaluations=evaluations, converged=True)
    return LeastSquaresFit(misfit=best, evaluations=evaluations, converged=rough)


def _try(problem: Problem, best: Misfit, step: Floats, horizon: float | None) -> Misfit | None:
    """Misfit after a step if it is smaller; a leg that cannot be predicted is none."""
    try:
        found = problem.misfit(problem.stepped(best.guess, step), horizon)
    except PlantFault:
        return None
    return found if found.cost < best.cost else None


def damped_step(matrix: Floats, right: Floats, damping: float) -> Floats:
    """Step (m,) that solves the normal equations, each diagonal entry raised by a share."""
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-30))
    scaled = matrix / np.outer(size, size)
    lifted = scaled + damping * np.eye(len(right))
    step = np.linalg.lstsq(lifted, right / size, rcond=1e-14)[0] / size
    return step * min(1.0, LONGEST_STEP / max(float(np.abs(step).max()), 1e-30))
