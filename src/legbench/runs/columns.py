"""Columns of the table of runs: their names, short or whole, and their units."""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any, Final

from legbench.errors import ConfigError
from legbench.metrics.units import UNITS as FIGURES

USUAL: Final = ("run", "setup", "controller", "z2", "dz2", "status", "duration", "rating", "jumps")
"""Columns that are shown unless others are asked for."""

UNITS: Final = FIGURES | {
    "planned_duration": "s",
    "controller.settings.z2": "rad",
    "controller.settings.dz2": "rad",
}
"""Units of figures and of the most used settings; the others have none, or the design file's."""


def names_in(rows: Iterable[Mapping[str, Any]]) -> list[str]:
    """Every column that one of the rows has, in the order in which they first appear."""
    return list(dict.fromkeys(name for row in rows for name in row))


def column_named(asked: str, names: list[str]) -> str:
    """Return the column that is meant by a name or by the last parts of a dotted one.

    Raises:
        ConfigError: no column, or more than one, is called so; lists those that are near.
    """
    if asked in names:
        return asked
    ends = [name for name in names if name.endswith(f".{asked}")]
    if len(ends) == 1:
        return ends[0]
    if ends:
        raise ConfigError(f"{asked!r} may mean {', '.join(ends)}; write out one of them")
    last = {name.rpartition(".")[2]: name for name in reversed(names)}
    near = [last[word] for word in get_close_matches(asked.rpartition(".")[2], last, 3, 0.5)]
    hint = f"; near are {', '.join(near)}" if near else f"; there are {', '.join(names[:12])}"
    raise ConfigError(f"no run has a figure or setting {asked!r}{hint}")


def titled(name: str) -> str:
    """Name of a column for a heading, without its tables and with its unit in brackets."""
    unit = UNITS.get(name)
    short = name.rpartition(".settings.")[2]
    return f"{short} [{unit}]" if unit else short
