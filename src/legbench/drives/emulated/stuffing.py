"""Length of a frame on an emulated wire, by the way its stuff bits are counted; pure."""

from enum import Enum

from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.wire import exact_bits, plain_bits, worst_bits


class Stuffing(Enum):
    """Ways to count the stuff bits in the length of a frame."""

    NONE = "none"
    WORST = "worst"
    EXACT = "exact"


_EXACT, _WORST = Stuffing.EXACT, Stuffing.WORST
_USUAL = tuple(worst_bits(length) for length in range(9))
"""Number of bits of a frame with an 11-bit identifier at worst, by the length of its data."""


def bits_of(frame: Frame, stuffing: Stuffing) -> int:
    """Number of bits that a frame takes on the wire, the space to the next one included."""
    if stuffing is _WORST and not frame.extended:
        return _USUAL[len(frame.data)]
    if stuffing is _EXACT:
        return exact_bits(frame)
    count = worst_bits if stuffing is _WORST else plain_bits
    return count(len(frame.data), extended=frame.extended)
