"""Recorded signals against replayed ones: to the bit, and by how much where they differ."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from legbench.recording.columns import Layout
from legbench.signals import Bools, Floats, Ints

Column = NDArray[Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstDifference:
    """First row in which a replayed signal is not the recorded one."""

    cycle: int
    """Index of the row."""
    time: float
    """Plant time of the row [s]."""
    signal: str
    """Column of the signal, such as `command_pos_1`."""
    recorded: float
    replayed: float

    def __str__(self) -> str:
        return (
            f"cycle {self.cycle}, t = {self.time:.6g} s: {self.signal} was {self.recorded!r}, "
            f"is {self.replayed!r}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Deviation:
    """Error of one replayed column against the recorded one."""

    signal: str
    """Column of the signal, such as `joint_pos_1`."""
    unit: str
    rms: float
    """Root of the mean square over the rows in which both are known [the signal's unit]."""
    max: float
    """Largest absolute difference [the signal's unit]."""
    max_time: float
    """Plant time of that [s]."""
    first_cycle: int | None
    """First row that differs by more than was allowed, none if no row does."""
    first_time: float | None
    """Plant time of that row [s]."""
    rows: int
    """Number of rows that differ by more than was allowed."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Replayed:
    """Columns of a run beside the same columns as they came out of a replay."""

    time: Floats
    """Plant time of the rows (n,) [s]."""
    recorded: Mapping[str, Column]
    """Column -> recorded values (n,)."""
    replayed: Mapping[str, Column]
    """Column -> replayed values (n,)."""
    units: Mapping[str, str]
    """Column -> its unit."""

    @property
    def identical(self) -> bool:
        """Whether all columns agree to the bit."""
        return self.first() is None

    def first(self) -> FirstDifference | None:
        """First row in which any column differs to the bit, none if none does."""
        rows = {name: _first(unlike) for name, unlike in self._unlike()}
        known = {name: row for name, row in rows.items() if row is not None}
        if not known:
            return None
        name = min(known, key=lambda each: known[each])
        row = known[name]
        return FirstDifference(
            cycle=row,
            time=float(self.time[row]),
            signal=name,
            recorded=self.recorded[name][row].item(),
            replayed=self.replayed[name][row].item(),
        )

    def deviations(self, allowed: float = 0.0) -> tuple[Deviation, ...]:
        """Errors of all columns; a row counts once it differs by more than `allowed`.

        Args:
            allowed: difference that is let pass, in each signal's own unit; 0 lets none pass.
        """
        return tuple(self._deviation(name, unlike, allowed) for name, unlike in self._unlike())

    def to_json(self, allowed: float = 0.0) -> dict[str, Any]:
        """Return the comparison as JSON's types, its deviations by column."""
        first = self.first()
        found = {}
        for each in self.deviations(allowed):
            entry: dict[str, Any] = asdict(each)
            found[entry.pop("signal")] = entry
        return {
            "identical": first is None,
            "rows": len(self.time),
            "first": None if first is None else asdict(first),
            "signals": found,
        }

    def _unlike(self) -> Iterator[tuple[str, Bools]]:
        for name, recorded in self.recorded.items():
            yield name, ~same_bits(recorded, self.replayed[name])

    def _deviation(self, name: str, unlike: Bools, allowed: float) -> Deviation:
        apart = self.replayed[name].astype(float) - self.recorded[name].astype(float)
        known = np.isfinite(apart)
        size = np.where(known, np.abs(apart), 0.0)
        # A value that only one of the two has is beyond any bound.
        beyond = unlike & (~known | (size > allowed))
        first = _first(beyond)
        worst = int(np.argmax(size)) if len(size) else 0
        return Deviation(
            signal=name,
            unit=self.units[name],
            rms=float(np.sqrt(np.mean(size[known] ** 2))) if known.any() else float("nan"),
            max=float(size[worst]) if known.any() else float("nan"),
            max_time=float(self.time[worst]) if len(size) else float("nan"),
            first_cycle=first,
            first_time=None if first is None else float(self.time[first]),
            rows=int(np.count_nonzero(beyond)),
        )


def same_bits(ours: Column, theirs: Column) -> Bools:
    """Whether two columns (n,) agree to the bit, row by row; all that is not a number agrees."""
    if ours.dtype.kind != "f":
        return ours == theirs
    a, b = (np.ascontiguousarray(each, dtype=np.float64) for each in (ours, theirs))
    bits_a: Ints = a.view(np.int64)
    bits_b: Ints = b.view(np.int64)
    return (bits_a == bits_b) | (np.isnan(a) & np.isnan(b))


def _first(mask: Bools) -> int | None:
    rows = np.flatnonzero(mask)
    return int(rows[0]) if len(rows) else None


def columns_of(layout: Layout, names: tuple[str, ...]) -> tuple[str, ...]:
    """Columns of the signals `names` of one leg, in that order."""
    signals = {signal.name: signal for signal in layout.signals}
    return tuple(column for name in names if name in signals for column in signals[name].columns)
