"""Reading the files of a run folder that somebody else may have filled."""

import os
import stat
from pathlib import Path

KINDS = {
    stat.S_IFIFO: "a FIFO",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFDIR: "a folder",
}


class NotRegularError(OSError):
    """Something else lies where a regular file should, or one that is too large."""


def read_regular(path: Path, limit: int) -> bytes:
    """Return the bytes of the regular file that `path` is or links to.

    A FIFO, whose reader would wait for ever, and a device, which may never end, are not read.

    Raises:
        NotRegularError: it is no regular file, or has more than `limit` bytes.
        OSError: it is not there or cannot be read.
    """
    fd = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        status = os.fstat(fd)
        kind = stat.S_IFMT(status.st_mode)
        if kind != stat.S_IFREG:
            what = KINDS.get(kind, "no regular file")
            raise NotRegularError(f"it is {what}, not a regular file; move it away")
        if status.st_size > limit:
            raise NotRegularError(
                f"it has {status.st_size} bytes, the limit is {limit}; move it away"
            )
        with open(fd, "rb", closefd=False) as file:
            return file.read(limit)
    finally:
        os.close(fd)
