"""The disk of a run in virtual time, whose loop writes its own rows.

A thread would gain nothing: it shares the interpreter's lock with the loop, and to wake it takes
as long as to write. A loop in real time records through `process_disk.ProcessDisk`.
"""

from typing import final

import pyarrow as pa

from legbench.recording.abstract_disk import AbstractDisk, AbstractLog
from legbench.recording.files import Appender
from legbench.recording.logs import LoopLog
from legbench.recording.rows import RowBlock
from legbench.recording.store import RunStore
from legbench.recording.stream import encode_schema


@final
class Disk(AbstractDisk):
    """Writes the blocks, events and logs of one run in the loop, which waits for a slow disk."""

    def __init__(self, samples: Appender, events: Appender, schema: pa.Schema) -> None:
        """Write the opening of the stream; raises OSError."""
        self._samples, self._events = samples, events
        self._store = RunStore(samples, events, schema)
        self.kept = self._store.kept
        samples.append(encode_schema(schema))

    @property
    def lagging(self) -> bool:
        """False: nothing waits here."""
        return False

    def take(self, block: RowBlock) -> None:
        """Write the rows of a block and empty it."""
        self._store.write(block.columns())
        block.count = 0

    def event(self, line: bytes) -> None:
        """Write one whole line to the events."""
        self._store.event(line)

    def log(self, file: Appender) -> AbstractLog:
        """Begin a log in a file, which is the log's from now on."""
        return LoopLog(self._store.log(file))

    def finish(self) -> None:
        """Write the end mark and wait until everything has reached the disk."""
        self._store.finish()

    def close(self) -> None:
        """Close both files, which releases the lock on the run."""
        self._samples.close()
        self._events.close()
