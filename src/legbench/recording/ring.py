"""Lines in memory that two processes share: one puts, one takes, and neither waits for the other.

What has been put outlives the process that put it, since the memory is the other one's, too.
"""

import mmap
import os
from typing import Final, final

RING_BYTES: Final = 1 << 24
"""Lines that may wait for the disk [bytes]: a minute of a busy bus at 1 Mbit/s."""
_HEADER: Final = mmap.PAGESIZE
_END: Final = _HEADER + RING_BYTES
_PUT, _TAKEN, _FAILED, _CLOSED = range(4)
"""Places of the numbers in the header: bytes put and taken since the beginning, the errno of the
first failure, whether the file has been closed. Each has one writer."""


@final
class Ring:
    """Shared memory of one log; whole lines go in, and come out in their order.

    Put and taken only grow, and every number is eight bytes that a 64-bit processor stores at once.
    It may show a new number before the bytes it counts, so the taker takes what it has seen counted
    one look earlier, or all once a packet or the other's end says that it is there.

    Attributes:
        fd: descriptor of the memory, for the other process.
    """

    def __init__(self, fd: int) -> None:
        """Map the memory of `create`, all of it at once: no page is missing in a cycle."""
        self.fd = fd
        flags = mmap.MAP_SHARED | getattr(mmap, "MAP_POPULATE", 0)
        self._memory = mmap.mmap(fd, _END, flags=flags)
        self._numbers = memoryview(self._memory)[:_HEADER].cast("Q")
        self._put = self._numbers[_PUT]
        self._room = 0
        """Bytes that may be put until it has to be looked what was taken."""
        self._seen = 0

    @classmethod
    def create(cls) -> "Ring":
        """Make the memory of a new log; raises OSError, such as for want of memory."""
        fd = os.memfd_create("legbench-log", os.MFD_CLOEXEC)
        try:
            os.posix_fallocate(fd, 0, _END)
            return cls(fd)
        except BaseException:
            os.close(fd)
            raise

    def put(self, line: bytes) -> bool:
        """Put a line in, whole or not at all; whether there was room."""
        size = len(line)
        if size > self._room:
            self._room = self._numbers[_TAKEN] + RING_BYTES - self._put
            if size > self._room:
                return False
        self._room -= size
        at = _HEADER + self._put % RING_BYTES
        end = at + size
        if end <= _END:
            self._memory[at:end] = line
        else:
            before = _END - at
            self._memory[at:_END] = line[:before]
            self._memory[_HEADER : end - RING_BYTES] = line[before:]
        self._put += size
        self._numbers[_PUT] = self._put
        return True

    def look(self, *, everything: bool) -> bytes:
        """Return what waits: everything, or what was there when it was looked at before."""
        put = self._numbers[_PUT]
        upto = put if everything else self._seen
        self._seen = put
        taken = self._numbers[_TAKEN]
        if upto == taken:
            return b""
        begin, end = (_HEADER + number % RING_BYTES for number in (taken, upto))
        if begin < end:
            return self._memory[begin:end]
        return self._memory[begin:_END] + self._memory[_HEADER:end]

    def take(self, size: int) -> None:
        """Take away the first `size` bytes of what waits."""
        self._numbers[_TAKEN] += size

    @property
    def waiting(self) -> int:
        """Bytes that have been put and not taken."""
        return self._numbers[_PUT] - self._numbers[_TAKEN]

    @property
    def failed(self) -> int:
        """Errno of what keeps the lines from the disk, 0 if nothing does."""
        return self._numbers[_FAILED]

    def fail(self, number: int) -> None:
        """Tell the other process an errno, once."""
        self._numbers[_FAILED] = number

    @property
    def closed(self) -> bool:
        """Whether all lines have been written, or lost, and the file has been closed."""
        return bool(self._numbers[_CLOSED])

    def end(self) -> None:
        """Tell the other process that the file has been closed."""
        self._numbers[_CLOSED] = 1

    def close(self) -> None:
        """Give the memory up in this process."""
        self._numbers.release()
        self._memory.close()
        os.close(self.fd)
