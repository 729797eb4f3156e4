"""Files that are whole or not there: appending whole records, replacing, locking."""

import errno
import fcntl
import os
import time
from contextlib import suppress
from pathlib import Path
from typing import final

from legbench.errors import RecordingError


def reason(error: Exception) -> str:
    """Say why `error` happened, with the name of its errno if it has one."""
    if isinstance(error, OSError) and error.errno is not None:
        return f"{os.strerror(error.errno)} [{errno.errorcode.get(error.errno, error.errno)}]"
    return str(error)


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
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND
    return Appender(os.open(path, flags, 0o644))


def put_in_place(draft: Path, path: Path) -> None:
    """Make the finished file `draft` be `path`, at once and surviving a power cut.

    Raises:
        OSError: the draft could not be synced or renamed; `path` is what it was before.
    """
    for target in (draft, draft.parent):
        fd = os.open(target, os.O_RDONLY)
        try:
            os.fsync(fd)
        finally:
            os.close(fd)
        if target == draft:
            draft.replace(path)


def write_whole(path: Path, content: bytes) -> None:
    """Write `content` as the file `path`, or leave `path` untouched; raises OSError."""
    draft = path.with_name(f".{path.name}.draft")
    try:
        # Made anew: whatever lies there, such as a link, is not written through.
        draft.unlink(missing_ok=True)
        with draft.open("xb") as file:
            file.write(content)
        put_in_place(draft, path)
    except BaseException:
        with suppress(OSError):
            draft.unlink()
        raise


def lock(fd: int, run: Path, *, patience: float = 0.0) -> None:
    """Hold an advisory lock on `fd` until it is closed, by whatever end of the process.

    A file system without locks is taken as it is.

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
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
