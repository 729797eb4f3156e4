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
from legbench.recording.checksum import CHECKED, Checker, Sealer, blank_checksums
from legbench.recording.description import layout_of
from legbench.recording.layout import RUN, TIME
from legbench.recording.manifest import Manifest, parse_manifest, to_json
from legbench.signals import Floats

END_MARK: Final = b"\xff\xff\xff\xff\x00\x00\x00\x00"
MANIFEST_KEY: Final = b"legbench"
"""Key of the schema's metadata under which the samples carry their manifest."""


def schema_for(manifest: Mapping[str, Any]) -> pa.Schema:
    """Return the schema of the samples, with units of columns and a copy of the manifest.

    Raises:
        FormatError: the manifest declares signals that no run can have.
    """
    layout = layout_of(manifest)
    units = {name: {b"unit": unit.encode()} for name, unit in layout.units.items()}
    fields = [pa.field(TIME, pa.int64(), nullable=False, metadata=units[TIME])]
    for column in layout.columns:
        kind = pa.int8() if column.small else pa.float64()
        unknown, unit = column.signal.name == "contact", units[column.name]
        fields.append(pa.field(column.name, kind, nullable=unknown, metadata=unit))
    return pa.schema(fields, metadata=carrying(manifest) | CHECKED)


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

    Arrow encodes one message and says where in it each column lies; every batch then puts its
    numbers there. To encode each anew takes four times as long in the middle of a control loop.
    """

    def __init__(self, like: Floats, schema: pa.Schema) -> None:
        """Prepare for columns like these, with a schema as `schema_for` returns it.

        Columns are (fields of the schema, rows), time first in seconds; NaN is null in an int8
        column.
        """
        kinds = [field.type for field in schema]
        self._narrow = [n for n, kind in enumerate(kinds) if kind == pa.int8()]
        unknown = np.isnan(like[self._narrow])
        self._rows, self._unknown = like.shape[1], unknown.tobytes()
        valid = dict(zip(self._narrow, ~unknown, strict=True))
        arrays = [_zeros(kind, self._rows, valid.get(n)) for n, kind in enumerate(kinds)]
        batch = pa.RecordBatch.from_arrays(arrays, schema=schema)
        self._message = _message_of(batch)
        self._sealer = Sealer(self._message)
        places = _places(self._message, schema)
        self._time = places[0]
        self._wide = [(places[n], n) for n, kind in enumerate(kinds) if kind == pa.float64()]
        self._small = [(places[n], n) for n in self._narrow]

    def fits(self, columns: Floats) -> bool:
        """Whether columns are like those that it was prepared for."""
        return (
            columns.shape[1] == self._rows
            and np.isnan(columns[self._narrow]).tobytes() == self._unknown
        )

    def encode(self, columns: Floats) -> memoryview:
        """Return the message of a batch that fits; the next one is made in the same memory."""
        np.rint(columns[0] * 1e9, out=self._time, casting="unsafe")
        for place, column in self._wide:
            place[:] = columns[column]
        for place, column in self._small:
            values = columns[column]
            place[:] = np.where(np.isnan(values), -1.0, values)
        self._sealer.seal()
        return memoryview(self._message)


def _message_of(batch: pa.RecordBatch) -> bytearray:
    """Message of a batch as a stream has it, with room for its checksum in the metadata."""
    opening = encode_schema(batch.schema)
    sink = pa.BufferOutputStream()
    with ipc.new_stream(sink, batch.schema) as writer:
        writer.write_batch(batch, custom_metadata=blank_checksums(opening))
    return bytearray(memoryview(sink.getvalue())[len(opening) : -len(END_MARK)])


def _zeros(kind: pa.DataType, rows: int, valid: np.ndarray | None) -> pa.Array:
    """Zeros of a kind, null where they are not valid; from buffers: `pa.array` imports pandas."""
    known = None
    if valid is not None and not valid.all():
        known = pa.py_buffer(np.packbits(valid, bitorder="little"))
    return pa.Array.from_buffers(kind, rows, [known, pa.py_buffer(bytes(8 * rows))])


def _places(message: bytearray, schema: pa.Schema) -> list[np.ndarray]:
    """Writable arrays of the columns inside an encoded batch, as Arrow's own reader finds them."""
    whole = pa.py_buffer(message)
    batch = ipc.read_record_batch(whole, schema)
    return [
        np.frombuffer(
            message,
            dtype=column.type.to_pandas_dtype(),
            count=batch.num_rows,
            offset=column.buffers()[1].address - whole.address,
        )
        for column in batch.columns
    ]


