"""Emergency messages (CiA 301, 7.2.7; codes also from CiA 402, object 603Fh)."""

import struct
from dataclasses import dataclass

from legbench.drives.protocol.frame import EMCY_BASE, Frame

_LAYOUT = struct.Struct("<HB5s")

MEANINGS = {
    0x0000: "error reset",
    0x1000: "generic error",
    0x2310: "over-current",
    0x3210: "over-voltage",
    0x3220: "under-voltage",
    0x4310: "drive over-temperature",
    0x5441: "safe torque off",
    0x6320: "parameter error",
    0x7305: "encoder",
    0x8100: "connection ended",
    0x8110: "CAN overrun",
    0x8120: "CAN error passive",
    0x8130: "heartbeat lost",
    0x8140: "recovered from bus-off",
    0x8210: "PDO too short",
    0x8220: "PDO too long",
    0x8240: "SYNC of unexpected length",
    0x8250: "RPDO timeout",
    0x8611: "following error",
    0x8612: "reference limit",
    0xFF10: "set points missing",
    0xFF11: "SYNC missing",
}
"""Meaning of each error code."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Emergency:
    """Emergency message of a node, sent once when an error comes; code 0 says all have gone."""

    node_id: int
    code: int
    """Error code (603Fh); 0 when all errors have gone."""
    register: int
    """Error register (1001h)."""
    vendor: bytes = bytes(5)

    @property
    def meaning(self) -> str:
        """Meaning of the error code."""
        known = MEANINGS.get(self.code)
        if known is not None:
            return known
        return "vendor error" if self.code >= 0xFF00 else "error"

    def __str__(self) -> str:
        return f"EMCY {self.code:04X}h {self.meaning} of node {self.node_id}"


def emcy_frame(emergency: Emergency) -> Frame:
    """Frame of an emergency message."""
    data = _LAYOUT.pack(emergency.code, emergency.register, emergency.vendor)
    return Frame(EMCY_BASE + emergency.node_id, data)


def decode_emcy(node_id: int, data: bytes) -> Emergency | None:
    """The emergency of a node; none when the bytes are no emergency."""
    if len(data) != _LAYOUT.size:
        return None
    code, register, vendor = _LAYOUT.unpack(data)
    return Emergency(node_id=node_id, code=code, register=register, vendor=vendor)
