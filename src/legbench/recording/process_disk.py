"""The process between a control loop in real time and the disk, as the loop sees it.

The disk must not make the loop wait. A thread would hold the interpreter's lock when the loop
wants it, and lose the processor while it does. Blocks go as packets over a socket whose queue is
the kernel's: handing one over is one system call, and what is in the queue is written even if the
loop's process is killed. Lines of a log, which come five a cycle, go through memory that both
share.
"""

import os
import socket
import struct
import subprocess
import sys
from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final, final

import pyarrow as pa

from legbench.recording.abstract_disk import MAX_WAITING, AbstractDisk, AbstractLog, Kept
from legbench.recording.files import Appender
from legbench.recording.logs import RingLog
from legbench.recording.ring import Ring
from legbench.recording.rows import BATCH_ROWS, RowBlock
from legbench.recording.stream import encode_schema

ROWS, EVENT, END = b"R", b"E", b"F"
"""First byte of a packet: rows of a block, (part of) a line of events, the end of the run."""
LOG, LOG_END = b"L", b"C"
"""First byte of a packet: a new log, with its memory and its file; the end of a log, its number."""
QUEUE: Final = 1 << 20
"""Asked for in the kernel [bytes]; it grants what `net.core.wmem_max` allows, about a second."""
REPORT: Final = struct.Struct("<qddii?")
"""What comes back: rows, first and last time, errnos of samples and events, whether at the end."""
UNKNOWN: Final = -1
"""Number in place of an errno, for what is no error of the operating system."""


@final
class ProcessDisk(AbstractDisk):
    """Sends the blocks and events of one run to `legbench.recording.process`.

    The process is started anew, not forked: it shares neither locked memory nor priority with the
    loop. It is in a session of its own, which ^C does not reach, and ends when the run has ended or
    this process has, by whatever end.
    """

    def __init__(self, samples: Appender, events: Appender, schema: pa.Schema) -> None:
        """Write the opening of the stream and start the process; raises OSError."""
        self._longest = longest_packet(schema)
        self.kept = Kept()
        self._samples, self._events = samples, events
        self._waiting: deque[bytes] = deque()
        self._logs = 0
        self._ended = False
        samples.append(encode_schema(schema))
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, QUEUE)
            self._socket.setblocking(False)
            self._process = _started(samples.fd, events.fd, theirs.fileno())

    @property
    def pid(self) -> int:
        """Process id of the one that writes."""
        return self._process.pid

    @property
    def lagging(self) -> bool:
        """Whether more waits in this process than a run may have in memory."""
        return len(self._waiting) > MAX_WAITING

    def take(self, block: RowBlock) -> None:
        """Send the rows of a block, which wait here where the kernel's queue is full."""
        packet = ROWS + block.columns().tobytes()
        block.count = 0
        self._send(packet)
        self._listen()

    def event(self, line: bytes) -> None:
        """Send one whole line for the events."""
        size = self._longest - 1
        for begin in range(0, len(line), size):
            self._send(EVENT + line[begin : begin + size])

    def log(self, file: Appender) -> AbstractLog:
        """Begin a log in a file, which is the process's from now on; raises OSError."""
        ring = Ring.create()
        try:
            self._socket.setblocking(True)
            while self._waiting:
                self._socket.send(self._waiting.popleft())
            socket.send_fds(self._socket, [LOG], [ring.fd, file.fd])
        except OSError:
            ring.close()
            raise
        finally:
            self._socket.setblocking(False)
            file.close()
        self._logs += 1
        return RingLog(ring, partial(self._end_log, self._logs - 1, ring))

    def _end_log(self, number: int, ring: Ring) -> None:
        """Have a log written and closed; returns when it is, or when nobody writes any more."""
        if self._socket.fileno() < 0:
            return
        try:
            self._settle(LOG_END + bytes([number]), lambda: ring.closed)
        finally:
            self._socket.setblocking(False)

    def finish(self) -> None:
        """Have everything written and the end mark, wait for the process to end."""
        self._settle(END, lambda: self._ended)
        status = self._process.wait()
        if not self._ended:
            self._lose(RuntimeError(f"the recording process ended early, with status {status}"))

    def close(self) -> None:
        """Close both files, which releases the lock on the run."""
        self._socket.close()
        self._samples.close()
        self._events.close()

    def _settle(self, packet: bytes, done: Callable[[], bool]) -> None:
        """Send what waits and a packet, wait until a report says that it is done."""
        self._socket.setblocking(True)
        self._waiting.append(packet)
        try:
            while self._waiting:
                self._socket.send(self._waiting.popleft())
            while not done():
                report = self._socket.recv(REPORT.size)
                if not report:
                    break
                self._take(report)
        except OSError as error:
            self._lose(error)
        self._waiting.clear()

    def _send(self, packet: bytes) -> None:
        """Send what waits, oldest first, as far as the kernel's queue takes it."""
        self._waiting.append(packet)
        try:
            while self._waiting:
                self._socket.send(self._waiting[0])
                self._waiting.popleft()
        except BlockingIOError:
            return
        except OSError as error:
            self._lose(error)

    def _listen(self) -> None:
        """Take what the process has told since."""
        try:
            while report := self._socket.recv(REPORT.size):
                self._take(report)
        except BlockingIOError:
            return
        except OSError as error:
            self._lose(error)
            return
        self._lose(BrokenPipeError())

    def _take(self, report: bytes) -> None:
        kept = self.kept
        kept.rows, kept.first, kept.last, samples, events, ended = REPORT.unpack(report)
        kept.error = kept.error or _error(samples)
        kept.events_error = kept.events_error or _error(events)
        self._ended = self._ended or ended

    def _lose(self, error: Exception) -> None:
        """Note that nobody writes any more: a socket without a peer, or a process without end."""
        if isinstance(error, ConnectionError):
            error = RuntimeError("the recording process ended early")
        self.kept.error = self.kept.error or error


def longest_packet(schema: pa.Schema) -> int:
    """Length of the longest packet: a block of rows; a longer line of events goes in parts."""
    return 1 + 8 * BATCH_ROWS * len(schema)


def _started(*descriptors: int) -> "subprocess.Popen[bytes]":
    """Start the process on samples, events and socket, blind to modules in the present folder."""
    package = str(Path(__file__).parents[2])
    paths = [package, *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))]
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "legbench.recording.process", *map(str, descriptors)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        pass_fds=descriptors,
        start_new_session=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
    )


def _error(number: int) -> Exception | None:
    if number == UNKNOWN:
        return RuntimeError("the rows could not be encoded")
    return OSError(number, os.strerror(number)) if number else None
