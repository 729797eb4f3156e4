"""`legbench export`: a recorded run as a file of another program."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional

from legbench.cli.output import note, print_json, timed_progress
from legbench.cli.parse import parse, wrong_usage
from legbench.export.formats import Format, export
from legbench.recording.reader import load


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportArguments:
    """Write a recorded run, whole and exact, as a file that other programs read."""

    run: Annotated[Path, Positional]
    """Run folder; a torn one is written as far as it goes."""
    csv: bool = False
    """Text for spreadsheets: units in the header, time in seconds, names of phases."""
    parquet: bool = False
    """Columns for pandas, polars, DuckDB, MATLAB and others."""
    mat: bool = False
    """Variables for MATLAB, Octave and scipy."""
    mcap: bool = False
    """Messages for Foxglove, PlotJuggler and rerun; takes several times as long."""
    out: Path | None = None
    """File to write; by default in the run folder, named after the run. Its suffix chooses the
    format where no flag does."""
    json: bool = False
    """Print one JSON object on stdout: file, format, rows."""


def main(arguments: list[str]) -> int:
    """Run `legbench export`."""
    chosen = parse(ExportArguments, "export", arguments)
    kinds = _formats(chosen)
    if len(kinds) != 1:
        flags = ", ".join(f"--{kind.value}" for kind in Format)
        said = "one file has one format" if kinds else "no format was chosen"
        return wrong_usage("export", f"{said}; choose one of {flags}")
    (kind,) = kinds
    if _named(chosen.out) not in (None, kind):
        return wrong_usage("export", f"--{kind.value} does not go with {chosen.out}; name one")
    recording = load(chosen.run)
    if recording.torn is not None:
        note(f"legbench: {chosen.run} is torn ({recording.torn}); written as far as it goes")
    path = chosen.out or recording.path / f"{recording.path.resolve().name}.{kind.value}"
    export(recording, path, kind, timed_progress())
    rows = len(recording.time)
    note(f"wrote {path}: {rows} rows")
    if chosen.json:
        print_json({"out": str(path), "format": kind.value, "rows": rows})
    return 0


def _formats(chosen: ExportArguments) -> list[Format]:
    """Formats that the flags ask for or, where none does, the suffix of the file."""
    asked = [kind for kind in Format if getattr(chosen, kind.value)]
    named = _named(chosen.out)
    return asked or ([] if named is None else [named])


def _named(out: Path | None) -> Format | None:
    """Format that the suffix of a file stands for, if any."""
    suffix = "" if out is None else out.suffix.lower().lstrip(".")
    return next((kind for kind in Format if kind.value == suffix), None)
