"""Numbers that the paper publishes of its experiments, as data to compare with.

`models/campaigns/paper.csv` has each of them once, with the sentence in which it stands. Nothing is
computed from them.
"""

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import Final

from legbench.design.setup import SetupKind
from legbench.errors import ConfigError
from legbench.reading import UnreadableError, read_file
from legbench.shipped import shipped_root

PAPER: Final = shipped_root() / "models" / "campaigns" / "paper.csv"
"""File of the published numbers, which comes with the package."""
LARGEST: Final = 1_000_000
"""Largest file of published numbers that is read [bytes]; the paper's has a hundredth of it."""


class Relation(StrEnum):
    """Relation of what was measured to the number that the paper prints."""

    EQUAL = "="
    MORE = ">"
    LESS = "<"
    ABOUT = "about"


@dataclass(frozen=True, slots=True, kw_only=True)
class Published:
    """One number of the paper, with what it is about and where it stands.

    Raises:
        ConfigError: a number that is not finite, or a key without words that explain it.
    """

    key: str
    """Name of the number, unique in its file."""
    value: float
    unit: str
    """SI unit; `1` for a ratio or a count."""
    comparison: Relation
    setup: SetupKind | None
    """Setup that it is about; none: every setup, or the leg itself."""
    controller: str | None
    """Kind of the controller that it is about."""
    z2: float | None
    """Set point of the experiment [rad]."""
    dz2: float | None
    """Deflection of the experiment [rad]."""
    what: str
    """Meaning of the number in words."""
    section: str
    figure: str | None
    """Figure or table that shows it, where one does."""
    sentence: str
    """Words of the paper around the number."""

    def __post_init__(self) -> None:
        if not math.isfinite(self.value):
            raise ConfigError(f"{self.key} is {self.value}; a published number is finite")
        if not (self.key and self.what and self.sentence):
            raise ConfigError(f"{self.key or 'a row'} needs a key, what it is, and its sentence")

    @property
    def place(self) -> str:
        """Section, and figure or table, where the number stands."""
        return ", ".join(filter(None, (f"section {self.section}", self.figure)))


COLUMNS: Final = tuple(field.name for field in fields(Published))
"""Columns of a file of published numbers, in order."""


def published(path: Path = PAPER) -> Mapping[str, Published]:
    """Read published numbers by key, in the order of the file; the paper's by default.

    Raises:
        ConfigError: the file cannot be read, has other columns, a key twice or something that is
            no number; the message tells the file and the line.
    """
    try:
        lines = read_file(path, LARGEST).decode("utf-8").splitlines()
    except FileNotFoundError as error:
        raise ConfigError(f"{path}: no such file of published numbers") from error
    except (UnreadableError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: no published numbers can be read: {error}") from error
    if not lines or tuple(lines[0].split(",")) != COLUMNS:
        raise ConfigError(f"{path}, line 1: the columns must be {','.join(COLUMNS)}")
    found: dict[str, Published] = {}
    for line, cells in enumerate(csv.reader(lines[1:]), 2):
        try:
            number = _parse(cells)
        except ValueError as error:
            raise ConfigError(f"{path}, line {line}: {error}") from error
        if number.key in found:
            raise ConfigError(f"{path}, line {line}: {number.key} is there twice")
        found[number.key] = number
    return MappingProxyType(found)


def _parse(row: list[str]) -> Published:
    if len(row) != len(COLUMNS):
        raise ValueError(f"{len(row)} cells; there are {len(COLUMNS)} columns")
    cells = dict(zip(COLUMNS, row, strict=True))
    for key, known in (("comparison", Relation), ("setup", ("", *SetupKind))):
        if cells[key] not in tuple(known):
            raise ValueError(
                f"{key} is {cells[key]!r}; choose from {', '.join(filter(None, known))}"
            )
    return Published(
        key=cells["key"],
        value=float(cells["value"]),
        unit=cells["unit"],
        comparison=Relation(cells["comparison"]),
        setup=SetupKind(cells["setup"]) if cells["setup"] else None,
        controller=cells["controller"] or None,
        z2=float(cells["z2"]) if cells["z2"] else None,
        dz2=float(cells["dz2"]) if cells["dz2"] else None,
        what=cells["what"],
        section=cells["section"],
        figure=cells["figure"] or None,
        sentence=cells["sentence"],
    )
