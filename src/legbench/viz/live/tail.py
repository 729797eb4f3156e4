"""Reading the samples of a run while it is still being written."""

from pathlib import Path
from types import MappingProxyType
from typing import final

import numpy as np
import pyarrow as pa
from pyarrow import ipc

from legbench.recording.checksum import Checker
from legbench.recording.description import RunDescription
from legbench.recording.layout import TIME
from legbench.recording.reader import Recording
from legbench.recording.stream import END_MARK


@final
class Tail:
    """Reader of the batches that a growing Arrow stream has gained since the last look.

    Keeps the file open, so it reads to the end even after the writer has replaced the stream by
    its archive.

    Attributes:
        ended: whether the writer's end mark has been reached.

    Raises:
        FileNotFoundError: there is no such stream.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb")
        self._pending = b""
        self._schema: pa.Schema | None = None
        self._checker: Checker | None = None
        self.ended = False

    def read(self) -> list[pa.RecordBatch]:
        """The batches that have become whole; bytes of an unfinished one are kept for later.

        A batch that does not match its checksum is left out.
        """
        self._pending += self._file.read()
        reader = pa.BufferReader(self._pending)
        batches: list[pa.RecordBatch] = []
        while True:
            place = reader.tell()
            if self._pending[place : place + len(END_MARK)] == END_MARK:
                self.ended = True
                break
            try:
                message = ipc.read_message(reader)
            except (EOFError, OSError, pa.ArrowInvalid):
                break
            if self._schema is None or self._checker is None:
                self._schema = ipc.read_schema(message)
                self._checker = Checker(self._pending[: reader.tell()], self._schema)
            elif self._checker.whole(message):
                batches.append(ipc.read_record_batch(message, self._schema))
        self._pending = self._pending[place:]
        return batches

    def close(self) -> None:
        """Close the file of the stream."""
        self._file.close()


def rows_of(batches: list[pa.RecordBatch], run: RunDescription, folder: Path) -> Recording:
    """Some batches as a recording of their rows alone."""
    table = pa.Table.from_batches(batches)
    columns = {name: _values(table[name]) for name in table.column_names}
    return Recording(
        path=folder,
        manifest={},
        described=run,
        time=columns[TIME] / 1e9,
        columns=MappingProxyType(columns),
        events=(),
    )


def _values(column: pa.ChunkedArray) -> np.ndarray:
    """One column (n,); an unknown contact is -1, as in a loaded recording."""
    return column.fill_null(-1).to_numpy() if column.null_count else column.to_numpy()
