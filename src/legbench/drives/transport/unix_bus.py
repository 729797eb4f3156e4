"""A CAN bus between processes of one machine, over an AF_UNIX socket of whole packets.

    can.Bus(interface="legbench_unix", channel="PATH")

Behind the path sits `legbench drives emulate`. One packet is one frame; nothing is buffered in
this process, so the kernel's queue is the controller's.
"""

import select
import socket
import struct
import time
from typing import Any, final

import can
from can.typechecking import CanFilters

from legbench.drives.protocol.frame import Frame

PACKET = struct.Struct("<IB8s")
"""Identifier with flags, length, data."""
EXTENDED, REMOTE, ERROR, ID_MASK = 1 << 31, 1 << 30, 1 << 29, (1 << 29) - 1
BITRATE = struct.Struct("<I")


def pack_frame(frame: Frame) -> bytes:
    """A frame as one packet."""
    flags = EXTENDED * frame.extended | REMOTE * frame.remote | ERROR * frame.error
    return PACKET.pack(frame.cob_id | flags, len(frame.data), frame.data)


def opening(bitrate: int) -> bytes:
    """The packet with which a master says at which bitrate its controller runs [bit/s].

    No master sends error frames, so it is one.
    """
    return pack_frame(Frame(0, BITRATE.pack(bitrate), error=True))


def opened_at(frame: Frame) -> int | None:
    """The bitrate that an opening packet says; none if it is a frame like any other."""
    plain = not frame.error or len(frame.data) != BITRATE.size
    return None if plain else BITRATE.unpack(frame.data)[0]


def unpack_frame(packet: bytes) -> Frame | None:
    """A packet as a frame; none if it is none."""
    if len(packet) != PACKET.size:
        return None
    word, length, data = PACKET.unpack(packet)
    if length > len(data):
        return None
    return Frame(
        word & ID_MASK,
        data[:length],
        bool(word & REMOTE),
        bool(word & EXTENDED),
        bool(word & ERROR),
    )


@final
class UnixBus(can.BusABC):
    """A port to a bus that another process serves."""

    def __init__(
        self,
        channel: str,
        can_filters: CanFilters | None = None,
        *,
        bitrate: int | None = None,
        **_others: object,
    ) -> None:
        """Connect, by default at the bitrate of the wire behind [bit/s].

        Raises:
            can.CanInitializationError: nobody serves a bus there.
        """
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            self._socket.connect(channel)
            if bitrate is not None:
                self._socket.send(opening(bitrate))
        except OSError as error:
            self._socket.close()
            self._is_shutdown = True
            raise can.CanInitializationError(
                f"{error.strerror}; `legbench drives emulate --channel {channel}` serves one"
            ) from error
        self.channel_info = f"unix bus {channel}"
        self.channel = channel
        super().__init__(channel=channel, can_filters=can_filters)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send one frame.

        Raises:
            can.CanOperationError: the other process is gone, or does not read any more.
        """
        frame = Frame(msg.arbitration_id, bytes(msg.data), msg.is_remote_frame, msg.is_extended_id)
        try:
            self._socket.send(pack_frame(frame), socket.MSG_DONTWAIT)
        except OSError as error:
            raise can.CanOperationError(f"{self.channel}: {error.strerror}") from error

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        ready, _, _ = select.select([self._socket], [], [], timeout)
        if not ready:
            return None, False
        try:
            packet = self._socket.recv(PACKET.size + 1)
        except OSError as error:
            raise can.CanOperationError(f"{self.channel}: {error.strerror}") from error
        if not packet:
            raise can.CanOperationError(f"{self.channel}: the bus is gone")
        frame = unpack_frame(packet)
        if frame is None:
            return None, False
        message = can.Message(
            timestamp=1e-9 * time.monotonic_ns(),
            arbitration_id=frame.cob_id,
            is_extended_id=frame.extended,
            is_remote_frame=frame.remote,
            is_error_frame=frame.error,
            data=frame.data,
            channel=self.channel,
        )
        return message, False

    def fileno(self) -> int:
        """File descriptor of the socket, for `select`."""
        return self._socket.fileno()

    def shutdown(self) -> None:
        """Disconnect."""
        if not self._is_shutdown:
            self._socket.close()
        super().shutdown()

    @staticmethod
    def _detect_available_configs() -> list[Any]:
        return []
