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

from legbench.drives.protocol.slcan import OK, REFUSED, format_frame, parse_frame
from legbench.drives.transport.checked_bus import CheckedBus
from legbench.drives.transport.messages import frame_of, message_of, refuse_fd

CHUNK = 4096
"""Largest number of bytes read at once."""
OPTIONS = (
    *("bitrate", "can_filters", "fd", "listen_only", "rtscts", "single_handle"),
    *("sleep_after_open", "timeout", "timing", "tty_baudrate"),
)
"""Options of python-can's `slcanBus`, and those that its programs give to every interface."""
CLOSING_S = 0.1
"""Longest that an adapter may take to be told to close its channel [s]."""


@final
class SlcanBus(CheckedBus, slcanBus):
    """Bus behind a CAN adapter on a serial line."""

    def __init__(self, channel: str, **options: Any) -> None:
        """Open the adapter; takes what python-can's `slcanBus` takes, and raises what it raises.

        Raises:
            TypeError: an option that it does not have.
            can.CanInitializationError: flexible data rate is asked for.
        """
        self._is_shutdown = True  # A bus that fails to open has nothing to shut down.
        unknown = sorted(options.keys() - OPTIONS)
        if unknown:
            raise TypeError(f"slcan takes no {', '.join(unknown)}; it takes {', '.join(OPTIONS)}")
        refuse_fd(bool(options.pop("fd", False)))
        self._partial, self._unsent = b"", b""
        self._lines: deque[tuple[bytes, float]] = deque()
        super().__init__(channel, **options)
        self._is_shutdown = False
        self.serialPortOrig.write_timeout = CLOSING_S
        self.channel_info = f"slcan {channel}"
        self.channel = channel

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Hand a frame to the serial port; waits for nothing.

        Raises:
            can.CanOperationError: the port has no room, the adapter is gone, or this is no frame of
                classic CAN.
        """
        self._check_open()
        line = self._unsent + format_frame(frame_of(msg))
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
        self._check_open()
        line = self.fileno()
        until = None if timeout is None else time.monotonic() + timeout
        while True:
            while self._lines:
                message = self._message(*self._lines.popleft())
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
        # The port does not say when its bytes came; this is the next best.
        came = time.time()
        self._lines.extend((line, came) for line in lines)

    def _message(self, line: bytes, came: float) -> can.Message | None:
        """The frame of a line that came at a time [s]; none for acknowledgements and garbage."""
        frame = parse_frame(line.decode("ascii", "replace"))
        if frame is None:
            return None
        message = message_of(frame, came, self.channel)
        return message if self._filters is None or self._matches_filters(message) else None
