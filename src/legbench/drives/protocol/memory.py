"""Signatures and ranges of the objects that store and restore parameters (CiA 301, 7.5.2.13)."""

from collections.abc import Mapping

from legbench.drives.protocol.objects import Key

STORE, RESTORE = 0x1010, 0x1011
SAVE_SIGNATURE = int.from_bytes(b"save", "little")
LOAD_SIGNATURE = int.from_bytes(b"load", "little")
ON_COMMAND = 1 << 0
"""Bit of 1010h as it is read: the drive stores when it is told to."""
BY_ITSELF = 1 << 1
"""Bit of 1010h as it is read: the drive stores by itself, too."""
PARTS: Mapping[int, range] = {
    1: range(0x1000, 0x10000),
    2: range(0x1000, 0x2000),
    3: range(0x6000, 0xA000),
}
"""Sub-index of 1010h and 1011h -> indices of the objects that it stores or restores."""


def in_part(key: Key, part: int) -> bool:
    """Whether an object belongs to a part of the parameters."""
    return key[0] in PARTS.get(part, range(0))
