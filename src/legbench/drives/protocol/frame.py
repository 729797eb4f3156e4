"""One classic CAN frame and the identifiers of CiA 301's predefined connection set."""

from typing import NamedTuple

NMT_ID = 0x000
SYNC_ID = 0x080
EMCY_BASE = 0x080
TIME_ID = 0x100
TPDO_BASES = (0x180, 0x280, 0x380, 0x480)
RPDO_BASES = (0x200, 0x300, 0x400, 0x500)
SDO_REPLY_BASE = 0x580
"""Base of the COB-IDs of SDO replies, from drive to master; the node id is added."""
SDO_REQUEST_BASE = 0x600
"""Base of the COB-IDs of SDO requests, from master to drive; the node id is added."""
HEARTBEAT_BASE = 0x700
LAST_NODE = 127
COB_MASK = 0x7FF
COB_INVALID = 1 << 31
"""Bit 31 of a PDO's COB-ID object: the PDO does not exist (CiA 301, 7.5.2.33)."""
COB_NO_REMOTE = 1 << 30
"""Bit 30 of a TPDO's COB-ID object: no remote request answered (CiA 301, 7.5.2.37)."""

_BASES = (
    (EMCY_BASE, "EMCY"),
    *((base, f"TPDO{number}") for number, base in enumerate(TPDO_BASES, start=1)),
    *((base, f"RPDO{number}") for number, base in enumerate(RPDO_BASES, start=1)),
    (SDO_REPLY_BASE, "SDO reply"),
    (SDO_REQUEST_BASE, "SDO request"),
    (HEARTBEAT_BASE, "heartbeat"),
)


class Frame(NamedTuple):
    """A frame as the protocol sees it; a named tuple because hundreds of them fly a millisecond."""

    cob_id: int
    data: bytes = b""
    remote: bool = False
    extended: bool = False
    error: bool = False
    dlc: int = 0
    """Length that a remote frame asks for; 0 for all others, which have their data [bytes]."""

    @property
    def length(self) -> int:
        """Data length code on the wire [bytes]."""
        return self.dlc if self.remote else len(self.data)

    def __str__(self) -> str:
        return f"{self.cob_id:03X}#{self.data.hex().upper()}"


def sync_frame(counter: int | None = None) -> Frame:
    """SYNC, with its counter 1..240 where object 1019h asks for one (CiA 301, 7.2.5)."""
    return Frame(SYNC_ID, b"" if counter is None else bytes((counter,)))


def describe_id(cob_id: int) -> str:
    """Meaning of an 11-bit identifier in the predefined connection set, such as `TPDO1 of 5`."""
    if cob_id in (NMT_ID, SYNC_ID, TIME_ID):
        return {NMT_ID: "NMT", SYNC_ID: "SYNC", TIME_ID: "TIME"}[cob_id]
    for base, name in _BASES:
        if base < cob_id <= base + LAST_NODE:
            return f"{name} of {cob_id - base}"
    return f"id {cob_id:03X}h"
