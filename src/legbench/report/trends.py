"""Trends that the paper states of its experiments, and whether a campaign's table shows them.

Every verdict is a function of the table alone.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import pyarrow as pa

from legbench.campaign.curves import RatingCurve, rating_curves
from legbench.design.setup import SetupKind
from legbench.metrics.source import Reference
from legbench.paper import Published
from legbench.report.judging import (
    SETUP_NAMES,
    Judged,
    below,
    better_at,
    decreases,
    lower_at,
    saturates,
)
from legbench.report.measures import JUMP_MEASURES, agrees, measure, published_text

STEP: Final = "position-jump"
BANG_BANG: Final = "bang-bang"
TRUNK_FIXED: Final = (SetupKind.HFTS, SetupKind.VFTS)
THREE: Final = (*TRUNK_FIXED, SetupKind.FFS)
"""Setups of Fig. 5."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trend:
    """One statement of the paper, and whether a table shows it."""

    key: str
    statement: str
    """Statement of the paper in other words."""
    place: str
    """Section and figure where it stands."""
    held: bool | None
    """Whether it holds; none: the table has no runs that could show it."""
    evidence: str
    """What the table shows, in words and numbers."""

    @property
    def verdict(self) -> str:
        """The verdict in words."""
        return {True: "held", False: "not held", None: "not shown"}[self.held]


def judge_trends(
    table: pa.Table, numbers: Mapping[str, Published], reference: Reference
) -> tuple[Trend, ...]:
    """Judge every statement of the paper, with the ratings about one reference.

    Args:
        table: the table of a campaign.
        numbers: the paper's numbers by key, which name periods, set points and bounds.
        reference: what the ratings are about.
    """
    curves = rating_curves(table, reference)
    step = [curve for curve in curves if curve.cell.controller == STEP]
    driven = [curve for curve in curves if curve.cell.controller == BANG_BANG]
    return (
        *_after_steps(step, numbers),
        *_driven(driven, numbers),
        *_of_jumps(table, numbers, reference),
    )


def _after_steps(curves: list[RatingCurve], numbers: Mapping[str, Published]) -> list[Trend]:
    after = numbers["vertical_better_after"]
    period, place = int(after.value), after.place
    found = [
        _trend(
            f"step_decreases_{kind}",
            f"After a step P^r decreases with each period: {SETUP_NAMES[kind]}",
            place,
            decreases(_of(curves, kind)),
        )
        for kind in THREE
    ]
    vertical = better_at(curves, SetupKind.VFTS, SetupKind.HFTS, period)
    lower = below(curves, SetupKind.FFS, TRUNK_FIXED)
    return [
        *found,
        _trend(
            "vertical_better",
            f"After {period} periods vFTS has a better rating than hFTS",
            place,
            vertical,
        ),
        _trend(
            "fixed_foot_lower", "FFS has a lower rating than the fixed-trunk setups", place, lower
        ),
    ]


def _driven(curves: list[RatingCurve], numbers: Mapping[str, Published]) -> list[Trend]:
    soon, folded = numbers["bang_bang_saturation"], numbers["lower_rated_set_point"]
    limit, z2 = int(soon.value), folded.value
    found = [
        _trend(
            f"bang_bang_saturates_{kind}",
            f"Bang-bang saturates at a high P^r in fewer than {limit} periods: {SETUP_NAMES[kind]}",
            soon.place,
            saturates(_of(curves, kind), limit),
        )
        for kind in THREE
    ]
    lower = lower_at(curves, z2, TRUNK_FIXED)
    statement = f"Bang-bang with a fixed trunk has a lower rating at z2 = {z2:g} rad"
    return [*found, _trend("folded_lower", statement, folded.place, lower)]


def _of_jumps(
    table: pa.Table, numbers: Mapping[str, Published], reference: Reference
) -> list[Trend]:
    found = []
    for key in JUMP_MEASURES:
        number = numbers[key]
        measured = measure(number, table, reference)
        judged: Judged = (None, "the table has no jumps")
        if measured is not None:
            judged = agrees(number, measured.value), measured.words(number.unit)
        words = f"Jump, {number.what}: {published_text(number)}"
        found.append(_trend(key, words, number.place, judged))
    return found


def _of(curves: list[RatingCurve], kind: SetupKind) -> list[RatingCurve]:
    return [curve for curve in curves if curve.cell.setup == kind]


def _trend(key: str, statement: str, place: str, judged: Judged) -> Trend:
    held, evidence = judged
    return Trend(key=key, statement=statement, place=place, held=held, evidence=evidence)
