"""`samples.arrows`: an Arrow IPC stream, one message a batch, readable up to any tear.

The stream is the concatenation of the schema's message, one message a batch and an end mark of
eight bytes, so a batch reaches the operating system in one `write`.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final, final

import numpy as np
import pyarrow as pa
from pyarrow import ipc

from legbench.errors import RecordingError
from legbench.recording.description import layout_of
from legbench.recording.layout import RUN, TIME
from legbench.recording.manifest import Manifest, parse_manifest, to_json
from legbench.signals import Floats

END_MARK: Final = b"\xff\xff\xff\xff\x00\x00\x00\x00"
MANIFEST_KEY: Final = b"legbench"
"""Key of the schema's metadata under which the samples carry their manifest."""


def schema_for(manifest: Mapping[str, Any]) -> pa.Schema:
    """Return the schema of the samples, with a copy of the manifest.

    Raises:
        FormatError: the manifest declares signals that no run can have.
    """
    fields = [pa.field(TIME, pa.int64(), nullable=False)]
    for column in layout_of(manifest).columns:
        kind = pa.int8() if column.small else pa.float64()
        fields.append(pa.field(column.name, kind, nullable=column.signal.name == "contact"))
    return pa.schema(fields, metadata=carrying(manifest))


def carrying(manifest: Mapping[str, Any]) -> dict[bytes, bytes]:
    """Return the metadata with which samples carry a copy of their manifest."""
    return {MANIFEST_KEY: to_json(manifest)}


def carried_manifest(schema: pa.Schema | None, run: Path) -> Manifest:
    """Return the manifest that the samples of `run` carry, for a run that lost `run.json`.

    Raises:
        RecordingError: they carry none, or their own opening is torn (`schema` is None).
        FormatError: a newer version wrote it.
    """
    metadata = {} if schema is None else schema.metadata or {}
    if MANIFEST_KEY not in metadata:
        raise RecordingError(f"{run} has lost its {RUN}, and its samples carry no copy of it")
    return parse_manifest(metadata[MANIFEST_KEY], source=f"the manifest in the samples of {run}")


def encode_schema(schema: pa.Schema) -> memoryview:
    """Return the message that opens a stream."""
    return memoryview(schema.serialize())


@final
class BatchEncoder:
    """Makes messages of batches that are alike: as many rows, nulls in the same places.

    A batch of Arrow's is built once, over memory that is filled anew for each message. Built from
    buffers, since `pa.array` looks for pandas first.
    """

    def __init__(self, like: Floats, schema: pa.Schema) -> None:
        """Prepare for columns like these, with a schema as `schema_for` returns it.

        Columns are (fields of the schema, rows), time first in seconds; NaN is null in an int8
        column.
        """
        self._wide = [n for n, field in enumerate(schema) if field.type == pa.float64()]
        self._narrow = [n for n, field in enumerate(schema) if field.type == pa.int8()]
        self._time = np.empty(like.shape[1], dtype=np.int64)
        self._floats = np.empty_like(like[self._wide])
        self._known = ~np.isnan(like[self._narrow])
        self._small = np.empty(self._known.shape, dtype=np.int8)
        arrays = {0: _array(pa.int64(), self._time)}
        for place, values in zip(self._wide, self._floats, strict=True):
            arrays[place] = _array(pa.float64(), values)
        for place, values, known in zip(self._narrow, self._small, self._known, strict=True):
            arrays[place] = _array(pa.int8(), values, None if known.all() else known)
        ordered = [arrays[place] for place in range(len(schema))]
        self._batch = pa.RecordBatch.from_arrays(ordered, schema=schema)

    def fits(self, columns: Floats) -> bool:
        """Whether columns are like those that it was prepared for."""
        return columns.shape[1] == len(self._time) and np.array_equal(
            ~np.isnan(columns[self._narrow]), self._known
        )

    def encode(self, columns: Floats) -> memoryview:
        """Return the message of a batch that fits."""
        np.rint(columns[0] * 1e9, out=self._time, casting="unsafe")
        self._floats[:] = columns[self._wide]
        small = np.where(self._known, columns[self._narrow], -1.0)
        np.copyto(self._small, small, casting="unsafe")
        return memoryview(self._batch.serialize())


def _array(kind: pa.DataType, values: np.ndarray, known: np.ndarray | None = None) -> pa.Array:
    valid = None if known is None else pa.py_buffer(np.packbits(known, bitorder="little"))
    return pa.Array.from_buffers(kind, len(values), [valid, pa.py_buffer(values)])


@final
class WholeBatches:
    """The batches of a stream up to its end mark, the first tear or the end of the file.

    Iterate it once; then the attributes are final.

    Attributes:
        schema: of the stream, None where even its message is torn.
        rows: in the batches so far.
        end: offset after the last whole message [bytes].
        size: of the file [bytes].
        tear: what is wrong with the rest, None where the stream ends with its end mark.
    """

    def __init__(self, path: Path) -> None:
        """Open the stream at `path`; raises OSError where it cannot be read."""
        self._path = path
        self._file = pa.OSFile(str(path))
        self.size: int = self._file.size()
        self.schema: pa.Schema | None = None
        self.rows = self.end = 0
        self.tear: str | None = None
        try:
            self._reader = ipc.open_stream(self._file)
        except (OSError, pa.ArrowException):
            self.tear = f"{path.name} is torn before its first row"
            return
        self.schema = self._reader.schema
        self.end = self._file.tell()

    def __iter__(self) -> Iterator[pa.RecordBatch]:
        """Yield every whole batch."""
        if self.schema is None:
            return
        while True:
            try:
                batch = self._reader.read_next_batch()
            except (StopIteration, OSError, pa.ArrowException):
                break
            self.rows += batch.num_rows
            self.end = self._file.tell()
            yield batch
        with self._path.open("rb") as file:
            file.seek(self.end)
            rest = file.read(len(END_MARK) + 1)
        if rest != END_MARK:
            self.tear = f"{self._path.name} has no end mark after {self.rows} rows" + (
                f", but {self.size - self.end} bytes of an unfinished batch" if rest else ""
            )
