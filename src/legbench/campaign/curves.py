"""Ratings over the periods of a campaign's cells: mean and spread over trials, as in Fig. 5."""

import math
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pyarrow as pa
from pyarrow import compute

from legbench.campaign.table import MEASURED
from legbench.metrics.soundness import Soundness
from legbench.metrics.source import Reference
from legbench.recording.layout import COMPLETE
from legbench.signals import Floats, Ints

SETUP: Final = "setup.kind"
CONTROLLER: Final = "controller.kind"
Z2: Final = "controller.settings.z2"
DZ2: Final = "controller.settings.dz2"
_NO_AXES: Final = frozenset({*MEASURED.names, "trial", "seed", SETUP, CONTROLLER, Z2, DZ2})
"""Columns that tell no cell apart from another beyond its setup, controller and set points."""

SAME: Final = 1e-9
"""Largest distance between set points that are the same [rad]: they come from files."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """Settings that the trials of one experiment have in common."""

    setup: str
    controller: str
    z2: float
    """Set point [rad]; NaN for a controller that has none."""
    dz2: float
    """Deflection [rad]; NaN for a controller that has none."""
    other: tuple[tuple[str, Any], ...] = ()
    """Other settings that vary in the campaign, by dotted key."""

    @property
    def place(self) -> str:
        """The set points and other settings in words."""
        points = [("z2", self.z2), ("dz2", self.dz2)]
        words = [f"{name} = {value:g}" for name, value in points if not math.isnan(value)]
        return ", ".join([*words, *(f"{name} = {value}" for name, value in self.other)])


@dataclass(frozen=True, slots=True, kw_only=True)
class RatingCurve:
    """P^r of each period of a cell over its trials."""

    cell: Cell
    mean: Floats
    """Mean over the trials that have this period, from period 1 on (n,) [-]."""
    spread: Floats
    """Standard deviation over these trials (n,) [-]; zero where there is one."""
    trials: Ints
    """Number of trials that have this period (n,)."""


def same_set_point(one: float | None, two: float | None) -> bool:
    """Whether two set points or deflections [rad] are one; what is not there is not the same."""
    return one is not None and two is not None and abs(one - two) <= SAME


def sound_runs(table: pa.Table) -> pa.Table:
    """Rows of the runs that came to their end and whose numerics are not unsound."""
    complete = compute.field("status") == COMPLETE
    return table.filter(complete & (compute.field("numerics") != Soundness.UNSOUND.value))


def rows_of(table: pa.Table, kind: str) -> list[dict[str, Any]]:
    """Rows of one kind, each as a mapping from column to value."""
    return table.filter(compute.field("row") == kind).to_pylist()


def varying_axes(table: pa.Table) -> tuple[str, ...]:
    """Settings of which one setup and controller has several values, besides its set points.

    Those that only go with setup or controller, such as the duration of a step, tell no cells
    apart.
    """
    axes = [name for name in table.column_names if name not in _NO_AXES]
    seen: dict[tuple[str, str, str], set[Any]] = defaultdict(set)
    for row in table.select([SETUP, CONTROLLER, *axes]).to_pylist():
        for name in axes:
            seen[name, row[SETUP], row[CONTROLLER]].add(row[name])
    return tuple(name for name in axes if any(len(v) > 1 for k, v in seen.items() if k[0] == name))


def cell_of(row: dict[str, Any], axes: Iterable[str] = ()) -> Cell:
    """The cell that a row belongs to.

    Args:
        row: a row of the table.
        axes: settings that tell cells apart besides setup, controller and set points.
    """
    # One and the same NaN, so that rows without set points still belong to one cell.
    z2, dz2 = (math.nan if row[key] is None else float(row[key]) for key in (Z2, DZ2))
    return Cell(
        setup=row[SETUP],
        controller=row[CONTROLLER],
        z2=z2,
        dz2=dz2,
        other=tuple((name, row[name]) for name in axes),
    )


def rating_curves(table: pa.Table, reference: Reference) -> tuple[RatingCurve, ...]:
    """Curves of all cells with rated periods, sorted by setup, controller and set points.

    Runs that did not come to their end, or whose numerics are unsound, are left out.

    Args:
        table: the table of a campaign.
        reference: what the rating is about.
    """
    axes = varying_axes(table)
    found: dict[Cell, dict[int, list[float]]] = defaultdict(lambda: defaultdict(list))
    for row in rows_of(sound_runs(table), "period"):
        rating = row[f"rating_{reference.value}"]
        if np.isfinite(rating):
            found[cell_of(row, axes)][row["index"]].append(rating)
    order = sorted(found, key=lambda cell: (cell.setup, cell.controller, cell.z2, cell.dz2))
    return tuple(_curve(cell, found[cell]) for cell in order)


def _curve(cell: Cell, ratings: dict[int, list[float]]) -> RatingCurve:
    """Curve of the leading periods, up to the first that no trial has."""
    last = next(index for index in range(1, max(ratings) + 2) if index not in ratings)
    leading = [ratings[index] for index in range(1, last)]
    return RatingCurve(
        cell=cell,
        mean=np.array([np.mean(each) for each in leading], dtype=np.float64),
        spread=np.array([np.std(each) for each in leading], dtype=np.float64),
        trials=np.array([len(each) for each in leading], dtype=np.int64),
    )
