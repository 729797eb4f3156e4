"""The thread between the control loop and the disk: the loop only ever puts and goes on.

It shares the interpreter's lock with the loop. A loop in real time, which goes before every
ordinary thread, would wait for a lock that an ordinary thread holds while others have the
processor; it records through `process_disk.ProcessDisk`.
"""

import threading
from collections import deque
from collections.abc import Callable
from queue import SimpleQueue
from typing import Final, final

import pyarrow as pa

from legbench.recording.abstract_disk import MAX_WAITING, AbstractDisk, AbstractLog
from legbench.recording.files import Appender
from legbench.recording.logs import ThreadLog
from legbench.recording.rows import ONE_LEG_ROWS, Block, RowLayout
from legbench.recording.store import Store
from legbench.recording.stream import encode_schema

POOL: Final = 20
"""Blocks made beforehand: a disk that stalls for a second costs the loop no allocation."""


@final
class Disk(AbstractDisk):
    """Writes the blocks, events and logs of one run in a thread of its own.

    One thread hands over, one other writes, and each counter has one writer: no locks.
    """

    def __init__(
        self, samples: Appender, events: Appender, schema: pa.Schema, rows: RowLayout = ONE_LEG_ROWS
    ) -> None:
        """Write the opening of the stream and start the thread; raises OSError."""
        self._samples, self._events = samples, events
        self._rows = rows
        self._queue: SimpleQueue[Block | bytes | Callable[[], None] | None] = SimpleQueue()
        self._spare: deque[Block] = deque(Block(rows) for _ in range(POOL))
        self._handed = self._returned = 0
        self._ended = False
        self._store = Store(samples, events, schema)
        self.kept = self._store.kept
        samples.append(encode_schema(schema))
        self._thread = threading.Thread(target=self._work, name="recording", daemon=True)
        self._thread.start()

    @property
    def lagging(self) -> bool:
        """Whether more rows wait than a run may have in memory, or the thread is gone."""
        return self._handed - self._returned > MAX_WAITING or not self._thread.is_alive()

    def swap(self, block: Block) -> Block:
        """Take a block to write and give an empty one; never waits."""
        self._handed += 1
        self._queue.put(block)
        return self._spare.popleft() if self._spare else Block(self._rows)

    def event(self, line: bytes) -> None:
        """Take one whole line for the events; never waits."""
        self._queue.put(line)

    def log(self, file: Appender) -> AbstractLog:
        """Begin a log in a file, which is the log's from now on."""
        return ThreadLog(self._store.log(file), self._queue.put, self._thread)

    def finish(self) -> None:
        """Write what waits and the end mark, then end the thread."""
        self._queue.put(None)
        self._thread.join()
        if not self._ended and self.kept.error is None:
            self.kept.error = RuntimeError("the recording thread ended early")

    def close(self) -> None:
        """Close both files, which releases the lock on the run."""
        self._samples.close()
        self._events.close()

    def _work(self) -> None:
        while (item := self._queue.get()) is not None:
            if isinstance(item, bytes):
                self._store.event(item)
            elif isinstance(item, Block):
                self._store.write(item.columns())
                self._recycle(item)
            else:
                item()
        self._store.finish()
        self._ended = True

    def _recycle(self, block: Block) -> None:
        block.count = 0
        self._returned += 1
        if len(self._spare) < POOL:
            self._spare.append(block)
