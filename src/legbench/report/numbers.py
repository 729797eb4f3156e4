"""The table *paper, ideal, explained, bench*: each number of the paper and its counterparts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from legbench.campaign.curves import CONTROLLER, SETUP, rows_of, sound_runs
from legbench.design.setup import SetupKind
from legbench.metrics.source import Reference
from legbench.paper import Published
from legbench.report.measures import (
    JUMP_MEASURES,
    Measured,
    agrees,
    measure,
    published_text,
)
from legbench.report.sources import CampaignSource

CAPTION_OF: Final = {"step_rating_1": "step_to_caption", "step_rating_6": "step_to_caption"}
"""Number that the caption of its figure is about as well -> number with the caption's settings."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Counterpart:
    """What one campaign has beside a number of the paper."""

    text: str
    """The number in words, or why there is none."""
    reference: str | None
    """Reference of a rating; none: it is no rating, or it was not measured."""
    value: float | None
    """Value in SI units; none where no run shows it."""
    runs: int
    agrees: bool | None
    """Whether it agrees with the paper; none where it cannot be told."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NumberRow:
    """One number of the paper with its counterparts."""

    key: str
    what: str
    settings: str
    """Settings of the cell that it was measured in, in words."""
    published: str
    place: str
    sentence: str
    counterparts: Mapping[str, tuple[Counterpart, ...]]
    """Name of a source -> its values, one for each reference of a rating."""


def number_rows(
    numbers: Mapping[str, Published], sources: Sequence[CampaignSource]
) -> tuple[NumberRow, ...]:
    """Rows of the table, in the order of the paper; a step is there in both of its readings."""
    rows = [_count_row(numbers[key], sources) for key in ("experiments", "trials")]
    rows.append(_count_row(numbers["trials_fixed_foot"], sources))
    for key in ("step_rating_1", "step_rating_6", "bang_bang_rating", *JUMP_MEASURES):
        number = numbers[key]
        rows.append(_row(number, number, sources))
        if key in CAPTION_OF:
            rows.append(_row(number, numbers[CAPTION_OF[key]], sources))
    return tuple(rows)


def _row(number: Published, cell: Published, sources: Sequence[CampaignSource]) -> NumberRow:
    """Row of a number, measured with the settings of `cell`."""
    settings = ""
    if cell.z2 is not None and cell.dz2 is not None and number.setup is not SetupKind.JUMP:
        settings = f"z2 = {cell.z2:g}, dz2 = {cell.dz2:g} rad"
        if cell is not number:
            settings += ", as the caption has it"
    rated = number.unit == "1"
    # The reference by which a setup is judged comes first.
    both = (Reference.EQUILIBRIUM, Reference.MOTOR)
    references = both[::-1] if number.setup is SetupKind.JUMP else both
    references = references if rated else references[:1]
    counterparts = {
        source.name: tuple(
            _counterpart(number, _measured(number, cell, source, each), each if rated else None)
            for each in references
        )
        for source in sources
    }
    return NumberRow(
        key=number.key if cell is number else f"{number.key}_caption",
        what=number.what,
        settings=settings,
        published=published_text(number),
        place=number.place,
        sentence=number.sentence,
        counterparts=counterparts,
    )


def _measured(
    number: Published, cell: Published, source: CampaignSource, reference: Reference
) -> Measured | None:
    at = None if cell.z2 is None or cell.dz2 is None else (cell.z2, cell.dz2)
    return measure(number, source.table, reference, at)


def _counterpart(
    number: Published, found: Measured | None, reference: Reference | None
) -> Counterpart:
    about = None if reference is None else reference.value
    if found is None:
        return Counterpart(text="no run shows it", reference=about, value=None, runs=0, agrees=None)
    return Counterpart(
        text=found.words(number.unit),
        reference=about,
        value=found.value,
        runs=found.runs,
        agrees=agrees(number, found.value),
    )


def _count_row(number: Published, sources: Sequence[CampaignSource]) -> NumberRow:
    counterparts = {}
    for source in sources:
        count = _count(number, source)
        counterparts[source.name] = (
            Counterpart(
                text=str(count),
                reference=None,
                value=float(count),
                runs=count,
                agrees=count > number.value
                if number.key == "experiments"
                else count == number.value,
            ),
        )
    return NumberRow(
        key=number.key,
        what=number.what,
        settings="",
        published=published_text(number),
        place=number.place,
        sentence=number.sentence,
        counterparts=counterparts,
    )


def _count(number: Published, source: CampaignSource) -> int:
    """Number of sound runs, or the most of one cell with the number's setup and controller."""
    rows = rows_of(sound_runs(source.table), "run")
    if number.key == "experiments":
        return len(rows)
    fixed_foot = number.setup is SetupKind.FFS
    trials = [
        row["trial"] + 1
        for row in rows
        if row[CONTROLLER] == number.controller and (row[SETUP] == SetupKind.FFS) == fixed_foot
    ]
    return max(trials, default=0)
