"""python-can's own `slcan`, with a `recv` that keeps its time and a `send` that never waits.

In python-can's version an acknowledgement ends a wait without a frame, a wait for nothing takes as
long as the serial port's own time-out, and every byte costs two system calls: too much between two
SYNCs. An adapter that takes nothing any more blocks a writer for ever: no stop would be sent, and
no ^C would end it.
"""

import os
import select
import time
from collections import deque
from typing import Any, final

import can
from can.interfaces.slcan import slcanBus

from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.slcan import OK, REFUSED, format_frame, parse_frame

CHUNK = 4096
"""Bytes that are read at once."""
CLOSING_S = 0.1
"""Longest that an adapter may take to be told to close its channel [s]."""


@final
class SlcanBus(slcanBus):
    """An adapter on a serial line."""

    def __init__(self, channel: str, **options: Any) -> None:
        """Open it; raises as python-can's does."""
        self._partial, self._unsent = b"", b""
        self._lines: deque[bytes] = deque()
        self._is_shutdown = True  # One that does not open has nothing to be shut down.
        super().__init__(channel, **options)
        self._is_shutdown = False
        self.serialPortOrig.write_timeout = CLOSING_S
        self.channel_info = f"slcan {channel}"
        self.channel = channel

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Hand a frame to the serial port; waits for nothing.

        Raises:
            can.CanOperationError: the port has no room, or the adapter is gone.
        """
        frame = Frame(msg.arbitration_id, bytes(msg.data), msg.is_remote_frame, msg.is_extended_id)
        line = self._unsent + format_frame(frame)
        try:
            count = os.write(self.fileno(), line)
        except BlockingIOError:
            count = 0
        except OSError as error:
            raise can.CanOperationError(f"{self.channel}: {error.strerror}") from error
        if count:  # A line that has been begun goes out before the next one.
            self._unsent = line[count:]
        if count < len(line):
            raise can.CanOperationError(f"{self.channel}: the adapter takes no frame any more")

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame; none only if none has come by then [s].

        Raises:
            can.CanOperationError: the adapter is gone.
        """
        line = self.fileno()
        until = None if timeout is None else time.monotonic() + timeout
        while True:
            while self._lines:
                message = self._message(self._lines.popleft())
                if message is not None:
                    return message
            left = None if until is None else max(0.0, until - time.monotonic())
            if not select.select([line], [], [], left)[0]:
                return None
            self._fill(line)

    def _fill(self, line: int) -> None:
        try:
            chunk = os.read(line, CHUNK)
        except OSError as error:
            raise can.CanOperationError(f"{self.channel}: {error.strerror}") from error
        if not chunk:
            raise can.CanOperationError(f"{self.channel}: the adapter is gone")
        *lines, self._partial = (self._partial + chunk).replace(REFUSED, OK).split(OK)
        self._lines.extend(lines)

    def _message(self, line: bytes) -> can.Message | None:
        """The frame of a line; none for acknowledgements, and for what has been garbled."""
        frame = parse_frame(line.decode("ascii", "replace"))
        if frame is None:
            return None
        message = can.Message(
            timestamp=time.time(),
            arbitration_id=frame.cob_id,
            is_extended_id=frame.extended,
            is_remote_frame=frame.remote,
            dlc=len(frame.data),
            data=frame.data,
            channel=self.channel,
        )
        return message if self._filters is None or self._matches_filters(message) else None
