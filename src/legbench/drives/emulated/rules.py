"""Values that CiA 301 and CiA 402 allow for the objects of a drive, whatever its state; pure."""

from collections.abc import Container, Mapping

from legbench.drives.protocol.frame import COB_INVALID, COB_MASK, COB_NO_REMOTE, LAST_NODE
from legbench.drives.protocol.objects import Key
from legbench.drives.protocol.sdo import Abort

RESTRICTED = (
    *((0x000, 0x07F), (0x101, 0x180), (0x581, 0x5FF)),
    *((0x601, 0x67F), (0x6E0, 0x6FF), (0x701, 0x7FF)),
)
"""First and last of the identifiers that no object may be given (CiA 301, restricted CAN-IDs)."""
COMMUNICATION_PROFILE = range(0x1000, 0x2000)
"""Objects that NMT's reset communication sets back (CiA 301, 7.3.2.2)."""
ERRORS = (0x1001, 0x1003)
"""Objects of the communication profile that show the state of the drive, which a reset keeps."""
SET_BACK = tuple(index for index in COMMUNICATION_PROFILE if index not in ERRORS)
"""Objects that reset communication sets back."""
ALLOWED: Mapping[Key, Container[int]] = {
    (0x1003, 0): range(1),
    (0x1019, 0): (0, *range(2, 241)),
    (0x1029, 1): range(3),
    (0x6007, 0): range(4),
    (0x605A, 0): range(9),
    (0x605B, 0): range(2),
    (0x605C, 0): range(2),
    (0x605D, 0): range(1, 5),
    (0x605E, 0): range(5),
    (0x607E, 0): (0x00, 0x40, 0x80, 0xC0),
}
"""Values by object; negative option codes are the manufacturer's, and this one has none."""
SYNC, CONSUMERS = (0x1005, 0), 0x1016
COUNTER = (0x1019, 0)
"""Synchronous counter overflow, which stays as it is while SYNC has a period (1006h)."""


def usable(cob: int) -> bool:
    """Whether a COB-ID names an 11-bit identifier that is not restricted; flags are left out."""
    cob &= ~(COB_INVALID | COB_NO_REMOTE)
    return cob <= COB_MASK and not any(low <= cob <= high for low, high in RESTRICTED)


def watched(word: int) -> tuple[int, int] | None:
    """Node and time [ms] of a consumer heartbeat time (1016h), if it asks for a watch."""
    node_id, time_ms = word >> 16 & 0xFF, word & 0xFFFF
    return (node_id, time_ms) if time_ms and 0 < node_id <= LAST_NODE else None


def objection(key: Key, value: int, values: Mapping[Key, int]) -> Abort | None:
    """Abort code that refuses a value for an object; none if the standards allow it.

    Args:
        key: the object.
        value: what is to be written.
        values: the other objects.
    """
    allowed = ALLOWED.get(key)
    if allowed is not None:
        if value not in allowed:
            return Abort.INVALID_VALUE
        return Abort.DEVICE_STATE if key == COUNTER and values[0x1006, 0] else None
    if key == SYNC:
        # Bit 30 asks for a producer of SYNC, which a drive is not.
        producer = bool(value & COB_NO_REMOTE)
        return Abort.INVALID_VALUE if producer or not usable(value) else None
    if key[0] == CONSUMERS and _is_watched_elsewhere(key, value, values):
        return Abort.INCOMPATIBLE
    return None


def _is_watched_elsewhere(key: Key, value: int, values: Mapping[Key, int]) -> bool:
    asked = watched(value)
    if asked is None:
        return False
    others = (watched(values[CONSUMERS, sub]) for sub in (1, 2) if sub != key[1])
    return any(other is not None and other[0] == asked[0] for other in others)
