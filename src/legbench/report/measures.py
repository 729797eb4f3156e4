"""Numbers of a campaign's table that stand beside numbers of the paper."""

import math
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pyarrow as pa

from legbench.campaign.curves import (
    CONTROLLER,
    DZ2,
    SETUP,
    Z2,
    rows_of,
    same_set_point,
    sound_runs,
)
from legbench.metrics.jump import LAST
from legbench.metrics.source import Reference
from legbench.paper import Published, Relation

RATING_WITHIN: Final = 0.02
"""Distance within which a rating agrees with the paper's [-]: two units of its last digit."""
SHARE_WITHIN: Final = 0.1
"""Distance within which any other number agrees, as a share of the paper's [-], which gives
lengths in two digits."""
TRANSIENT: Final = 3
"""Periods of bang-bang before those that the paper averages [-]: its index is P>3."""

Row = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """Number measured in a campaign, over the runs that show it."""

    value: float
    """Mean over the runs; the lowest of them beside a lower bound."""
    spread: float
    """Standard deviation over the runs; zero for one."""
    runs: int
    """Number of runs."""

    def words(self, unit: str) -> str:
        """The number, with its spread where the digits show one."""
        text, spread = measured_text(self.value, unit), measured_text(self.spread, unit)
        if self.runs == 1:
            return text
        shown = f" ± {spread}" if spread != measured_text(0.0, unit) else ""
        return f"{text}{shown} over {self.runs} runs"


def measure(
    number: Published,
    table: pa.Table,
    reference: Reference,
    at: tuple[float, float] | None = None,
) -> Measured | None:
    """Measure the counterpart of a number of the paper; none where no run shows it.

    Args:
        number: number of the paper.
        table: the table of a campaign; runs in it that are not sound do not count.
        reference: what ratings are about.
        at: set point and deflection of the runs to take [rad]; those of the number by default. Of
            jumps, whose set point can be read in several ways, any are taken if there are none.
    """
    found = MEASURES.get(number.key)
    if found is None:
        return None
    kind, of_run = found
    z2, dz2 = (number.z2, number.dz2) if at is None else at
    rows = [
        row
        for row in rows_of(sound_runs(table), kind)
        if row[SETUP] == number.setup and row[CONTROLLER] == number.controller
    ]
    there = [row for row in rows if same_set_point(row[Z2], z2) and same_set_point(row[DZ2], dz2)]
    runs: dict[str, list[Row]] = defaultdict(list)
    for row in there or (rows if number.key in JUMP_MEASURES else ()):
        runs[row["experiment"]].append(row)
    values = [of_run(rows, f"rating_{reference.value}") for rows in runs.values()]
    values = [value for value in values if math.isfinite(value)]
    if not values:
        return None
    # A lower bound is kept by every run, not by their mean.
    value = min(values) if number.comparison is Relation.MORE else float(np.mean(values))
    return Measured(value=value, spread=float(np.std(values)), runs=len(values))


def agrees(number: Published, value: float) -> bool:
    """Whether a measured value agrees with what the paper prints."""
    if number.comparison is Relation.MORE:
        return value > number.value
    if number.comparison is Relation.LESS:
        return value < number.value
    rating = number.key in MEASURES and number.unit == "1"
    within = RATING_WITHIN if rating else SHARE_WITHIN * abs(number.value)
    return abs(value - number.value) <= within


def published_text(number: Published) -> str:
    """A number of the paper as it prints it, in millimetres if it is a length."""
    sign = "" if number.comparison is Relation.EQUAL else f"{number.comparison.value} "
    if number.unit == "m":
        return f"{sign}{1e3 * number.value:g} mm"
    return f"{sign}{number.value:g}" + ("" if number.unit == "1" else f" {number.unit}")


def measured_text(value: float, unit: str) -> str:
    """A measured number, a rating to three decimals, a length to a tenth of a millimetre."""
    if unit == "m":
        return f"{1e3 * value:.1f} mm"
    return f"{value:.3f}" if unit == "1" else f"{value:.4g} {unit}"


def _at_index(index: int) -> Callable[[list[Row], str], float]:
    def of_run(rows: list[Row], rated: str) -> float:
        return next((row[rated] for row in rows if row["index"] == index), math.nan)

    return of_run


def _sustained(rows: list[Row], rated: str) -> float:
    ratings = [row[rated] for row in rows if row["index"] > TRANSIENT]
    return float(np.mean(ratings)) if ratings else math.nan


def _worst_of_last(rows: list[Row], rated: str) -> float:
    """Lowest rating of the last three phases, as many as the paper shows."""
    return min(row[rated] for row in rows[-LAST:])


def _largest_of_last(name: str) -> Callable[[list[Row], str], float]:
    def of_run(rows: list[Row], rated: str) -> float:
        return max(row[name] for row in rows[-LAST:])

    return of_run


def _drift(rows: list[Row], rated: str) -> float:
    return rows[0]["drift"]


MEASURES: Final[dict[str, tuple[str, Callable[[list[Row], str], float]]]] = {
    "step_rating_1": ("period", _at_index(1)),
    "step_rating_6": ("period", _at_index(6)),
    "bang_bang_rating": ("period", _sustained),
    "jump_rating_stance": ("stance", _worst_of_last),
    "jump_rating_flight": ("flight", _worst_of_last),
    "foot_clearance": ("jump", _largest_of_last("foot_clearance")),
    "trunk_excursion": ("jump", _largest_of_last("trunk_excursion")),
    "drift": ("run", _drift),
    "foot_travel": ("jump", _largest_of_last("foot_travel")),
}
"""Key of the paper's number -> kind of the table's rows that show it, and its value for a run."""
JUMP_MEASURES: Final = tuple(key for key, (kind, _) in MEASURES.items() if kind != "period")
"""Keys of the numbers that are about the jump."""
