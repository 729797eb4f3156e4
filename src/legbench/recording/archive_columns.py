"""Columns of a long run, which are decoded each time they are asked for instead of being kept."""

import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import mkdtemp
from types import MappingProxyType
from typing import Any, Final, final
from weakref import finalize

import numpy as np
import pyarrow as pa

from legbench.recording.archive import write_archive
from legbench.recording.layout import ARCHIVE
from legbench.recording.sealed import UNREADABLE, damaged, opened, require_every_row
from legbench.recording.stream import WholeBatches

LONG_ROWS: Final = 1 << 18
"""Rows above which columns are not kept: four minutes at 1 kHz, 60 MB."""
WINDOW_ROWS: Final = 1 << 16
"""Rows of a window, in which long runs are gone through: 65 s at 1 kHz, 15 MB."""


@final
class ArchiveColumns(Mapping[str, np.ndarray]):
    """Columns of a `samples.parquet`; each access reads one of them from the file.

    Raises:
        RecordingError: the file is damaged, also where a column is asked for.
    """

    def __init__(self, path: Path) -> None:
        """Read the footer of the archive at a path."""
        self._path = path
        try:
            with opened(path) as file:
                self.schema: pa.Schema = file.schema_arrow
                self.rows: int = file.metadata.num_rows
        except UNREADABLE as error:
            raise damaged(path, error) from error

    def __getitem__(self, name: str) -> np.ndarray:
        """Values of a column (n,), read-only."""
        if name not in self.schema.names:
            raise KeyError(name)
        try:
            with opened(self._path) as file:
                values = column_values(file.read([name])[name])
            require_every_row(len(values), self.rows)
            return values
        except UNREADABLE as error:
            raise damaged(self._path, error) from error

    def __contains__(self, name: object) -> bool:
        return name in self.schema.names

    def __iter__(self) -> Iterator[str]:
        return iter(self.schema.names)

    def __len__(self) -> int:
        return len(self.schema.names)

    def windows(self, rows: int) -> Iterator[dict[str, np.ndarray]]:
        """All columns of consecutive rows, at most `rows` of them at a time."""
        found = 0
        try:
            with opened(self._path) as file:
                for batch in file.iter_batches(batch_size=rows):
                    table = pa.Table.from_batches([batch])
                    yield {name: column_values(table[name]) for name in table.column_names}
                    found += batch.num_rows
            require_every_row(found, self.rows)
        except UNREADABLE as error:
            raise damaged(self._path, error) from error


@final
class ArchiveRows(Mapping[str, np.ndarray]):
    """Consecutive rows of the columns of a long run, decoded when they are asked for."""

    def __init__(self, columns: "ArchiveColumns | ArchiveRows", rows: slice) -> None:
        """Take rows, whose slice has step one, of columns."""
        self._columns = columns
        self._first, self._stop, _ = rows.indices(columns.rows)
        self.rows = max(0, self._stop - self._first)

    def __getitem__(self, name: str) -> np.ndarray:
        """Values of a column (n,), read-only; a copy, so that the rest of it is not kept."""
        values = self._columns[name][self._first : self._stop].copy()
        values.flags.writeable = False
        return values

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def windows(self, rows: int) -> Iterator[dict[str, np.ndarray]]:
        """All columns of consecutive rows, at most `rows` of them at a time."""
        first = 0
        for part in self._columns.windows(rows):
            count = len(next(iter(part.values()), ()))
            begin, end = max(self._first - first, 0), min(self._stop - first, count)
            if begin < end:
                yield {name: values[begin:end] for name, values in part.items()}
            first += count
            if first >= self._stop:
                return


def rows_of(columns: Mapping[str, np.ndarray], rows: slice) -> Mapping[str, np.ndarray]:
    """Return consecutive rows of columns; those that are in a file stay there."""
    if isinstance(columns, ArchiveColumns | ArchiveRows):
        return ArchiveRows(columns, rows)
    return MappingProxyType({name: values[rows] for name, values in columns.items()})


def spooled(stream: WholeBatches, manifest: Mapping[str, Any]) -> ArchiveColumns:
    """Columns of a long stream, through an archive that lives as long as they do.

    Raises:
        RecordingError: there is no room for it where temporary files go.
    """
    folder = Path(mkdtemp(prefix="legbench-"))
    try:
        write_archive(folder, stream, manifest)
        columns = ArchiveColumns(folder / ARCHIVE)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    finalize(columns, shutil.rmtree, folder, ignore_errors=True)
    return columns


def column_values(column: pa.ChunkedArray) -> np.ndarray:
    """Return one column (n,), read-only; nulls of an integer are -1."""
    values = column.to_numpy()
    if column.null_count and pa.types.is_integer(column.type):
        values = np.where(np.isnan(values), -1, values).astype(column.type.to_pandas_dtype())
    values.flags.writeable = False
    return values


def column_windows(
    columns: Mapping[str, np.ndarray], rows: int
) -> Iterator[Mapping[str, np.ndarray]]:
    """Consecutive rows of columns of equal length, at most `rows` of them at a time."""
    if isinstance(columns, ArchiveColumns | ArchiveRows):
        yield from columns.windows(rows)
        return
    length = max(map(len, columns.values()), default=0)
    for first in range(0, length, rows):
        yield {name: values[first : first + rows] for name, values in columns.items()}
