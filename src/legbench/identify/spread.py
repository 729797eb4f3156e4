"""Errors of fitted parameters: what white noise would make of them, and what the residuals show.

Where residuals hang together, as those of a motor's count or of a part that the equations lack do,
errors are larger than white noise of their size would give. The sandwich (Liang and Zeger 1986)
adds up the score in blocks of time, within which residuals may hang together as they like.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.stats import t as student

from legbench.identify.problem import Misfit
from legbench.identify.trial import Trial
from legbench.signals import Floats

BLOCK: Final = 0.25
"""Length of a block [s]: about a period of a swinging leg."""
LEVEL: Final = 0.95
"""Probability that an interval covers the truth [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Errors of a fit's steps, in logarithms of positive parameters and scales of the others."""

    white: Floats
    """Standard errors that white noise of the encoders would give (m,) [-]."""
    block: Floats
    """Standard errors from the residuals in blocks (m,) [-]."""
    rounding: Floats
    """Standard errors from what the motors' counts hide, which stays the same in a run (m,) [-]."""
    correlation: Floats
    """Correlation of the errors (m, m) [-]."""
    quantile: float
    """Standard errors from an estimate to the end of its interval [-]."""

    @property
    def errors(self) -> Floats:
        """Larger of the first two standard errors, and the rounding of the motors (m,) [-]."""
        return np.hypot(np.maximum(self.white, self.block), self.rounding)


def spread_of(misfit: Misfit, trials: Sequence[Trial]) -> Spread:
    """Errors of the parameters at the end of a fit."""
    matrix, _ = misfit.normal()
    size = np.sqrt(np.diag(matrix))
    inverse = np.linalg.inv(matrix / np.outer(size, size)) / np.outer(size, size)
    scores = np.concatenate(
        [
            _scores(residuals, slopes, trial)
            for residuals, slopes, trial in zip(
                misfit.residuals, misfit.jacobians, trials, strict=True
            )
        ]
    )
    count = len(scores)
    freedom = max(count - len(matrix), 3)
    middle = scores.T @ scores * (count / freedom)
    sandwich = inverse @ middle @ inverse
    white = np.sqrt(np.diag(inverse))
    hidden = [
        np.einsum("njm,njr->mr", slopes, rounding)
        for slopes, rounding in zip(misfit.jacobians, misfit.rounding, strict=True)
    ]
    moved = inverse @ np.concatenate(hidden, axis=1)
    return Spread(
        white=white,
        block=np.sqrt(np.diag(sandwich)),
        rounding=np.linalg.norm(moved, axis=1),
        correlation=inverse / np.outer(white, white),
        quantile=float(student.ppf(0.5 + 0.5 * LEVEL, freedom)),
    )


def _scores(residuals: Floats, slopes: Floats, trial: Trial) -> Floats:
    """Score of each block of one run (b, m)."""
    rows = slopes * residuals[:, :, np.newaxis]
    width = max(1, round(BLOCK / trial.period))
    return np.add.reduceat(rows.sum(axis=1), np.arange(0, len(rows), width), axis=0)
