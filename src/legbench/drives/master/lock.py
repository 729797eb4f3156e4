"""One master a channel: an advisory lock that the end of the process releases."""

import fcntl
import os
import re
from pathlib import Path
from typing import final

from legbench.drives.errors import BusError

FOLDERS = (Path("/run/lock"), Path("/tmp"))
"""Of lock files; not the one for temporary files, which everybody may choose."""
BY_FILE = ("legbench_unix", "serial", "slcan")
"""Interfaces whose channels are files, also where a name has no slash in it."""


def _folder() -> Path:
    return next((path for path in FOLDERS if os.access(path, os.W_OK)), FOLDERS[-1])


@final
class ChannelLock:
    """Held from the first `acquire` to the last `release`, or to the end of the process, by
    whatever means.

    Args:
        name: of the channel, such as `socketcan-can0`; `of_channel` makes one.
        folder: of the lock files; the same for everybody on this machine by default.
    """

    def __init__(self, name: str, folder: Path | None = None) -> None:
        safe = re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("-") or "bus"
        self._name = name
        self._path = (folder or _folder()) / f"legbench-{safe}.lock"
        self._private = False
        self._fd: int | None = None
        self._depth = 0

    @classmethod
    def of_channel(
        cls, interface: str | None, channel: str | None, folder: Path | None = None
    ) -> "ChannelLock":
        """The lock of a channel before its interface is opened: opening may already disturb it.

        A path is followed to the device behind it, and the speed of a line left out (`PATH@BAUD`),
        so that no second name gets past the lock. An address, such as a URL, is no path.
        """
        where = channel or "default"
        path = where if os.path.exists(where) else where.partition("@")[0]
        if ("/" in path or interface in BY_FILE) and os.path.exists(path):
            where = os.path.realpath(path)
        return cls(f"{interface or 'default'} {where}", folder)

    @classmethod
    def private(cls, name: str) -> "ChannelLock":
        """A lock for a channel that no other process can reach; leaves no file."""
        lock = cls(name)
        lock._private = True
        return lock

    def acquire(self) -> None:
        """Take the lock, once more if it is held here already.

        Raises:
            BusError: another process has it, or the lock file cannot be written.
        """
        if self._fd is None:
            self._fd = self._take()
        self._depth += 1

    def _take(self) -> int:
        if self._private:
            return os.memfd_create("legbench")
        try:
            fd = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        except OSError as error:
            raise BusError(f"{self._path}: cannot lock {self._name}: {error.strerror}") from None
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            holder = os.read(fd, 32).decode("ascii", "replace").strip() or "unknown"
            os.close(fd)
            raise BusError(
                f"{self._name} already has a master, process {holder}; two masters on one bus move "
                "the leg twice, and an adapter on a serial line serves one program: end that one "
                "first"
            ) from None
        os.ftruncate(fd, 0)
        os.write(fd, f"{os.getpid()}\n".encode())
        return fd

    @property
    def held(self) -> bool:
        """Whether it is held here."""
        return self._fd is not None

    def release(self) -> None:
        """Undo one `acquire`; without one nothing happens."""
        self._depth = max(0, self._depth - 1)
        if self._depth == 0 and self._fd is not None:
            os.close(self._fd)
            self._fd = None
