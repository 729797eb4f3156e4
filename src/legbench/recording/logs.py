"""Logs as the control loop sees them: it puts lines and goes on."""

import os
from collections.abc import Callable
from typing import Final, final

from legbench.recording.abstract_disk import AbstractLog
from legbench.recording.log_file import LogFile
from legbench.recording.ring import RING_BYTES, Ring

LINES_AT_ONCE: Final = 500
"""Number of lines that a loop in virtual time writes at once."""
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
class LoopLog(AbstractLog):
    """A log of a loop in virtual time, which writes the lines itself, many at once."""

    def __init__(self, file: LogFile) -> None:
        """Begin a log in a file."""
        self._file = file
        self._lines: list[bytes] = []
        self._closed = False

    @property
    def error(self) -> str | None:
        """Why the log ended before its run, None if it did not; final after `close`."""
        return os.strerror(self._file.failed) if self._file.failed else None

    def write(self, line: bytes) -> None:
        """Take one whole line; never raises."""
        if self._closed:
            return
        self._lines.append(line)
        if len(self._lines) >= LINES_AT_ONCE:
            self._flush()

    def close(self) -> None:
        """Write every line that is left and close the file; may be called twice, never raises."""
        if not self._closed:
            self._closed = True
            self._flush()
            self._file.close()

    def _flush(self) -> None:
        self._file.append(b"".join(self._lines))
        self._lines.clear()
