"""The thread between the control loop and the disk: the loop only ever puts and goes on."""

import threading
import time
from collections import deque
from queue import SimpleQueue
from typing import Final, final

import numpy as np
import pyarrow as pa

from legbench.recording.files import Appender
from legbench.recording.rows import BATCH_ROWS, ONE_LEG_ROWS, Block, RowLayout
from legbench.recording.stream import END_MARK, BatchEncoder, encode_schema

POOL: Final = 20
"""Blocks made beforehand: a disk that stalls for a second costs the loop no allocation."""

MAX_WAITING: Final = 60_000 // BATCH_ROWS
"""Blocks that may wait for the disk: 60 s at 1 kHz, 14 MB."""

SYNC_EVERY: Final = 1.0
"""How much of a run a power cut may cost [s]."""


@final
class Disk:
    """Writes the blocks and events of one run in a thread of its own.

    One thread hands over, one other writes, and each counter has one writer: no locks.

    Attributes:
        rows: rows that the operating system has.
        first: time of the first of them [s].
        last: time of the last of them [s].
        error: the first failure, after which no more rows are written.
    """

    def __init__(
        self, samples: Appender, events: Appender, schema: pa.Schema, rows: RowLayout = ONE_LEG_ROWS
    ) -> None:
        """Write the opening of the stream and start the thread; raises OSError."""
        self.rows = 0
        self.first = self.last = 0.0
        self.error: Exception | None = None
        self._samples, self._events, self._schema = samples, events, schema
        self._rows = rows
        self._queue: SimpleQueue[Block | bytes | None] = SimpleQueue()
        self._spare: deque[Block] = deque(Block(rows) for _ in range(POOL))
        self._handed = self._returned = 0
        self._ended = False
        self._synced = time.monotonic()
        # The first call is slow: not in the loop.
        nothing = np.zeros((len(schema), BATCH_ROWS))
        self._encoder = BatchEncoder(nothing, schema)
        self._encoder.encode(nothing)
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

    def finish(self) -> None:
        """Write what waits and the end mark, then end the thread; `error` is final then."""
        self._queue.put(None)
        self._thread.join()
        if not self._ended and self.error is None:
            self.error = RuntimeError("the recording thread ended early")

    def close(self) -> None:
        """Close both files, which releases the lock on the run."""
        self._samples.close()
        self._events.close()

    def _work(self) -> None:
        while (item := self._queue.get()) is not None:
            try:
                if isinstance(item, bytes):
                    self._events.append(item)
                elif self.error is None:
                    self._write(item)
                self._sync(every=SYNC_EVERY)
            except (OSError, pa.ArrowException) as error:
                self.error = self.error or error
            if isinstance(item, Block):
                self._recycle(item)
        try:
            if self.error is None:
                self._samples.append(END_MARK)
            self._sync(every=0.0)
        except OSError as error:
            self.error = self.error or error
        self._ended = True

    def _write(self, block: Block) -> None:
        columns = block.columns()
        if not self._encoder.fits(columns):
            self._encoder = BatchEncoder(columns, self._schema)
        self._samples.append(self._encoder.encode(columns))
        times = block.values[: block.count, self._rows.time]
        if self.rows == 0:
            self.first = float(times[0])
        self.last = float(times[-1])
        self.rows += block.count

    def _recycle(self, block: Block) -> None:
        block.count = 0
        self._returned += 1
        if len(self._spare) < POOL:
            self._spare.append(block)

    def _sync(self, *, every: float) -> None:
        now = time.monotonic()
        if now - self._synced >= every:
            self._synced = now
            self._samples.sync()
            self._events.sync()
