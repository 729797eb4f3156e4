"""The page of a report: what stands on it, and its HTML."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from legbench.campaign.curves import Cell, rating_curves
from legbench.metrics.source import Reference
from legbench.paper import Published, published
from legbench.report._jinja2 import render
from legbench.report.blocks import FigureBlock
from legbench.report.judging import HIGH, SETTLED, VISIBLE
from legbench.report.measures import JUMP_MEASURES, RATING_WITHIN, SHARE_WITHIN
from legbench.report.named import Named
from legbench.report.numbers import NumberRow, number_rows
from legbench.report.sources import CampaignSource, InvalidRun, invalid_runs
from legbench.report.trends import Trend, judge_trends

TEMPLATE: Final = "report.html"
RULES: Final = (
    f"Ratings differ when they differ by more than {VISIBLE:g}, half a unit of the last digit that "
    "the paper prints.",
    "A rating decreases with each period when the mean over the trials of every cell falls from "
    "first to last period and never rises by more than that.",
    "Setups are compared over the cells, and the periods, that both have.",
    f"Bang-bang is saturated once every later rating stays within {SETTLED:g} of the mean of the "
    f"second half; a high value is {HIGH:g} or more.",
    f"A rating agrees with a printed one within {RATING_WITHIN:g}, any other number within "
    f"{100 * SHARE_WITHIN:g} %.",
    "Figures of the jump are those of a run's last three jumps: the lowest rating, the largest "
    "length.",
    "Runs that did not come to their end, or whose numerics are unsound, count nowhere.",
)
"""Rules by which numbers and trends are judged, in words."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """Verdict of one campaign on a statement, about one reference or whatever it is."""

    source: str
    about: str
    """Reference of the rating; empty where the verdict does not depend on it."""
    trend: Trend


@dataclass(frozen=True, slots=True, kw_only=True)
class Statement:
    """Statement of the paper with the verdicts of all campaigns; of each the headline first."""

    trend: Trend
    verdicts: tuple[Judgement, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CellRow:
    """One cell with rated periods, for the table of all cells."""

    cell: Cell
    trials: int
    ratings: str
    """First and last mean rating about the equilibrium, and how many periods there are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedPaper:
    """The paper's statements as campaigns judge them, and its numbers as they are measured."""

    statements: tuple[Statement, ...]
    numbers: tuple[NumberRow, ...]
    invalid: Mapping[str, tuple[InvalidRun, ...]]


def judge(sources: Sequence[CampaignSource], numbers: Mapping[str, Published]) -> JudgedPaper:
    """Judge the paper's statements and measure its numbers in each campaign."""
    found: dict[str, list[Judgement]] = {}
    first: dict[str, Trend] = {}
    for source in sources:
        by = {each: judge_trends(source.table, numbers, each) for each in Reference}
        for trend, other in zip(by[Reference.EQUILIBRIUM], by[Reference.MOTOR], strict=True):
            first.setdefault(trend.key, trend)
            found.setdefault(trend.key, []).extend(_verdicts(source.name, trend, other))
    return JudgedPaper(
        statements=tuple(
            Statement(trend=first[key], verdicts=tuple(each)) for key, each in found.items()
        ),
        numbers=number_rows(numbers, sources),
        invalid={source.name: invalid_runs(source.table) for source in sources},
    )


def _verdicts(source: str, equilibrium: Trend, motor: Trend) -> Iterator[Judgement]:
    """Verdicts about both references, that of the headline first; one where they are the same."""
    if equilibrium == motor:
        yield Judgement(source=source, about="", trend=equilibrium)
        return
    both = [("equilibrium", equilibrium), ("motor", motor)]
    for about, trend in reversed(both) if equilibrium.key in JUMP_MEASURES else both:
        yield Judgement(source=source, about=about, trend=trend)


def headlines(judged: JudgedPaper, source: str) -> list[Trend]:
    """The verdict of one campaign on each statement, about the reference that suits the setup."""
    return [
        next(verdict.trend for verdict in statement.verdicts if verdict.source == source)
        for statement in judged.statements
    ]


def page_html(
    sources: Sequence[CampaignSource],
    judged: JudgedPaper,
    blocks: Sequence[FigureBlock],
    named: Sequence[Named],
) -> str:
    """The page as one self-contained HTML text.

    Args:
        sources: the campaigns, the one that is reported on first.
        judged: statements, numbers and invalid runs.
        blocks: figures in order.
        named: experiments that the paper shows one by one.
    """
    verdicts = {source.name: headlines(judged, source.name) for source in sources}
    context = {
        "sources": sources,
        "judged": judged,
        "blocks": blocks,
        "named": named,
        "held": {name: sum(t.held is True for t in found) for name, found in verdicts.items()},
        "told": {name: sum(t.held is not None for t in found) for name, found in verdicts.items()},
        "runs": {s.name: len(s.table["experiment"].unique()) for s in sources},
        "cells": {source.name: cell_rows(source) for source in sources},
        "published": tuple(published().values()),
        "rules": RULES,
        "provenance": {source.name: _machines(source) for source in sources},
    }
    return render(TEMPLATE, context)


def cell_rows(source: CampaignSource) -> tuple[CellRow, ...]:
    """Every cell with rated periods, with its first and last rating."""
    return tuple(
        CellRow(
            cell=curve.cell,
            trials=int(curve.trials[0]) if len(curve.trials) else 0,
            ratings=" … ".join(f"{each:.3f}" for each in (curve.mean[0], curve.mean[-1]))
            + f" ({len(curve.mean)})"
            if len(curve.mean)
            else "none",
        )
        for curve in rating_curves(source.table, Reference.EQUILIBRIUM)
    )


def _machines(source: CampaignSource) -> list[tuple[str, str]]:
    """Provenance of a campaign, entry by entry; machines are numbered where there are several."""
    machines = source.provenance
    several = len(machines) > 1
    return [
        (f"machine {number}: {key}" if several else key, value)
        for number, told in enumerate(machines, 1)
        for key, value in _flat(told)
    ]


def _flat(told: Mapping[str, Any], at: str = "") -> Iterator[tuple[str, str]]:
    for key, value in told.items():
        name = f"{at}.{key}" if at else key
        if isinstance(value, Mapping):
            yield from _flat(value, name)
        else:
            yield name, str(value)
