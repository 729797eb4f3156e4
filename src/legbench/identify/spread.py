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
from legbench.identify.trial import FitTrial
from legbench.signals import Floats

BLOCK: Final = 0.25
"""Length of a block [s]: about a period of a swinging leg."""
LEVEL: Final = 0.95
"""Probability that an interval covers the truth [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Errors of a fit's steps, in logarithms of positive parameters and scales of the others."""

    white: Floats
    """Standard errors that white noise of the encoders, and the counts of the motors' encoders,
    would give (m,) [-]."""
    block: Floats
    """Standard errors from the residuals in blocks (m,) [-]."""
    correlation: Floats
    """Correlation (m, m) of the errors that noise of the link encoders makes [-]: what the runs
    cannot tell apart, whatever is known of the motors' counts."""
    quantile: float
    """Standard errors from an estimate to the end of its interval [-]."""

    @property
    def errors(self) -> Floats:
        """Larger of both standard errors (m,) [-]."""
        return np.maximum(self.white, self.block)


def spread_of(misfit: Misfit, trials: Sequence[FitTrial]) -> Spread:
    """Errors of the parameters at the end of a fit."""
    matrix, _ = misfit.normal()
    own = len(matrix) - len(misfit.prior)
    inverse, alone = _inverse(matrix), _inverse(matrix[:own, :own])
    # What is known of a hidden angle beforehand is a block of its own.
    blocks = [np.diag(np.append(np.zeros(own), -misfit.prior))[own:]]
    for (residuals, slopes, hidden), trial in zip(misfit.parts(), trials, strict=True):
        found = _scores(residuals, slopes, trial)
        blocks.append(np.zeros((len(found), len(matrix))))
        blocks[-1][:, np.r_[:own, hidden]] = found
    scores = np.concatenate(blocks)
    count = len(scores)
    freedom = max(count - len(matrix), 3)
    middle = scores.T @ scores * (count / freedom)
    sandwich = inverse @ middle @ inverse
    return Spread(
        white=np.sqrt(np.diag(inverse)),
        block=np.sqrt(np.diag(sandwich)),
        correlation=alone / np.sqrt(np.outer(np.diag(alone), np.diag(alone))),
        quantile=float(student.ppf(0.5 + 0.5 * LEVEL, freedom)),
    )


def _inverse(matrix: Floats) -> Floats:
    """Inverse of a normal matrix whose unknowns have scales of their own (m, m)."""
    size = np.sqrt(np.diag(matrix))
    return np.linalg.inv(matrix / np.outer(size, size)) / np.outer(size, size)


def _scores(residuals: Floats, slopes: Floats, trial: FitTrial) -> Floats:
    """Score of each block of one run (b, m)."""
    rows = slopes * residuals[:, :, np.newaxis]
    width = max(1, round(BLOCK / trial.period))
    return np.add.reduceat(rows.sum(axis=1), np.arange(0, len(rows), width), axis=0)
