"""What a master that only looks may send; pure."""

from collections.abc import Callable

from legbench.drives.protocol.frame import (
    HEARTBEAT_BASE,
    LAST_NODE,
    NMT_ID,
    SDO_REQUEST_BASE,
    SYNC_ID,
)
from legbench.drives.protocol.nmt import NmtCommand

MaySend = Callable[[int, bytes | bytearray], bool]
"""Whether a frame, by identifier and data, may go out."""
READING = (2, 3, 4)
"""Client command specifiers of SDO: upload, upload segment, abort."""


def may_read(cob_id: int, data: bytes | bytearray) -> bool:
    """Whether a frame is a mere question: an SDO upload changes nothing in a drive."""
    asked = SDO_REQUEST_BASE < cob_id <= SDO_REQUEST_BASE + LAST_NODE
    return asked and bool(data) and data[0] >> 5 in READING


def may_pace(master_id: int) -> MaySend:
    """Questions, and what drives without power need to send process data: start, SYNC, heartbeat,
    and the order that takes them back to where they were found.
    """
    orders = (NmtCommand.START, NmtCommand.ENTER_PRE_OPERATIONAL)

    def allowed(cob_id: int, data: bytes | bytearray) -> bool:
        if cob_id == NMT_ID:
            return data[:1] in [bytes((order,)) for order in orders]
        return cob_id in (SYNC_ID, HEARTBEAT_BASE + master_id) or may_read(cob_id, data)

    return allowed
