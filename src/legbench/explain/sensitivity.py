"""Sensitivities one at a time: what each cause does to the ratings at a size that is plausible."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from legbench.design import LegDesign
from legbench.explain.causes import Cause
from legbench.explain.engine import NOBODY, Watch
from legbench.explain.fitting import leg_of, rate
from legbench.explain.targets import Target
from legbench.servo import PERFECT


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensitivity:
    """Effect of one cause of one size on the ratings of a step."""

    cause: Cause
    size: float
    """Size of the cause, in its unit."""
    ratings: tuple[float, ...]
    """Ratings P^r, period by period [-]; NaN where there is no period."""
    change: float
    """Largest change of a rating [-]."""


def sensitivities(
    design: LegDesign, target: Target, causes: Sequence[Cause], watch: Watch = NOBODY
) -> list[Sensitivity]:
    """Rate a leg with each cause at its plausible size, both signs where both make sense.

    The causes that change most come first.
    """
    tried = [
        (cause, sign * cause.plausible)
        for cause in causes
        for sign in ((1.0, -1.0) if cause.signed else (1.0,))
    ]
    legs = [PERFECT, *(leg_of(design, [cause], [size]) for cause, size in tried)]
    _, ratings = rate(design, target, legs, watch)
    apart = np.abs(ratings[1:] - ratings[0])
    change = np.where(np.isfinite(apart), apart, 0.0).max(axis=1)
    return sorted(
        (
            Sensitivity(cause=cause, size=size, ratings=tuple(row.tolist()), change=float(most))
            for (cause, size), row, most in zip(tried, ratings[1:], change, strict=True)
        ),
        key=lambda each: -each.change,
    )


def count_sensitivities(causes: Sequence[Cause]) -> int:
    """Number of legs that `sensitivities` rates [-]."""
    return 1 + sum(2 if cause.signed else 1 for cause in causes)
