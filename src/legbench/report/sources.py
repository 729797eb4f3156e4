"""Campaigns that a report puts side by side, read from their folders."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any, Final

import pyarrow as pa

from legbench.campaign.again import CAMPAIGN
from legbench.campaign.curves import Cell, cell_of, rows_of, sound_runs, varying_axes
from legbench.campaign.folder import SOURCE
from legbench.campaign.table import PROVENANCE_KEY, read_table
from legbench.metrics.soundness import Soundness
from legbench.reading import LARGEST_JSON, UnreadableError, parse_json, read_file
from legbench.recording.layout import COMPLETE

IDEAL: Final = "ideal"
EXPLAINED: Final = "explained"
BENCH: Final = "bench"


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignSource:
    """Campaign of a report: its folder, its table and what it says of itself."""

    name: str
    """Name of its column: `ideal`, `explained` or `bench`."""
    folder: Path
    table: pa.Table
    told: Mapping[str, Any]
    """Content of its `campaign.json`; empty where there is none."""
    source: str
    """Text of its campaign file; empty where there is none."""

    @property
    def title(self) -> str:
        """Name of the campaign."""
        return str(self.told.get("name", self.folder.name))

    @property
    def provenance(self) -> tuple[Mapping[str, Any], ...]:
        """Versions, processor and mathematics library of every machine that took part."""
        told = json.loads((self.table.schema.metadata or {}).get(PROVENANCE_KEY, b"[]"))
        machines = told if isinstance(told, list) else [told]
        return tuple(each for each in machines if isinstance(each, Mapping))


@dataclass(frozen=True, slots=True, kw_only=True)
class InvalidRun:
    """Run that does not count, with the reason."""

    experiment: str
    """Hash of its experiment."""
    cell: Cell
    trial: int
    reason: str


def read_source(name: str, folder: Path | str) -> CampaignSource:
    """Read the campaign in a folder.

    Args:
        name: name of its column, `ideal`, `explained` or `bench`.
        folder: the folder, with at least the table.

    Raises:
        ConfigError: it has no table, or has not come to its end.
        FormatError: another version wrote the table.
        RecordingError: the table is damaged.
    """
    folder = Path(folder)
    told = _json(folder / CAMPAIGN)
    return CampaignSource(
        name=name, folder=folder, table=read_table(folder), told=told, source=_text(folder / SOURCE)
    )


def invalid_runs(table: pa.Table) -> tuple[InvalidRun, ...]:
    """Runs that a fault or an interruption has ended, or whose numerics are unsound."""
    good = set(sound_runs(table)["experiment"].to_pylist())
    axes = varying_axes(table)
    return tuple(
        InvalidRun(
            experiment=row["experiment"],
            cell=cell_of(row, axes),
            trial=row["trial"],
            reason=_reason(row),
        )
        for row in rows_of(table, "run")
        if row["experiment"] not in good
    )


def _reason(row: Mapping[str, Any]) -> str:
    reasons = []
    if row["status"] != COMPLETE:
        cause = f" ({row['cause']})" if row["cause"] else ""
        reasons.append(f"{row['status']}{cause} after {row['length']:.3g} s")
    if row["numerics"] == Soundness.UNSOUND:
        values = (
            ("energy residual", row["energy_residual"], ""),
            ("loop gap", 1e6 * row["loop_gap_max"], " um"),
        )
        known = [f"{name} {value:.2g}{unit}" for name, value, unit in values if isfinite(value)]
        reasons.append(f"numerics unsound: {', '.join(known)}")
    return "; ".join(reasons)


def _json(path: Path) -> Mapping[str, Any]:
    try:
        told = parse_json(read_file(path, LARGEST_JSON))
    except (FileNotFoundError, UnreadableError):
        return {}
    return told if isinstance(told, dict) else {}


def _text(path: Path) -> str:
    try:
        return read_file(path, LARGEST_JSON).decode("utf-8", errors="replace")
    except (FileNotFoundError, UnreadableError):
        return ""