@final
class WholeBatches:
    """The batches of a stream up to its end mark, the first tear or the end of the file.

    A batch that does not match its checksum is left out; those after it are read. Iterate once;
    then the attributes are final.

    Attributes:
        schema: of the stream, None where even its message is torn.
        rows: in the batches so far.
        end: offset after the last message that could be read [bytes].
        size: of the file [bytes].
        damaged: in batches that were left out [bytes].
        tear: what is wrong, None where all is whole and the stream ends with its end mark.
    """

    def __init__(self, path: Path) -> None:
        """Open the stream at `path`; raises OSError where it cannot be read."""
        self._path = path
        self._file = pa.OSFile(str(path))
        self.size: int = self._file.size()
        self.schema: pa.Schema | None = None
        self.rows = self.end = self.damaged = 0
        self.tear: str | None = None
        self._ended = False
        schema = self._read_schema()
        if schema is None:
            self.tear = f"{path.name} is torn before its first row"
            return
        self.schema = schema
        self.end = self._file.tell()
        self._file.seek(0)
        self._checker = Checker(self._file.read(self.end), schema)

    def _read_schema(self) -> pa.Schema | None:
        """Schema of the stream, None where its message is torn or its names have rotted."""
        try:
            schema = ipc.read_schema(self._file)
            # Names are decoded when they are asked for.
            return schema if schema.names else None
        except (OSError, pa.ArrowException, UnicodeDecodeError):
            return None

    @property
    def torn(self) -> int:
        """Bytes that hold no row and are not the end mark; 0 for a stream without tear."""
        return self.damaged + (0 if self._ended else self.size - self.end)

    @property
    def opening_damaged(self) -> bool:
        """Whether names of columns and the copy of the manifest may be wrong."""
        return self.schema is not None and self._checker.opening_damaged

    def __iter__(self) -> Iterator[pa.RecordBatch]:
        """Yield every whole batch."""
        if self.schema is None:
            return
        batches = damaged = 0
        while True:
            try:
                message = ipc.read_message(self._file)
                whole = self._checker.whole(message)
                batch = ipc.read_record_batch(message, self.schema) if whole else None
            except (EOFError, OSError, pa.ArrowException):
                break
            before, self.end = self.end, self._file.tell()
            batches += 1
            if batch is None:
                damaged += 1
                self.damaged += self.end - before
                continue
            self.rows += batch.num_rows
            yield batch
        self.tear = "; ".join(filter(None, self._tears(damaged, batches))) or None

    def _tears(self, damaged: int, batches: int) -> Iterator[str]:
        """Say what is wrong, once everything has been read."""
        name = self._path.name
        if self._checker.opening_damaged:
            yield f"the opening of {name} is damaged: names and copy of {RUN} may be wrong"
        if damaged:
            yield f"{name} has rotten bytes in {damaged} of its {batches} batches, left out"
        with self._path.open("rb") as file:
            file.seek(self.end)
            rest = file.read(len(END_MARK) + 1)
        self._ended = rest == END_MARK
        if not self._ended:
            yield f"{name} has no end mark after {self.rows} rows" + (
                f", but {self.size - self.end} bytes of an unfinished batch" if rest else ""
            )
