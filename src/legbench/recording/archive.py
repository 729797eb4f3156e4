"""`samples.parquet`: the samples of a closed run, a third smaller and readable everywhere."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import pyarrow as pa
from pyarrow import parquet

from legbench.errors import RecordingError
from legbench.recording.layout import ARCHIVE
from legbench.recording.sealed import UNREADABLE, damaged, opened, require_every_row, seal
from legbench.recording.stream import WholeBatches, carrying, schema_for
from legbench.writing import put_in_place, reason

GROUP_ROWS: Final = 65_536
"""Rows compressed together: 65 s at 1 kHz, 15 MB of memory."""


def write_archive(run: Path, batches: WholeBatches, manifest: Mapping[str, Any]) -> int:
    """Write the batches as `samples.parquet`, read it back, and only then put it in place.

    Args:
        run: the run folder.
        batches: a stream of samples, from its beginning.
        manifest: what the archive carries as its copy of `run.json`.

    Returns:
        The number of rows in the archive.

    Raises:
        RecordingError: it could not be written or read back; an older archive is untouched.
    """
    draft = run / f".{ARCHIVE}.draft"
    if batches.schema is None:
        schema = schema_for(manifest)
    else:
        schema = batches.schema.with_metadata(carrying(manifest))
    try:
        draft.unlink(missing_ok=True)
        written = _write(draft, batches, schema)
        found = count_rows(draft)
        if found != written:
            raise RecordingError(f"it gave back {found} of {written} rows")
        put_in_place(draft, run / ARCHIVE)
    except (OSError, pa.ArrowException) as error:
        with suppress(OSError):
            draft.unlink()
        raise RecordingError(f"{run / ARCHIVE} was not written: {reason(error)}") from error
    return written


def _write(draft: Path, batches: WholeBatches, schema: pa.Schema) -> int:
    rows = 0
    with parquet.ParquetWriter(
        str(draft),
        schema,
        compression="zstd",
        use_dictionary=False,
        column_encoding=column_encodings(schema),
        write_page_checksum=True,
    ) as writer:
        for group in _groups(batches, schema):
            writer.write_table(group)
            rows += group.num_rows
    with draft.open("r+b") as file:
        seal(file)
    return rows


def column_encodings(schema: pa.Schema) -> dict[str, str]:
    """Return the encoding of every column, which makes an archive a third smaller."""
    return {field.name: _encoding(field.type) for field in schema}


def _encoding(kind: pa.DataType) -> str:
    if pa.types.is_floating(kind):
        return "BYTE_STREAM_SPLIT"
    return "DELTA_BINARY_PACKED" if pa.types.is_int64(kind) else "PLAIN"


def _groups(batches: WholeBatches, schema: pa.Schema) -> Iterator[pa.Table]:
    """Gather small batches into tables of about GROUP_ROWS rows."""
    waiting: list[pa.RecordBatch] = []
    rows = 0
    for batch in batches:
        waiting.append(batch.replace_schema_metadata(schema.metadata))
        rows += batch.num_rows
        if rows >= GROUP_ROWS:
            yield pa.Table.from_batches(waiting, schema)
            waiting, rows = [], 0
    if waiting:
        yield pa.Table.from_batches(waiting, schema)


def count_rows(path: Path) -> int:
    """Return the rows of a Parquet file by decoding all of them.

    Raises:
        OSError, pyarrow.ArrowException: it is damaged, or ends before its last row.
    """
    with opened(path) as file:
        found = sum(batch.num_rows for batch in file.iter_batches(batch_size=GROUP_ROWS))
        require_every_row(found, file.metadata.num_rows)
    return found


def read_archive(run: Path) -> pa.Table:
    """Return the samples of a closed run.

    Raises:
        RecordingError: the archive is there but damaged.
    """
    path = run / ARCHIVE
    try:
        # Not `read_table`, which imports pyarrow's datasets: slow, and of no use to one file.
        with opened(path) as file:
            return file.read()
    except UNREADABLE as error:
        raise damaged(path, error) from error


def read_schema(run: Path) -> pa.Schema:
    """Return the schema of the archive, with the manifest in its metadata; raises as pyarrow."""
    with opened(run / ARCHIVE) as file:
        return file.schema_arrow
