"""Process data: mapped objects compiled to byte offsets (CiA 301, 7.5.2.34 to .38)."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

from legbench.drives.errors import CodecError
from legbench.drives.protocol.datatypes import FORMATS, DataType, range_of, size_of

MAX_BYTES = 8


@dataclass(frozen=True, slots=True)
class Mapped:
    """Object that is mapped into a PDO.

    Raises:
        CodecError: a type of variable length.
    """

    index: int
    sub: int
    kind: DataType

    def __post_init__(self) -> None:
        if size_of(self.kind) is None:
            raise CodecError(f"{self.index:04X}h:{self.sub:02X} is text; a PDO carries numbers")

    @property
    def bits(self) -> int:
        """Length of the object [bits]."""
        return 8 * (size_of(self.kind) or 0)

    @property
    def word(self) -> int:
        """The mapping entry: index, sub-index and length in one word."""
        return self.index << 16 | self.sub << 8 | self.bits

    @property
    def key(self) -> tuple[int, int]:
        """Index and sub-index."""
        return (self.index, self.sub)

    def __str__(self) -> str:
        return f"{self.index:04X}h:{self.sub:02X}"


def split_word(word: int) -> tuple[int, int, int]:
    """Index, sub-index and length [bits] of a mapping entry."""
    return word >> 16, word >> 8 & 0xFF, word & 0xFF


@final
class PdoMap:
    """Objects <-> bytes of one PDO.

    Raises:
        CodecError: more than eight bytes, nothing at all, or an object that is no whole number.
    """

    def __init__(self, entries: Sequence[Mapped]) -> None:
        self.entries = tuple(entries)
        reals = [str(entry) for entry in self.entries if entry.kind not in FORMATS]
        if reals:
            raise CodecError(f"{reals[0]} is no whole number; map another object")
        self._layout = struct.Struct("<" + "".join(FORMATS[entry.kind] for entry in self.entries))
        self._ranges = tuple(range_of(entry.kind) for entry in self.entries)
        self.size = self._layout.size
        """Length of the frame's data [bytes]."""
        self.values_of = self._layout.unpack
        """Function that unpacks as `unpack` does, but raises `struct.error` for a wrong length."""
        self.bytes_of = self._layout.pack
        """Function of one argument a value that packs as `pack` does, but raises `struct.error`."""
        if not self.entries or self.size > MAX_BYTES:
            names = ", ".join(map(str, self.entries)) or "nothing"
            raise CodecError(f"a PDO of {names} has {self.size} bytes; it must have 1 to 8")

    def place(self, index: int, sub: int = 0) -> int | None:
        """Place of an object among the values of the PDO; none if it is not mapped."""
        for place, entry in enumerate(self.entries):
            if entry.key == (index, sub):
                return place
        return None

    def pack(self, values: Sequence[int]) -> bytes:
        """The data of a frame.

        Raises:
            CodecError: a value that its object cannot hold, or not one value an object.
        """
        try:
            return self._layout.pack(*values)
        except struct.error:
            raise CodecError(self._why_not(values)) from None

    def unpack(self, data: bytes | bytearray) -> tuple[int, ...]:
        """The values of a frame, signed where their objects are.

        Raises:
            CodecError: the frame is longer or shorter than the map.
        """
        try:
            return self._layout.unpack(data)
        except struct.error:
            raise CodecError(f"a PDO came with {len(data)} bytes, mapped are {self.size}") from None

    def _why_not(self, values: Sequence[int]) -> str:
        if len(values) != len(self.entries):
            return f"{len(values)} values for a PDO of {len(self.entries)} objects"
        for entry, value, (low, high) in zip(self.entries, values, self._ranges, strict=True):
            if not low <= value <= high:
                return f"{value} does not fit {entry}; it holds {low} to {high}"
        return f"a PDO carries whole numbers, not {values!r}"
