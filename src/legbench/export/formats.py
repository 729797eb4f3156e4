"""Choice of a file format for a run, and writing it whole or not at all."""

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path

from legbench.errors import ConfigError
from legbench.export.content import Progress, no_progress
from legbench.guests import load_text
from legbench.recording.layout import ARCHIVE, EVENTS, RUN, STREAM
from legbench.recording.reader import Recording
from legbench.writing import draft_of


class Format(StrEnum):
    """Format of an exported run; the value is the suffix of its file."""

    CSV = "csv"
    """Text for spreadsheets."""
    PARQUET = "parquet"
    """Columns for pandas, polars, DuckDB, MATLAB and others."""
    MAT = "mat"
    """Variables for MATLAB, Octave and scipy."""
    MCAP = "mcap"
    """Messages for Foxglove, PlotJuggler and rerun."""


WRITERS = {
    Format.CSV: "legbench.export.csv_file:write_csv",
    Format.PARQUET: "legbench.export.parquet_file:write_parquet",
    Format.MAT: "legbench.export.mat_file:write_mat",
    Format.MCAP: "legbench.export.mcap_file:write_mcap",
}
"""Format -> the function that writes it, loaded when it is asked for."""


def export(
    recording: Recording, path: Path, kind: Format, progress: Progress = no_progress
) -> Path:
    """Write a run as a file of another program; an older file is replaced when all is well.

    Args:
        recording: the run.
        path: the file; its folder is made if need be.
        kind: format of the file.
        progress: called after each part that has been written.

    Raises:
        ConfigError: the file is one of the run's own, or the format cannot hold a column.
        RecordingError: it cannot be written, or the run's own file is damaged.
        MissingExtraError: a library that the format needs is not installed.
    """
    own = [recording.path / name for name in (ARCHIVE, STREAM, RUN, EVENTS)]
    if path.resolve() in [each.resolve() for each in own]:
        raise ConfigError(f"{path} is part of the recording itself; choose another file with --out")
    write: Callable[[Recording, Path, Progress], None] = load_text(WRITERS[kind])
    with draft_of(path) as draft:
        write(recording, draft, progress)
    return path
