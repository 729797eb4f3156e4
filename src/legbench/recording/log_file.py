"""The file of a log where it is written: by the loop, or by the recording process."""

import errno
from typing import final

from legbench.recording.files import Appender
from legbench.recording.ring import Ring


@final
class LogFile:
    """A file that whole lines are appended to; its first failure ends it, and is kept.

    Attributes:
        failed: errno of that failure, 0 before it.
    """

    def __init__(self, file: Appender) -> None:
        self._file = file
        self.failed = 0
        self._open = True

    def append(self, lines: bytes) -> None:
        """Append lines, all of them or none, unless it has failed."""
        if self.failed == 0:
            try:
                self._file.append(lines)
            except OSError as error:
                self._fail(error)

    def sync(self) -> None:
        """Wait for the disk, if it is open still."""
        if self._open and self.failed == 0:
            try:
                self._file.sync()
            except OSError as error:
                # A pipe, or a device such as /dev/null, has no disk to wait for.
                if error.errno != errno.EINVAL:
                    self._fail(error)

    def close(self) -> None:
        """Wait for the disk and close the file; may be called twice."""
        if not self._open:
            return
        self.sync()
        self._open = False
        try:
            self._file.close()
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        self.failed = self.failed or error.errno or errno.EIO


@final
class RingDrain:
    """Brings the lines of a ring to their file, in the process that writes."""

    def __init__(self, ring: Ring, file: LogFile) -> None:
        self._ring, self._file = ring, file
        self._open = True

    def drain(self, *, everything: bool) -> None:
        """Write what waits; of what came since the last look only if it is known to be whole."""
        if not self._open:
            return
        lines = self._ring.look(everything=everything)
        if lines:
            self._file.append(lines)
            if self._file.failed:
                self._ring.fail(self._file.failed)
            self._ring.take(len(lines))

    def close(self) -> None:
        """Write everything, close the file, and say so; may be called twice."""
        if not self._open:
            return
        self.drain(everything=True)
        self._file.close()
        if self._file.failed:
            self._ring.fail(self._file.failed)
        self._open = False
        self._ring.end()
        self._ring.close()
