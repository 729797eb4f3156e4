"""Packets of a CAN bus over an AF_UNIX socket: one frame each, and the state of the controller."""

import struct
from enum import IntEnum
from typing import NamedTuple

from legbench.drives.protocol.frame import Frame

PACKET = struct.Struct("<IBB8s")
"""Layout of a packet: identifier with flags, length, note of the server, data."""
NOTE = 5
"""Place of the note: bit 0 marks a frame of one's own, above it is the controller's state."""
EXTENDED, REMOTE, ERROR, ID_MASK = 1 << 31, 1 << 30, 1 << 29, (1 << 29) - 1
BASE_MASK = (1 << 11) - 1
"""Identifiers of frames that are not extended."""
OPENING = struct.Struct("<IB")


class Controller(IntEnum):
    """State of a master's controller (ISO 11898-1, fault confinement)."""

    ACTIVE = 0
    PASSIVE = 1
    BUS_OFF = 2


class Opening(NamedTuple):
    """What a master asks of its controller."""

    bitrate: int | None = None
    """Bitrate of the controller; none for that of the wire behind [bit/s]."""
    own: bool = False
    """Whether the master wants to receive the frames that it sends."""


def pack_frame(
    frame: Frame, controller: Controller = Controller.ACTIVE, *, own: bool = False
) -> bytes:
    """Pack a frame for a master into one packet.

    Args:
        frame: the frame.
        controller: state of the controller of that master.
        own: whether that master has sent the frame itself.
    """
    cob_id, data, remote, extended, error, dlc = frame
    note = controller << 1 | own
    if not (remote or extended or error):
        return PACKET.pack(cob_id, len(data), note, data)
    flags = EXTENDED * extended | REMOTE * remote | ERROR * error
    return PACKET.pack(cob_id | flags, dlc if remote else len(data), note, data)


def controller_of(packet: bytes) -> Controller:
    """State of the controller of the master that receives a packet; an unknown one is the worst."""
    return Controller(min(packet[NOTE] >> 1, Controller.BUS_OFF))


def is_own(packet: bytes) -> bool:
    """Whether the master that receives a packet has sent its frame itself."""
    return bool(packet[NOTE] & 1)


def pack_opening(asked: Opening) -> bytes:
    """Pack what a master asks for; no master sends error frames, so it is one."""
    return pack_frame(Frame(0, OPENING.pack(asked.bitrate or 0, asked.own), error=True))


def opening_of(frame: Frame) -> Opening | None:
    """What an opening packet asks for; none if it is a frame like any other."""
    if not frame.error or len(frame.data) != OPENING.size:
        return None
    bitrate, own = OPENING.unpack(frame.data)
    return Opening(bitrate or None, bool(own))


def unpack_frame(packet: bytes) -> Frame | None:
    """A packet as a frame; none if it is none."""
    if len(packet) != PACKET.size:
        return None
    word, length, _, data = PACKET.unpack(packet)
    if word <= BASE_MASK and length <= len(data):
        return Frame(word, data[:length])
    cob_id, remote, error = word & ID_MASK, bool(word & REMOTE), bool(word & ERROR)
    extended = bool(word & EXTENDED)
    if length > len(data) or not (extended or error or cob_id <= BASE_MASK):
        return None
    if remote:
        return Frame(cob_id, b"", remote, extended, error, length)
    return Frame(cob_id, data[:length], remote, extended, error)
