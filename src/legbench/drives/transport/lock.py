"""Lock that gives a channel one master per computer; the end of the process releases it.

The lock is a name among the kernel's abstract AF_UNIX sockets (unix(7)), not a file: nothing to
truncate, no link or FIFO to be led to, no owner or umask that shuts other users out, nothing left
behind by a process that was killed. Whoever is refused learns the holder's process id from the
kernel. Such names belong to a network namespace, as CAN interfaces do.
"""

import errno
import hashlib
import os
import socket
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import final

from legbench.drives.errors import BusError
from legbench.drives.transport.system import require_linux

BY_FILE = ("legbench_unix", "serial", "slcan")
"""Interfaces whose channels are files, also where a name has no slash in it."""
LONGEST_ADDRESS = 107
"""Longest abstract name that fits `sun_path` after its leading zero, unix(7) [bytes]."""
ASKED_AT_MOST = 4096
"""Refused processes whose question for the holder can be answered (`net.core.somaxconn`)."""
CREDENTIALS = struct.Struct("3i")
"""`struct ucred` of SO_PEERCRED: process, user, group."""


@final
class ChannelLock:
    """Lock of a channel, held from the first `acquire` to the last `release` or the process's end.

    Args:
        name: name of the channel, such as `socketcan can0`; `of_channel` makes one.
        scope: locks of different scopes do not meet; everybody on this computer shares the one
            that is used by default.

    Attributes:
        address: socket address that is bound; two locks of one address exclude each other.
    """

    def __init__(self, name: str, scope: Path | None = None) -> None:
        self._name = name
        self.address = _address(name, scope)
        self._private = False
        self._fd: int | None = None
        self._depth = 0
        self._others: tuple[ChannelLock, ...] = ()

    @classmethod
    def of_channel(
        cls, interface: str | None, channel: str | None, scope: Path | None = None
    ) -> "ChannelLock":
        """The lock of a channel before its interface is opened: opening may already disturb it.

        A path is followed to the device behind it, and the speed of a line left out (`PATH@BAUD`),
        so that no second name gets past the lock. An address, such as a URL, is no path.
        """
        where = channel or "default"
        path = where if os.path.exists(where) else where.partition("@")[0]
        if ("/" in path or interface in BY_FILE) and os.path.exists(path):
            where = os.path.realpath(path)
        return cls(f"{interface or 'default'} {where}", scope)

    @classmethod
    def joined(cls, locks: "Sequence[ChannelLock]") -> "ChannelLock":
        """Join locks of several channels into one, which takes all of them or none."""
        first = locks[0]
        first._others = tuple(locks[1:])
        return first

    @classmethod
    def private(cls, name: str) -> "ChannelLock":
        """A lock for a channel that no other process can reach; it binds no name."""
        lock = cls(name)
        lock._private = True
        return lock

    def acquire(self) -> None:
        """Take the lock, once more if it is held here already.

        Raises:
            BusError: another process has it, or this computer gives out no such names.
        """
        if self._fd is None:
            self._fd = self._take()
        self._depth += 1
        for place, other in enumerate(self._others):
            try:
                other.acquire()
            except BaseException:
                for taken in self._others[:place]:
                    taken.release()
                self._give_back()
                raise

    def _take(self) -> int:
        if self._private:
            return os.open(os.devnull, os.O_RDONLY)
        require_linux("locking a channel against a second master")
        taken = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            taken.bind(self.address)
            taken.listen(ASKED_AT_MOST)
        except OSError as error:
            taken.close()
            if error.errno != errno.EADDRINUSE:
                raise BusError(f"cannot lock {self._name}: {error.strerror or error}") from None
            raise BusError(
                f"{self._name} already has a master, process {self._holder()}; two masters on one "
                "bus move the leg twice, and an adapter on a serial line serves one program: end "
                "that one first"
            ) from None
        # The descriptor is detached, so that a lock object that is dropped stays held.
        return taken.detach()

    def _holder(self) -> str:
        """Process id of whoever holds the lock, as the kernel says."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asking:
            asking.setblocking(False)
            try:
                asking.connect(self.address)
            except OSError:
                # The holder does not listen yet, is ending, or has been asked too often.
                return "unknown"
            told = asking.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, CREDENTIALS.size)
        # 0: a process of another pid namespace, such as one outside this container.
        return str(CREDENTIALS.unpack(told)[0] or "unknown")

    @property
    def held(self) -> bool:
        """Whether this object holds the lock."""
        return self._fd is not None

    def release(self) -> None:
        """Undo one `acquire`; without one nothing happens."""
        for other in self._others:
            other.release()
        self._give_back()

    def _give_back(self) -> None:
        self._depth = max(0, self._depth - 1)
        if self._depth == 0 and self._fd is not None:
            os.close(self._fd)
            self._fd = None


def _address(name: str, scope: Path | None) -> bytes:
    """Abstract address of a lock; a name that is too long is told apart by its digest."""
    text = os.fsencode(f"legbench {name}" if scope is None else f"legbench {name} of {scope}")
    if len(text) > LONGEST_ADDRESS:
        digest = hashlib.sha256(text).hexdigest().encode("ascii")
        text = text[: LONGEST_ADDRESS - len(digest)] + digest
    return b"\0" + text
