"""Basic data types of CiA 301 (7.1.6), little endian on the wire."""

import struct
from enum import IntEnum

from legbench.drives.errors import CodecError

Value = int | float | str | bytes


class DataType(IntEnum):
    """Static data types with their index in the object dictionary (CiA 301, table 44)."""

    BOOLEAN = 0x01
    INTEGER8 = 0x02
    INTEGER16 = 0x03
    INTEGER32 = 0x04
    UNSIGNED8 = 0x05
    UNSIGNED16 = 0x06
    UNSIGNED32 = 0x07
    REAL32 = 0x08
    VISIBLE_STRING = 0x09
    OCTET_STRING = 0x0A
    INTEGER64 = 0x15
    UNSIGNED64 = 0x1B


FORMATS = {
    DataType.BOOLEAN: "B",
    DataType.INTEGER8: "b",
    DataType.INTEGER16: "h",
    DataType.INTEGER32: "i",
    DataType.UNSIGNED8: "B",
    DataType.UNSIGNED16: "H",
    DataType.UNSIGNED32: "I",
    DataType.INTEGER64: "q",
    DataType.UNSIGNED64: "Q",
}
"""`struct` code of every whole number's type."""
_STRUCTS = {
    kind: struct.Struct("<" + code) for kind, code in {**FORMATS, DataType.REAL32: "f"}.items()
}
SHORT_NAMES = {
    "bool": DataType.BOOLEAN,
    "i8": DataType.INTEGER8,
    "i16": DataType.INTEGER16,
    "i32": DataType.INTEGER32,
    "u8": DataType.UNSIGNED8,
    "u16": DataType.UNSIGNED16,
    "u32": DataType.UNSIGNED32,
    "f32": DataType.REAL32,
    "i64": DataType.INTEGER64,
    "u64": DataType.UNSIGNED64,
    "str": DataType.VISIBLE_STRING,
    "bytes": DataType.OCTET_STRING,
}
"""Names of the types in files."""


def size_of(kind: DataType) -> int | None:
    """Length on the wire [bytes]; none for strings."""
    layout = _STRUCTS.get(kind)
    return None if layout is None else layout.size


def range_of(kind: DataType) -> tuple[int, int]:
    """Lowest and highest value of a whole number's type."""
    if kind is DataType.BOOLEAN:
        return (0, 1)
    bits = 8 * _STRUCTS[kind].size
    if FORMATS[kind].islower():
        return (-(1 << (bits - 1)), (1 << (bits - 1)) - 1)
    return (0, (1 << bits) - 1)


def resized(kind: DataType, size: int) -> DataType | None:
    """Whole number's type of another length [bytes] and the same sign; none if there is none."""
    if kind not in FORMATS:
        return None
    signed = FORMATS[kind].islower()
    return next(
        (
            other
            for other, code in FORMATS.items()
            if size_of(other) == size and code.islower() == signed and other is not DataType.BOOLEAN
        ),
        None,
    )


def fitting_type(kind: DataType, size: int, value: int) -> DataType | None:
    """Type of another length [bytes] in which a whole number can be written; none if it cannot.

    The bus does not tell the sign of the drive's own type. In a shorter one, a number of a type
    without a sign must therefore be the same in a type that has one.
    """
    own = resized(kind, size)
    if own is None:
        return None
    low, high = range_of(own)
    if size < (size_of(kind) or 0):
        high = min(high, (1 << 8 * size - 1) - 1)
    return own if low <= value <= high else None


def pack(kind: DataType, value: Value) -> bytes:
    """A value as its bytes.

    Raises:
        CodecError: the type cannot hold the value.
    """
    if isinstance(value, bytes):
        if kind is DataType.OCTET_STRING:
            return value
    elif isinstance(value, str):
        if kind is DataType.VISIBLE_STRING and value.isascii():
            return value.encode("ascii")
    elif kind is DataType.REAL32:
        return _STRUCTS[kind].pack(value)
    elif kind in FORMATS and isinstance(value, int):
        low, high = range_of(kind)
        if low <= value <= high:
            return _STRUCTS[kind].pack(value)
        raise CodecError(f"{value} is no {kind.name}; it holds {low} to {high}")
    raise CodecError(f"{value!r} is no {kind.name}")


def unpack(kind: DataType, data: bytes) -> Value:
    """The value of bytes.

    Raises:
        CodecError: their number is not that of the type, or a string is not ASCII.
    """
    layout = _STRUCTS.get(kind)
    if layout is not None:
        if len(data) != layout.size:
            raise CodecError(f"{len(data)} bytes are no {kind.name}; it has {layout.size}")
        (number,) = layout.unpack(data)
        return float(number) if kind is DataType.REAL32 else int(number)
    if kind is DataType.OCTET_STRING:
        return bytes(data)
    try:
        return data.rstrip(b"\0").decode("ascii")
    except UnicodeDecodeError:
        raise CodecError(f"{data.hex()} is no ASCII text") from None
