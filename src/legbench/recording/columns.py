"""The columns of a run: what plant and controller declare, times the legs of the robot.

One table makes the rows in memory, the schema on disk, the signals that a reader finds and the
series that pictures plot.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from legbench.errors import ConfigError
from legbench.recording.layout import TIME
from legbench.signals import SIGNALS, Signal

SMALL_INTEGERS: Final = frozenset({"phase", "contact"})
"""Signals stored as int8; `contact` is null where the plant does not know it."""

PER_CYCLE: Final = frozenset({"cycle_us", "late_us"})
"""Signals of the control cycle, of which there is one however many legs there are."""

WORD: Final = re.compile(r"[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*")
COMPONENT: Final = re.compile(r"[A-Za-z0-9]+")


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One column on disk: one component of one signal of one leg."""

    name: str
    signal: Signal
    leg: int
    """Index of the leg; 0 for a signal of the control cycle."""
    small: bool
    """Whether it is an int8 column instead of a float64 column."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Columns of a run after the time, in their order on disk.

    Raises:
        ConfigError: there is no leg, or a signal of the controller's own has a name that a column
            cannot have, or one that another signal has.
    """

    own: tuple[Signal, ...] = ()
    """Signals that the controller declares."""
    legs: int = 1
    """Legs of the robot; a single one has no prefix."""

    def __post_init__(self) -> None:
        if self.legs < 1:
            raise ConfigError(f"a run records at least one leg, not {self.legs}")
        for signal in self.own:
            words = (WORD.fullmatch(signal.name), *map(COMPONENT.fullmatch, signal.components))
            if not all(words):
                raise ConfigError(
                    f"signal {signal.name!r} with components {list(signal.components)} cannot name"
                    " columns; use letters and digits, in the signal's name underscores between"
                )
        names = [TIME, "t", "time"]
        for signal in self.signals:
            names += [*signal.columns, *([signal.name] if signal.components else [])]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ConfigError(
                f"a controller's own signal is called {', '.join(twice)}, which every run has or"
                " another signal of it has; give it a name of its own"
            )

    @property
    def signals(self) -> tuple[Signal, ...]:
        """Every signal: those of each run, then the controller's own."""
        return (*SIGNALS, *self.own)

    @property
    def columns(self) -> tuple[Column, ...]:
        """Every column, the first leg's first, those of the control cycle where it has them."""
        return tuple(
            column
            for leg in range(self.legs)
            for signal in self.signals
            if leg == 0 or signal.name not in PER_CYCLE
            for column in self._of(signal, leg)
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Name of every column."""
        return tuple(column.name for column in self.columns)

    @property
    def units(self) -> dict[str, str]:
        """Unit of every column, the time first."""
        return {TIME: "ns"} | {column.name: column.signal.unit for column in self.columns}

    def columns_of(self, signal: Signal) -> tuple[tuple[str, ...], ...]:
        """Column names of a signal, one tuple a leg; one alone for a signal of the cycle."""
        legs = 1 if signal.name in PER_CYCLE else self.legs
        return tuple(tuple(column.name for column in self._of(signal, leg)) for leg in range(legs))

    def _of(self, signal: Signal, leg: int) -> Iterator[Column]:
        alone = self.legs == 1 or signal.name in PER_CYCLE
        prefix = "" if alone else f"leg{leg + 1}_"
        small = signal.name in SMALL_INTEGERS
        for name in signal.columns:
            yield Column(name=prefix + name, signal=signal, leg=leg, small=small)


ONE_LEG: Final = Layout()
"""Layout of one leg under a controller without signals of its own."""
