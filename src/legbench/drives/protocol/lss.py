"""Layer setting services (LSS, CiA 305): node ids over the bus, by the identity of a drive."""

import struct
from enum import IntEnum

REQUEST_ID, ANSWER_ID = 0x7E5, 0x7E4
"""COB-IDs of the LSS master and of the LSS slaves (CiA 305, 4.1)."""
FRAME = 8
"""Length of every LSS frame [bytes]."""
UNCONFIGURED = 255
"""Node id of a drive that has none; it stays in initialisation and hears LSS alone."""
WORDS = 4
"""Number of words of an LSS address: vendor, product, revision, serial (1018h)."""
RESET_SCAN = 0x80
"""Value of the bit check with which a fast scan begins."""
ADDRESS = struct.Struct("<I")

LssAddress = tuple[int, int, int, int]
"""Vendor, product code, revision number and serial number of one drive (1018h:01 to :04)."""


class Lss(IntEnum):
    """Command specifiers of requests and answers (CiA 305, 4.2)."""

    SWITCH_GLOBAL = 0x04
    CONFIGURE_NODE_ID = 0x11
    CONFIGURE_BIT_TIMING = 0x13
    ACTIVATE_BIT_TIMING = 0x15
    STORE = 0x17
    SELECT_VENDOR = 0x40
    SELECT_SERIAL = 0x43
    SELECTED = 0x44
    IDENTIFY_VENDOR = 0x46
    IDENTIFY_SERIAL_HIGH = 0x4B
    IDENTIFY_UNCONFIGURED = 0x4C
    IDENTIFIED = 0x4F
    UNCONFIGURED_IDENTIFIED = 0x50
    FAST_SCAN = 0x51
    INQUIRE_VENDOR = 0x5A
    INQUIRE_SERIAL = 0x5D
    INQUIRE_NODE_ID = 0x5E


class LssMode(IntEnum):
    """States of an LSS slave, as the switch of all of them names them."""

    WAITING = 0
    CONFIGURATION = 1


class LssError(IntEnum):
    """Error codes of answers to a configuration."""

    NONE = 0
    OUT_OF_RANGE = 1
    """Node id or bit timing out of range; storing is not supported."""
    STORE_FAILED = 2
    """Access to the memory failed."""


def lss_frame(specifier: int, content: bytes = b"") -> bytes:
    """Data of an LSS frame: command specifier and content, unused bytes 0."""
    return bytes((specifier, *content)).ljust(FRAME, b"\0")


def select_frames(address: LssAddress) -> list[bytes]:
    """Data of the frames that bring the one drive of an address into configuration."""
    return [
        lss_frame(Lss.SELECT_VENDOR + place, ADDRESS.pack(word))
        for place, word in enumerate(address)
    ]


def scan_frame(word: int, bit: int, sub: int, following: int) -> bytes:
    """Data of one question of a fast scan (CiA 305, 4.6).

    Args:
        word: what bits 31 to `bit` of the word are to be.
        bit: lowest bit that is compared, or `RESET_SCAN`.
        sub: place of the word in the address, 0 to 3.
        following: place of the word that is asked for next.
    """
    return lss_frame(Lss.FAST_SCAN, ADDRESS.pack(word) + bytes((bit, sub, following)))
