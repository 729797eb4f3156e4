"""Global screening: which causes matter when all of them are there, each of a plausible size."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from legbench.design import LegDesign
from legbench.explain.causes import Cause
from legbench.explain.engine import NOBODY, Watch
from legbench.explain.fitting import leg_of, rate
from legbench.explain.targets import Target
from legbench.guests import load_text
from legbench.signals import Floats

TRAJECTORIES = 12
"""Number of trajectories of Morris' method [-]."""
LEVELS = 4
"""Number of sizes of each cause in Morris' method [-]."""
BASE = 32
"""Base number of points of Saltelli's sequence [-]; there are as many times causes plus two."""


class ScreeningMethod(StrEnum):
    """Method of global screening."""

    MORRIS = "morris"
    """Elementary effects (Morris 1991): cheap, ranks the causes."""
    SOBOL = "sobol"
    """Shares of the variance (Sobol 2001, Saltelli 2010): three times as dear, with interactions
    told apart."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Screened:
    """Weight of one cause in the mean rating of a step.

    Morris gives the mean size of its effects and their spread over the sizes of the others [-];
    Sobol the share of the variance with all interactions, and the share of the cause alone [-].
    """

    cause: Cause
    whole: float
    """Mean absolute effect, or total share of the variance [-]."""
    other: float
    """Spread of the effects, or share of the variance of the cause alone [-]."""


def screen(
    design: LegDesign,
    target: Target,
    causes: Sequence[Cause],
    method: ScreeningMethod,
    seed: int,
    watch: Watch = NOBODY,
) -> list[Screened]:
    """Weigh causes of plausible sizes that are there all at once, the heaviest first.

    Empty if the watch stopped before every leg was rated.

    Raises:
        MissingExtraError: SALib is not installed.
    """
    door = "legbench.explain._salib"
    draw, weigh = (load_text(f"{door}:{name}") for name in _FUNCTIONS[method])
    problem: dict[str, Any] = {
        "num_vars": len(causes),
        "names": [cause.name for cause in causes],
        "bounds": [[-c.plausible if c.signed else 0.0, c.plausible] for c in causes],
    }
    size = (TRAJECTORIES, LEVELS) if method is ScreeningMethod.MORRIS else (BASE,)
    points: Floats = draw(problem, *size, seed)
    values = _mean_rating(design, target, causes, points, watch)
    if watch.stopped():
        return []
    if method is ScreeningMethod.MORRIS:
        whole, other = weigh(problem, points, values, LEVELS, seed)
    else:
        whole, other = weigh(problem, values, seed)
    rows = [
        Screened(cause=cause, whole=float(a), other=float(b))
        for cause, a, b in zip(causes, whole, other, strict=True)
    ]
    return sorted(rows, key=lambda row: -row.whole)


_FUNCTIONS = {
    ScreeningMethod.MORRIS: ("morris_points", "morris_effects"),
    ScreeningMethod.SOBOL: ("sobol_points", "sobol_shares"),
}
"""Method -> names of what draws its points and what weighs the causes."""


def count_screened(method: ScreeningMethod, causes: int) -> int:
    """Number of legs that `screen` rates for so many causes [-]."""
    return TRAJECTORIES * (causes + 1) if method is ScreeningMethod.MORRIS else BASE * (causes + 2)


def _mean_rating(
    design: LegDesign, target: Target, causes: Sequence[Cause], points: Floats, watch: Watch
) -> Floats:
    """Mean rating (n,) over the target's periods; one that is not there is rated zero."""
    legs = [leg_of(design, causes, row) for row in points]
    _, ratings = rate(design, target, legs, watch)
    return np.nan_to_num(ratings, nan=0.0).mean(axis=1)
