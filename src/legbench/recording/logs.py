"""Logs as the control loop sees them: it puts lines and goes on."""

import os
import threading
from collections.abc import Callable
from functools import partial
from typing import Final, final

from legbench.recording.abstract_disk import AbstractLog
from legbench.recording.log_file import LogFile
from legbench.recording.ring import RING_BYTES, Ring

THREAD_LINES: Final = 500
"""Number of lines that go to the recording thread at once."""
TOO_SLOW: Final = f"the disk is too slow, {RING_BYTES >> 20} MiB of lines wait for it"
ENDED_EARLY: Final = "the recording ended before the log"


@final
class RingLog(AbstractLog):
    """A log whose lines go through shared memory to the recording process, each at once."""

    def __init__(self, ring: Ring, end: Callable[[], None]) -> None:
        """Begin.

        Args:
            ring: its memory, which the process knows.
            end: has the process close the file; returns when it has, or is gone.
        """
        self._ring, self._end = ring, end
        self._late = self._ended = self._closed = False
        self._error: str | None = None

    @property
    def error(self) -> str | None:
        """Why the log ended before its run, None if it did not; final after `close`."""
        if self._error is None and not self._closed:
            if self._ring.failed:
                self._error = os.strerror(self._ring.failed)
            elif self._late:
                self._error = TOO_SLOW
        return self._error

    def write(self, line: bytes) -> None:
        """Take one whole line; never waits, never raises."""
        if self._ended or self._ring.put(line):
            return
        # A log with a hole would be taken for what was on the bus: it ends at the first loss.
        self._late = self._ended = True

    def close(self) -> None:
        """Wait until every line is written or lost; may be called twice, never raises."""
        if self._closed:
            return
        self._end()
        if self.error is None and (self._ring.waiting or not self._ring.closed):
            self._error = ENDED_EARLY
        self._closed = self._ended = True
        self._ring.close()


@final
class ThreadLog(AbstractLog):
    """A log whose lines go to the recording thread."""

    def __init__(
        self, file: LogFile, hand: Callable[[Callable[[], None]], None], worker: threading.Thread
    ) -> None:
        """Begin.

        Args:
            file: the file.
            hand: has a call made in the thread, after those before it.
            worker: the thread.
        """
        self._file, self._hand, self._worker = file, hand, worker
        self._lines: list[bytes] = []
        self._handed = self._written = 0
        self._late = self._lost = self._closed = False

    @property
    def error(self) -> str | None:
        """Why the log ended before its run, None if it did not; final after `close`."""
        if self._file.failed:
            return os.strerror(self._file.failed)
        if self._late:
            return TOO_SLOW
        return ENDED_EARLY if self._lost else None

    def write(self, line: bytes) -> None:
        """Take one whole line; never waits, never raises."""
        if self._closed:
            return
        self._lines.append(line)
        if len(self._lines) >= THREAD_LINES:
            self._hand_over()

    def close(self) -> None:
        """Wait until every line is written or lost; may be called twice, never raises."""
        if self._closed:
            return
        self._closed = True
        self._hand_over()
        done = threading.Event()
        self._hand(partial(self._end, done))
        while not done.wait(0.1) and self._worker.is_alive():
            continue
        if not done.is_set():
            self._lost = self._handed > self._written
            self._end(done)

    def _hand_over(self) -> None:
        lines = b"".join(self._lines)
        self._lines.clear()
        self._late = self._late or self._handed + len(lines) - self._written > RING_BYTES
        if not self._late:
            self._handed += len(lines)
            self._hand(partial(self._append, lines))

    def _append(self, lines: bytes) -> None:
        self._file.append(lines)
        self._written += len(lines)

    def _end(self, done: threading.Event) -> None:
        self._file.close()
        done.set()
