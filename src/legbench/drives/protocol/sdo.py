"""Service data: what both sides share (CiA 301, 7.2.4)."""

import struct
from collections.abc import Mapping
from enum import IntEnum

from legbench.drives.errors import SdoAbortError

MUX = struct.Struct("<BHB")
"""Layout of the first four bytes of an SDO frame: command specifier, index, sub-index."""
SIZE = struct.Struct("<I")
FRAME = 8
"""Length of every SDO frame [bytes]."""
SEGMENT = 7
"""Largest amount of data in a segment [bytes]."""
EXPEDITED = 4
"""Largest amount of data in an expedited transfer, which needs no segments [bytes]."""
MAX_TRANSFER = 1 << 16
"""Longest object that either side takes [bytes]; a stray size must not fill the memory."""


class Abort(IntEnum):
    """Abort codes (CiA 301, table 22)."""

    TOGGLE = 0x05030000
    TIMED_OUT = 0x05040000
    COMMAND = 0x05040001
    OUT_OF_MEMORY = 0x05040005
    UNSUPPORTED_ACCESS = 0x06010000
    WRITE_ONLY = 0x06010001
    READ_ONLY = 0x06010002
    NO_OBJECT = 0x06020000
    NOT_MAPPABLE = 0x06040041
    PDO_LENGTH = 0x06040042
    INCOMPATIBLE = 0x06040043
    HARDWARE = 0x06060000
    TYPE_LENGTH = 0x06070010
    TOO_LONG = 0x06070012
    TOO_SHORT = 0x06070013
    NO_SUB_INDEX = 0x06090011
    INVALID_VALUE = 0x06090030
    TOO_HIGH = 0x06090031
    TOO_LOW = 0x06090032
    GENERAL = 0x08000000
    NOT_TRANSFERRED = 0x08000020
    LOCAL_CONTROL = 0x08000021
    DEVICE_STATE = 0x08000022
    NO_DATA = 0x08000024


LENGTHS = (Abort.TYPE_LENGTH, Abort.TOO_LONG, Abort.TOO_SHORT)
"""Codes with which drives refuse a value of another length than their object has."""
ABSENT = (Abort.NO_OBJECT, Abort.NO_SUB_INDEX, Abort.UNSUPPORTED_ACCESS, Abort.GENERAL)
"""Codes with which drives refuse objects that they have not; the last two are not the standard's
way, and may mean something else on an object that is there."""

MEANINGS: Mapping[int, str] = {
    Abort.TOGGLE: "toggle bit not alternated",
    Abort.TIMED_OUT: "SDO protocol timed out",
    Abort.COMMAND: "command specifier not valid or unknown",
    Abort.OUT_OF_MEMORY: "out of memory",
    Abort.UNSUPPORTED_ACCESS: "unsupported access to an object",
    Abort.WRITE_ONLY: "attempt to read a write only object",
    Abort.READ_ONLY: "attempt to write a read only object",
    Abort.NO_OBJECT: "object does not exist in the object dictionary",
    Abort.NOT_MAPPABLE: "object cannot be mapped to the PDO",
    Abort.PDO_LENGTH: "mapped objects would exceed the PDO length",
    Abort.INCOMPATIBLE: "general parameter incompatibility",
    Abort.HARDWARE: "access failed due to a hardware error",
    Abort.TYPE_LENGTH: "data type does not match, length does not match",
    Abort.TOO_LONG: "data type does not match, length too high",
    Abort.TOO_SHORT: "data type does not match, length too low",
    Abort.NO_SUB_INDEX: "sub-index does not exist",
    Abort.INVALID_VALUE: "invalid value for parameter",
    Abort.TOO_HIGH: "value of parameter written too high",
    Abort.TOO_LOW: "value of parameter written too low",
    Abort.GENERAL: "general error",
    Abort.NOT_TRANSFERRED: "data cannot be transferred or stored to the application",
    Abort.LOCAL_CONTROL: "data cannot be transferred because of local control",
    Abort.DEVICE_STATE: "data cannot be transferred in the present device state",
    Abort.NO_DATA: "no data available",
}


def abort_error(code: int, index: int, sub: int) -> SdoAbortError:
    """The error of an abort code, in words."""
    return SdoAbortError(code, index, sub, MEANINGS.get(code, "aborted"))


def abort_data(code: int, index: int, sub: int) -> bytes:
    """The frame that ends a transfer."""
    return MUX.pack(0x80, index, sub) + SIZE.pack(code)
