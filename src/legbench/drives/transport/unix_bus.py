"""A CAN bus between processes of one machine, over an AF_UNIX socket of whole packets.

    can.Bus(interface="legbench_unix", channel="PATH")

Behind the path sits `legbench drives emulate`. One packet is one frame; nothing is buffered in
this process, so the kernel's queue is the controller's: a server that has no room for a frame
leaves it there, and once it is full the sender gets an error.
"""

import select
import socket
import struct
import time
from typing import Any, final

import can
from can.typechecking import CanFilters

from legbench.drives.transport.checked_bus import CheckedBus
from legbench.drives.transport.messages import frame_of, message_of, refuse_fd
from legbench.drives.transport.system import require_linux
from legbench.drives.transport.unix_packet import (
    NOTE,
    PACKET,
    Controller,
    Opening,
    controller_of,
    is_own,
    pack_frame,
    pack_opening,
    unpack_frame,
)

SO_TIMESTAMPNS, SO_PEEK_OFF = 35, 42
"""Options of sockets that the `socket` module does not name (asm-generic/socket.h)."""
STAMP = struct.Struct("@qq")
"""`struct timespec` of SO_TIMESTAMPNS: seconds and nanoseconds since 1970."""
STAMP_SPACE = socket.CMSG_SPACE(STAMP.size)
SPACE = PACKET.size + 1
"""Space for a packet, and for a byte by which one that is too long is known [bytes]."""
STATES = {
    Controller.ACTIVE: can.BusState.ACTIVE,
    Controller.PASSIVE: can.BusState.PASSIVE,
    Controller.BUS_OFF: can.BusState.ERROR,
}


@final
class UnixBus(CheckedBus):
    """A port to a bus that another process serves."""

    def __init__(
        self,
        channel: str,
        can_filters: CanFilters | None = None,
        *,
        bitrate: int | None = None,
        receive_own_messages: bool = False,
        fd: bool = False,
        single_handle: bool = False,
    ) -> None:
        """Connect.

        Args:
            channel: path of the socket.
            can_filters: frames to receive; by default all.
            bitrate: bitrate of this controller; by default that of the wire behind [bit/s].
            receive_own_messages: receive the frames that are sent here, when they were on the wire.
            fd: flexible data rate, which these buses do not have.
            single_handle: without effect; python-can's programs give it to every interface.

        Raises:
            can.CanInitializationError: nobody serves a bus there, or `fd` is set.
        """
        refuse_fd(fd)
        self._asked = Opening(bitrate, receive_own_messages)
        self.channel_info = f"unix bus {channel}"
        self.channel = channel
        self._connect()
        super().__init__(channel=channel, can_filters=can_filters)

    def _connect(self) -> None:
        require_linux("a bus between processes")
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._readable = (self._socket.fileno(),)
        self._controller = Controller.ACTIVE
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
            # Every look at what waits goes on where the last one has ended, see `state`.
            self._socket.setsockopt(socket.SOL_SOCKET, SO_PEEK_OFF, 0)
            self._socket.connect(self.channel)
            if self._asked != Opening():
                self._socket.send(pack_opening(self._asked))
        except OSError as error:
            self._socket.close()
            raise can.CanInitializationError(
                f"{error.strerror}; `legbench drives emulate --channel {self.channel}` serves one"
            ) from error

    @property
    def state(self) -> can.BusState:
        """State of the controller as of the last frame that has come, read or not.

        Setting `ACTIVE` restarts the controller: what it has not sent or not read yet is lost.
        """
        try:
            while packet := self._socket.recv(PACKET.size, socket.MSG_PEEK | socket.MSG_DONTWAIT):
                self._controller = controller_of(packet)
        except OSError:
            # Nothing more has come; that the server is gone is told by `recv`.
            pass
        return STATES[self._controller]

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        if new_state is not can.BusState.ACTIVE:
            raise NotImplementedError(f"{new_state.name} cannot be set, only ACTIVE")
        self._check_open()
        self._socket.close()
        self._connect()

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Hand a frame to the controller; waits for room only if a time-out is given [s].

        Raises:
            can.CanOperationError: the queue is full, the controller is bus-off, the other process
                is gone, or this is no frame of classic CAN.
        """
        self._check_open()
        packet = pack_frame(frame_of(msg))
        if self._controller is Controller.BUS_OFF:
            raise self._bus_off()
        try:
            self._socket.send(packet, socket.MSG_DONTWAIT)
        except BlockingIOError:
            self._send_late(packet, timeout or 0.0)
        except OSError as error:
            raise can.CanOperationError(f"{self.channel}: {error.strerror}") from error

    def _send_late(self, packet: bytes, timeout: float) -> None:
        """Send once there is room."""
        try:
            if select.select([], [self._socket], [], timeout)[1]:
                self._socket.send(packet, socket.MSG_DONTWAIT)
                return
        except OSError as error:
            raise can.CanOperationError(f"{self.channel}: {error.strerror}") from error
        if self.state is can.BusState.ERROR:
            raise self._bus_off()
        raise can.CanOperationError(f"{self.channel}: the transmit queue is full")

    def _bus_off(self) -> can.CanOperationError:
        return can.CanOperationError(
            f"{self.channel}: the controller is bus-off; find the cause, then open the bus again"
        )

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        self._check_open()
        try:
            if not select.select(self._readable, (), (), timeout)[0]:
                return None, False
            packet, stamps, _, _ = self._socket.recvmsg(SPACE, STAMP_SPACE, socket.MSG_DONTWAIT)
        except BlockingIOError:
            # Another thread was faster.
            return None, False
        except OSError as error:
            raise can.CanOperationError(f"{self.channel}: {error.strerror}") from error
        if not packet:
            raise can.CanOperationError(f"{self.channel}: the bus is gone")
        frame = unpack_frame(packet)
        if frame is None:
            return None, False
        if packet[NOTE] and controller_of(packet) is Controller.BUS_OFF:
            self._controller = Controller.BUS_OFF
        message = message_of(frame, _stamp_of(stamps), self.channel, own=is_own(packet))
        return message, False

    def fileno(self) -> int:
        """File descriptor of the socket, for `select`."""
        return self._socket.fileno()

    def shutdown(self) -> None:
        """End what is sent periodically and disconnect from the serving process."""
        super().shutdown()
        self._socket.close()

    @staticmethod
    def _detect_available_configs() -> list[Any]:
        return []


def _stamp_of(ancillary: list[tuple[int, int, bytes]]) -> float:
    """Time at which a packet came, as the kernel says [s since 1970]."""
    if not ancillary:
        return time.time()
    # Nothing else has been asked for.
    seconds, nanoseconds = STAMP.unpack(ancillary[0][2])
    return seconds + 1e-9 * nanoseconds
