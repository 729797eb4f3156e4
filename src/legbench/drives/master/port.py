"""Frames over any python-can bus; whatever a driver raises becomes one `BusError`."""

import socket
import time
from collections.abc import Callable
from typing import final

import can

from legbench.drives.errors import BusError, DriveError
from legbench.drives.master.read_only import MaySend
from legbench.drives.protocol.frame import Frame
from legbench.drives.transport.timebase import Timebase
from legbench.errors import LegbenchError

Listener = Callable[[can.Message], None]
"""Sees every frame that is sent or received, in order; one that is sent is used again."""
OLDEST_S = 10.0
"""Largest plausible age of a frame; an older stamp is of another clock [s]."""
HINT = "look at `ip -details link show`, at the txqueuelen and at the wiring"


@final
class Port:
    """A bus with its time.

    Attributes:
        timebase: time base of the bus.
        bus: the interface, for callers that need the driver itself.
        listener: sees every frame, if there is one.
        listener_error: error that the listener raised, in one line; it is not called any more.
        error_frames: number of error frames received so far.
        may_send: filter of the frames that may be sent; none if all may.
    """

    def __init__(
        self, bus: can.BusABC, timebase: Timebase, listener: Listener | None = None
    ) -> None:
        self.bus, self.timebase = bus, timebase
        self.listener = listener
        self.listener_error: str | None = None
        self.error_frames = 0
        self.may_send: MaySend | None = None
        self._echoes = _echoes(bus)

    def foreign(self, message: can.Message) -> bool:
        """Whether a received frame is from another sender.

        SocketCAN marks those of every process of this machine as sent, not only our own.
        """
        return message.is_rx or not self._echoes

    def send(self, cob_id: int, data: bytes = b"") -> None:
        """Send a frame.

        Raises:
            BusError: the driver did not take it.
            DriveError: it may not be sent, in read-only.
        """
        self.put(self.message(cob_id, data))

    @staticmethod
    def message(cob_id: int, data: bytes = b"") -> can.Message:
        """Make a message that `put` sends."""
        return can.Message(arbitration_id=cob_id, data=data, is_extended_id=False, is_rx=False)

    def put(self, message: can.Message) -> None:
        """Send a message that is kept for many cycles; raises as `send` does."""
        if self.may_send is not None and not self.may_send(message.arbitration_id, message.data):
            text = f"{message.arbitration_id:03X}#{message.data.hex().upper()}"
            raise DriveError(f"read-only: {text} is not sent")
        try:
            self.bus.send(message)
        except LegbenchError:
            raise
        except Exception as error:  # Drivers raise what they like, a ValueError for a bad line.
            raise BusError(f"{self.bus.channel_info}: cannot send: {error}; {HINT}") from error
        if self.listener is not None:
            message.timestamp = 1e-9 * self.timebase.now_ns()
            self._show_to_listener(message)

    def send_frame(self, frame: Frame) -> None:
        """Send a frame of the codec; raises BusError."""
        self.send(frame.cob_id, frame.data)

    def receive(self, until_ns: int) -> can.Message | None:
        """Receive the next frame, none if none comes by `until_ns`; skips remote and extended ones.

        Raises:
            BusError: the driver has failed.
        """
        while True:
            left_ns = until_ns - self.timebase.now_ns()
            message = self._receive(1e-9 * left_ns if left_ns > 0 else 0.0)
            if message is None or not (message.is_extended_id or message.is_remote_frame):
                return message
            if message.is_error_frame:
                return message
            if left_ns <= 0:
                return None

    def take(self) -> can.Message | None:
        """Take the next frame that has come already, none if none has; raises BusError."""
        while True:
            message = self._receive(0.0)
            if message is None or not (message.is_extended_id or message.is_remote_frame):
                return message
            if message.is_error_frame:
                return message

    def _receive(self, timeout: float) -> can.Message | None:
        try:
            message = self.bus.recv(timeout)
        except LegbenchError:
            raise
        except Exception as error:
            raise BusError(f"{self.bus.channel_info}: cannot receive: {error}; {HINT}") from error
        if message is not None:
            if message.is_error_frame:
                self.error_frames += 1
            if self.listener is not None:
                message.timestamp = self._came_at(message.timestamp)
                self._show_to_listener(message)
        return message

    def _came_at(self, stamp: float) -> float:
        """Time of reception on the bus's time base, from a driver's time stamp [s].

        SocketCAN and slcan stamp by the system's clock. Other adapters have a clock of their own,
        which says nothing here: their frames are stamped with the present time.
        """
        now = 1e-9 * self.timebase.now_ns()
        if 0.0 <= now - stamp < OLDEST_S:
            return stamp
        age = time.time() - stamp
        return now - age if 0.0 <= age < OLDEST_S else now

    def _show_to_listener(self, message: can.Message) -> None:
        """Show a frame to the listener; one that fails is not called again, and ends nothing."""
        listener = self.listener
        if listener is None:
            return
        try:
            listener(message)
        except Exception as error:  # Whatever a listener does wrong, the cycle goes on.
            self.listener = None
            self.listener_error = f"{type(error).__name__}: {error}"

    @property
    def off_bus(self) -> bool:
        """Whether the controller is bus-off, as far as the driver tells."""
        try:
            return self.bus.state is can.BusState.ERROR
        except Exception:
            return False


def _echoes(bus: can.BusABC) -> bool:
    """Whether a bus may return the frames sent on it; a SocketCAN socket says so."""
    raw = getattr(bus, "socket", None)
    if not isinstance(raw, socket.socket) or raw.family != getattr(socket, "AF_CAN", None):
        return True
    return bool(raw.getsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_RECV_OWN_MSGS))
