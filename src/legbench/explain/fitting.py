"""Fits of one and of two causes to measured ratings: a grid over all sizes, then least squares.

Ratings have kinks, so that a search from one start ends anywhere: the grid finds the valleys, and
damped least squares, all valleys at once, their bottoms.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from legbench.design import LegDesign
from legbench.errors import ConfigError
from legbench.explain.causes import Cause, combined
from legbench.explain.engine import NOBODY, Watch, rate_many
from legbench.explain.least_squares import DAMPINGS, ROUNDS, refine
from legbench.explain.targets import Target
from legbench.imperfections import Imperfections
from legbench.servo import PERFECT
from legbench.signals import Floats, Ints

GRID_SINGLE = 25
"""Number of sizes of a single cause that are tried, zero in the middle [-]."""
GRID_PAIR = 9
"""Number of sizes of each cause of a pair that are tried [-]."""
VALLEYS = 2
"""Number of valleys of each cause or pair that are followed to their bottoms [-]."""
DIFFERENCE = 2e-3
"""Length of the differences that give slopes, as a share of a cause's range [-]."""
MATTERS = 0.01
"""Change of a rating below which a cause does not matter [-]: half of what a figure shows."""
FOLLOWED = 40
"""Number of pairs, the best on the grid, that are followed [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CauseFit:
    """Sizes of some causes at which a leg comes closest to a target."""

    causes: tuple[Cause, ...]
    sizes: tuple[float, ...]
    """Size of each cause, in its unit."""
    ratings: tuple[float, ...]
    """Ratings P^r that result, period by period [-]; NaN where there is no period."""
    misfit: float
    """Root mean square of the differences from the target, in units of its tolerance [-]."""
    worst: float
    """Largest difference, in the same units [-]."""

    @property
    def name(self) -> str:
        """Names of the causes, joined by a plus."""
        return " + ".join(cause.name for cause in self.causes)

    @property
    def imperfections(self) -> Imperfections:
        """Imperfections of the leg of this fit."""
        return combined(self.causes, self.sizes)

    @property
    def words(self) -> str:
        """Causes with their sizes, in words."""
        pairs = zip(self.causes, self.sizes, strict=True)
        return " and ".join(f"{cause.words} ({cause.shown(size)})" for cause, size in pairs)

    @property
    def stretch(self) -> float:
        """Largest size over what is plausible [-]."""
        pairs = zip(self.causes, self.sizes, strict=True)
        return max((abs(size) / cause.plausible for cause, size in pairs), default=0.0)

    @property
    def monotone(self) -> bool:
        """Whether the ratings fall from each period to the next."""
        return bool(np.all(np.diff(self.ratings) < 0.0))

    @property
    def within(self) -> bool:
        """Whether every period lies within the tolerance of the target."""
        return self.worst <= 1.0


def rate(
    design: LegDesign,
    target: Target,
    legs: Sequence[Imperfections | None],
    watch: Watch = NOBODY,
) -> tuple[Floats, Floats]:
    """Residuals (n, m) in tolerances and ratings (n, m) of legs; of none, NaN and missing."""
    known = [leg for leg in legs if leg is not None]
    places = np.flatnonzero([leg is not None for leg in legs])
    periods = len(target.shape)
    ratings, amplitude = np.full((2, len(legs), periods), np.nan)
    if known:
        shapes = rate_many(target.experiment(design), known, periods=periods, watch=watch)
        ratings[places], amplitude[places] = shapes.equilibrium, shapes.amplitude
    return target.residuals(ratings, amplitude), ratings


def leg_of(
    design: LegDesign, causes: Sequence[Cause], sizes: Sequence[float]
) -> Imperfections | None:
    """Leg with causes of these sizes; None if there can be no such leg."""
    try:
        leg = combined(causes, sizes)
        leg.leg_of(design)
    except ConfigError:
        return None
    return leg


def fit_singles(
    design: LegDesign,
    target: Target,
    causes: Sequence[Cause],
    watch: Watch = NOBODY,
) -> list[CauseFit]:
    """Fit each cause alone, the best first."""
    return _fit(design, target, [(cause,) for cause in causes], GRID_SINGLE, watch)


def fit_pairs(
    design: LegDesign,
    target: Target,
    causes: Sequence[Cause],
    watch: Watch = NOBODY,
) -> list[CauseFit]:
    """Fit every two causes together, the best first."""
    return _fit(design, target, list(combinations(causes, 2)), GRID_PAIR, watch)


def count_fitted(groups: int, causes: int) -> int:
    """Number of legs that fits of so many groups of one or two causes rate, about [-]."""
    grid = GRID_SINGLE if causes == 1 else GRID_PAIR**2
    return groups * grid + min(groups, FOLLOWED) * VALLEYS * (2 + ROUNDS * (causes + len(DAMPINGS)))


def effective(
    design: LegDesign, target: Target, causes: Sequence[Cause], watch: Watch = NOBODY
) -> list[Cause]:
    """Causes that change a rating by more than `MATTERS` somewhere at the ends of their range."""
    ends = [leg_of(design, [cause], [end]) for cause in causes for end in (cause.low, cause.high)]
    _, ratings = rate(design, target, [PERFECT, *ends], watch)
    apart = np.abs(ratings[1:] - ratings[0]).reshape(len(causes), -1)
    # A period that is gone is a change, too.
    matters = ~(apart <= MATTERS).all(axis=1)
    return [cause for cause, counts in zip(causes, matters, strict=True) if counts]


def sizes_of(cause: Cause, count: int) -> Floats:
    """Sizes (n,) of a cause for a grid, closer together near zero."""
    if cause.signed:
        side = np.linspace(-1.0, 1.0, count)
        sizes = side * np.abs(side) * np.where(side < 0.0, -cause.low, cause.high)
    else:
        sizes = np.linspace(0.0, 1.0, 1 + 2 * count // 3) ** 2 * cause.high
    return np.unique(np.round(sizes)) if cause.whole else sizes


def _fit(
    design: LegDesign,
    target: Target,
    groups: Sequence[tuple[Cause, ...]],
    count: int,
    watch: Watch,
) -> list[CauseFit]:
    grids = [_grid(group, count) for group in groups]
    found = _evaluated(design, target, list(zip(groups, grids, strict=True)), watch)
    costs = [np.mean(np.square(residuals), axis=1) for residuals, _ in found]
    order = np.argsort([cost.min() for cost in costs])[:FOLLOWED]
    fits = _followed(
        design,
        target,
        [(groups[place], _valleys(grids[place], costs[place])) for place in order],
        watch,
    )
    rest = [
        _best(groups[place], grids[place], *found[place])
        for place in range(len(groups))
        if place not in set(order.tolist())
    ]
    return sorted([*fits, *rest], key=lambda fit: fit.misfit)


def _grid(group: tuple[Cause, ...], count: int) -> Floats:
    """Sizes of all causes of a group (n, d)."""
    axes = np.meshgrid(*(sizes_of(cause, count) for cause in group), indexing="ij")
    return np.stack([axis.ravel() for axis in axes], axis=-1)


def _evaluated(
    design: LegDesign,
    target: Target,
    points: Sequence[tuple[tuple[Cause, ...], Floats]],
    watch: Watch,
) -> list[tuple[Floats, Floats]]:
    """Residuals and ratings of sizes (n, d) of several groups, rated together."""
    legs = [leg_of(design, group, row) for group, sizes in points for row in sizes]
    residuals, ratings = rate(design, target, legs, watch)
    ends = np.cumsum([len(sizes) for _, sizes in points])[:-1]
    return list(zip(np.split(residuals, ends), np.split(ratings, ends), strict=True))


def _valleys(grid: Floats, cost: Floats) -> Floats:
    """Best points of a grid (v, d), each farther than the spacing from those before."""
    span = np.ptp(grid, axis=0)
    chosen: list[int] = []
    for place in np.argsort(cost):
        apart = [np.max(np.abs(grid[place] - grid[other]) / span) for other in chosen]
        if all(distance > 0.3 for distance in apart):
            chosen.append(int(place))
        if len(chosen) == VALLEYS:
            break
    return grid[chosen]


def _followed(
    design: LegDesign,
    target: Target,
    valleys: Sequence[tuple[tuple[Cause, ...], Floats]],
    watch: Watch,
) -> list[CauseFit]:
    """Follow the valleys (v, d) of all groups at once to the best bottom of each group."""
    owners = [group for group, starts in valleys for _ in starts]

    def residuals(sizes: Floats, which: Ints) -> Floats:
        legs = [leg_of(design, owners[o], row) for o, row in zip(which, sizes, strict=True)]
        return rate(design, target, legs, watch)[0]

    starts = np.concatenate([each for _, each in valleys])
    low, high, whole = (
        np.array([[getattr(cause, name) for cause in group] for group in owners])
        for name in ("low", "high", "whole")
    )
    steps = np.where(whole, 1.0, DIFFERENCE * (high - low))
    ends = refine(residuals, starts, low, high, steps)
    ends = np.where(whole, np.round(ends), ends)
    parts = np.split(ends, np.cumsum([len(each) for _, each in valleys])[:-1])
    points = [(group, part) for (group, _), part in zip(valleys, parts, strict=True)]
    found = _evaluated(design, target, points, watch)
    return [_best(*point, *values) for point, values in zip(points, found, strict=True)]


def _best(group: tuple[Cause, ...], sizes: Floats, residuals: Floats, ratings: Floats) -> CauseFit:
    cost = np.mean(np.square(residuals), axis=1)
    place = int(np.argmin(cost))
    return CauseFit(
        causes=group,
        sizes=tuple(sizes[place].tolist()),
        ratings=tuple(ratings[place].tolist()),
        misfit=float(np.sqrt(cost[place])),
        worst=float(np.abs(residuals[place]).max()),
    )


def perfect_fit(design: LegDesign, target: Target) -> CauseFit:
    """Fit without any cause: the leg as its controller believes it."""
    return _best((), np.zeros((1, 0)), *rate(design, target, [PERFECT]))
