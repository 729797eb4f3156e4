"""Files of a run: appending whole records, locking."""

import errno
import os
import time
from contextlib import suppress
from pathlib import Path
from typing import final

from legbench.errors import RecordingError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None


@final
class Appender:
    """A file descriptor opened with O_APPEND, to which whole records are appended.

    Attributes:
        fd: the descriptor, owned by this object.
        size: bytes of whole records written so far.
    """

    def __init__(self, fd: int) -> None:
        self.fd = fd
        self.size = 0

    def append(self, record: bytes | memoryview) -> None:
        """Hand `record` to the operating system, all of it or nothing.

        Raises:
            OSError: the file could not take it; the part that it took is cut off again.
        """
        done = 0
        try:
            while done < len(record):
                done += os.write(self.fd, record[done:])
        except OSError:
            with suppress(OSError):
                os.ftruncate(self.fd, self.size)
            raise
        self.size += done

    def sync(self) -> None:
        """Wait until the file has reached the disk itself; raises OSError."""
        os.fsync(self.fd)

    def close(self) -> None:
        """Close the descriptor, which also releases its lock."""
        os.close(self.fd)


def append_to(path: Path) -> Appender:
    """Create `path`, which must not exist, for appending; raises OSError."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | getattr(os, "O_BINARY", 0)
    return Appender(os.open(path, flags, 0o644))


def lock(fd: int, run: Path, *, patience: float = 0.0) -> None:
    """Hold an advisory lock on `fd` until it is closed, by whatever end of the process.

    A system or a file system without locks is taken as it is.

    Args:
        fd: of a file of the run.
        run: its folder.
        patience: how long to wait for a process that holds the lock [s].

    Raises:
        RecordingError: another process holds the lock, so it is writing this run.
    """
    deadline = time.monotonic() + patience
    try:
        while not _locked(fd):
            if time.monotonic() >= deadline:
                message = f"{run} is still being written by another process; end that run first"
                raise RecordingError(message)
            time.sleep(0.02)
    except RecordingError:
        raise
    except OSError as error:
        if error.errno not in (errno.ENOLCK, errno.ENOTSUP, errno.EBADF):
            raise


def _locked(fd: int) -> bool:
    """Take the lock if nobody holds it; raises OSError where there are no locks."""
    if fcntl is None:
        return True
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
