"""A campaign as data: the cells that its file describes, before any of them is an experiment."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

Settings = Mapping[str, Any]
"""Value by dotted key, in the words of an experiment file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CellBlock:
    """Block of cells: every entry of a list with every point of a grid."""

    name: str
    """Name in messages and plans."""
    trials: int
    """Number of runs of each cell, which differ in their seed alone."""
    settings: Settings
    """Settings that all cells of the block share."""
    grid: Mapping[str, list[Any]]
    """Values by dotted key; the cells are all combinations."""
    entries: tuple[Settings, ...]
    """Entries of the list, each with settings of its own; one without any if there is no list."""

    @property
    def cells(self) -> int:
        """Number of cells, exclusions not yet taken out."""
        return len(self.entries) * math.prod(len(values) for values in self.grid.values())


@dataclass(frozen=True, slots=True, kw_only=True)
class Campaign:
    """Campaign: many experiments from one base."""

    name: str
    source: str
    """Text of its file."""
    folder: Path
    """Folder to which paths are relative."""
    base: Mapping[str, Any]
    """Tables of the experiment that every cell begins with."""
    blocks: tuple[CellBlock, ...]
    excluded: tuple[Settings, ...]
    """Settings of cells that are left out: those that match all keys of one entry."""
    infeasible: Literal["refuse", "skip"]
    """Treatment of cells that the leg cannot do: refuse the campaign, or leave them out."""

    @property
    def size(self) -> int:
        """Number of experiments, exclusions not yet taken out."""
        return sum(block.cells * block.trials for block in self.blocks)
