"""Ratings in words, to the digits that differ."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from legbench.metrics.source import Reference
from legbench.metrics.summary import Summary

FEWEST, MOST = 4, 9
"""Fewest and most decimals of a rating: the paper prints two, and beyond nine there is noise."""
DIGITS = 2
"""Leading digits of 1 - P^r that are shown, as many as the paper's 0.78 has."""


def rating_decimals(values: Sequence[float]) -> int:
    """Number of decimals at which each of some ratings shows what it lacks of one.

    Ratings near one differ in 1 - P^r, of which the smallest decides; ratings of exactly one, and
    ratings that are unknown, decide nothing.
    """
    lost = [1.0 - value for value in values if math.isfinite(value)]
    smallest = min((each for each in lost if each > 0.5 * 10.0**-MOST), default=1.0)
    return min(max(FEWEST, DIGITS - 1 - math.floor(math.log10(smallest))), MOST)


def rating_text(values: Sequence[float]) -> str:
    """The lowest and the last of some ratings, such as `0.8703 lowest, 0.8703 last of 5`."""
    known = [value for value in values if math.isfinite(value)]
    if not known:
        return f"unknown, all {len(values)}"
    lowest, last = min(known), values[-1]
    return f"{shown(lowest)} lowest, {shown(last)} last of {len(values)}"


def shown(value: float) -> str:
    """A rating to the decimals at which it shows what it lacks of one."""
    return f"{value:.{rating_decimals([value])}f}"


@dataclass(frozen=True, slots=True, kw_only=True)
class RatedLine:
    """One line of a table of ratings: all stances, flights or periods about one reference."""

    kind: str
    """Word for what was rated: `stance`, `flight` or `periods`."""
    reference: str
    """Reference that the ratings are about, `motor` or `equilibrium`."""
    values: list[float]

    @property
    def text(self) -> str:
        """The ratings in words, with their reference."""
        return f"{rating_text(self.values)}, about the {self.reference}"


def rated_lines(summary: Summary) -> list[RatedLine]:
    """Lines of everything that was rated: about the reference that comes first, then the other."""
    first = summary.rating_reference
    both = sorted((each.value for each in Reference), key=lambda name: name != first)
    return [
        RatedLine(kind=kind, reference=reference, values=values)
        for kind in ("stance", "flight", "periods")
        for reference in both
        if (values := getattr(summary, f"rating_{kind}_{reference}"))
    ]
