"""Rules by which curves of ratings are judged: falling, better, lower, saturated.

Ratings differ when they differ by more than half a unit of the last digit that the paper prints.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from legbench.campaign.curves import RatingCurve, same_set_point
from legbench.design.setup import SetupKind
from legbench.signals import Floats

VISIBLE: Final = 0.005
"""Smallest difference between ratings that counts [-]: half a unit of the paper's last digit."""
HIGH: Final = 0.9
"""Least rating that counts as high [-]; the paper calls 0.94 very good."""
SETTLED: Final = 0.02
"""Largest distance of a saturated rating from its level [-]: two units of the last digit."""

SETUP_NAMES: Final = {
    SetupKind.HFTS: "hFTS",
    SetupKind.VFTS: "vFTS",
    SetupKind.FFS: "FFS",
    SetupKind.JUMP: "jump",
}
"""Names of the setups as the paper writes them."""

Judged = tuple[bool | None, str]
"""Verdict, none where nothing could show it, and the evidence for it in words."""


def decreases(curves: Sequence[RatingCurve]) -> Judged:
    """Judge whether every curve falls from its first period to its last and never rises."""
    rises = [
        (float(steps.max()), int(steps.argmax()) + 2, curve)
        for curve in curves
        if len(steps := np.diff(curve.mean))
    ]
    if not rises:
        return None, "no cell has two rated periods"
    falling = [c for rise, _, c in rises if rise <= VISIBLE < c.mean[0] - c.mean[-1]]
    first = float(np.mean([curve.mean[0] for _, _, curve in rises]))
    last = float(np.mean([curve.mean[-1] for _, _, curve in rises]))
    evidence = (
        f"falls in {len(falling)} of {len(rises)} cells; on average from {first:.3f} to {last:.3f}"
    )
    if len(falling) < len(rises):
        rise, period, curve = max(rises, key=lambda each: each[0])
        evidence += f"; largest rise {rise:.3f}, to period {period} at {curve.cell.place}"
    return len(falling) == len(rises), evidence


def better_at(
    curves: Sequence[RatingCurve], better: SetupKind, worse: SetupKind, period: int
) -> Judged:
    """Judge whether one setup has the better rating in a period, over the cells that both have."""
    pairs = [
        (float(one.mean[period - 1]), float(two.mean[period - 1]))
        for one, two in _pairs(curves, better, worse)
        if min(len(one.mean), len(two.mean)) >= period
    ]
    names = SETUP_NAMES[better], SETUP_NAMES[worse]
    if not pairs:
        return None, f"no cell of both {names[0]} and {names[1]} has {period} rated periods"
    means = np.mean(pairs, axis=0)
    words = f"{names[0]} {means[0]:.3f}, {names[1]} {means[1]:.3f}"
    return bool(means[0] - means[1] > VISIBLE), f"period {period}, {_cells(len(pairs))}: {words}"


def below(curves: Sequence[RatingCurve], lower: SetupKind, others: Sequence[SetupKind]) -> Judged:
    """Judge whether one setup has a lower rating than each other one, cell by cell and period."""
    verdicts, words = [], []
    for other in others:
        shared = [
            (one.mean[:count], two.mean[:count])
            for one, two in _pairs(curves, lower, other)
            if (count := min(len(one.mean), len(two.mean)))
        ]
        if not shared:
            return None, f"{SETUP_NAMES[lower]} and {SETUP_NAMES[other]} have no cell in common"
        ours, theirs = (_mean(each) for each in zip(*shared, strict=True))
        verdicts.append(theirs - ours > VISIBLE)
        words.append(
            f"{SETUP_NAMES[lower]} {ours:.3f}, {SETUP_NAMES[other]} {theirs:.3f} "
            f"({_cells(len(shared))})"
        )
    return all(verdicts), "; ".join(words)


def saturates(curves: Sequence[RatingCurve], limit: int) -> Judged:
    """Judge whether every curve settles at a high level in fewer periods than `limit`."""
    long = [curve for curve in curves if len(curve.mean) >= limit]
    if not long:
        return None, f"no cell has {limit} rated periods"
    settled = [(settling(curve.mean), level_of(curve.mean), curve) for curve in long]
    good = [c for period, level, c in settled if period < limit and level >= HIGH]
    latest = max(settled, key=lambda each: each[0])
    lowest = min(settled, key=lambda each: each[1])
    evidence = (
        f"{len(good)} of {len(settled)} cells; settled from period {latest[0]} on at the latest, "
        f"lowest level {lowest[1]:.3f} at {lowest[2].cell.place}"
    )
    if short := len(curves) - len(long):
        evidence += f"; {short} with fewer than {limit} periods not judged"
    return len(good) == len(settled), evidence


def level_of(ratings: Floats) -> float:
    """Level of a saturated curve: the mean of its second half [-]."""
    return float(np.mean(ratings[len(ratings) // 2 :]))


def settling(ratings: Floats) -> int:
    """First period from which on every rating stays within `SETTLED` of the level."""
    away = np.flatnonzero(np.abs(ratings - level_of(ratings)) > SETTLED)
    return int(away[-1]) + 2 if len(away) else 1


def lower_at(curves: Sequence[RatingCurve], z2: float, setups: Sequence[SetupKind]) -> Judged:
    """Judge whether the cells at one set point have a lower rating than the others of a setup."""
    verdicts, words = [], []
    for setup in setups:
        here = [c.mean for c in curves if c.cell.setup == setup and same_set_point(c.cell.z2, z2)]
        rest = [
            c.mean for c in curves if c.cell.setup == setup and not same_set_point(c.cell.z2, z2)
        ]
        if not (here and rest):
            return None, f"{SETUP_NAMES[setup]} has no cells both at z2 = {z2:g} and elsewhere"
        at, elsewhere = _mean(here), _mean(rest)
        verdicts.append(elsewhere - at > VISIBLE)
        words.append(f"{SETUP_NAMES[setup]} {at:.3f}, elsewhere {elsewhere:.3f}")
    return all(verdicts), "; ".join(words)


def _pairs(
    curves: Sequence[RatingCurve], first: SetupKind, second: SetupKind
) -> list[tuple[RatingCurve, RatingCurve]]:
    """Curves of two setups at the same set points."""
    return [
        (one, two)
        for one in curves
        for two in curves
        if one.cell.setup == first
        and two.cell.setup == second
        and one.cell.other == two.cell.other
        and same_set_point(one.cell.z2, two.cell.z2)
        and same_set_point(one.cell.dz2, two.cell.dz2)
    ]


def _cells(count: int) -> str:
    return f"{count} cell" if count == 1 else f"{count} cells"


def _mean(ratings: Sequence[Floats]) -> float:
    return float(np.mean(np.concatenate(list(ratings))))
