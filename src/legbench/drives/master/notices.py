"""Notices of a run that do not end it: how often, since when, and the first one's detail."""

from collections.abc import Sequence
from typing import Any, final

import can

from legbench.drives.master.axis_link import AxisLink
from legbench.drives.protocol.cia402 import StatusBit

WARNING, INTERNAL_LIMIT = int(StatusBit.WARNING), int(StatusBit.INTERNAL_LIMIT)
TOLD = WARNING | INTERNAL_LIMIT
WRITES = (0, 1, 6)
"""Client command specifiers that write: download segment, initiate and block download (CiA 301,
7.2.4.3)."""


@final
class Notices:
    """Counts of irregularities of a bus and its drives that do not end a run.

    Attributes:
        events: what has been seen, by name: how often, when first on the bus's time base [s], and
            what it was then.
    """

    def __init__(self) -> None:
        self.events: dict[str, dict[str, Any]] = {}

    def note(self, name: str, now_ns: int, **detail: object) -> None:
        """Count something that has been seen; its detail is kept the first time."""
        if name not in self.events:
            self.events[name] = {"count": 0, "first": 1e-9 * now_ns, **detail}
        self.events[name]["count"] += 1

    def statuswords(self, axes: Sequence[AxisLink], now_ns: int) -> None:
        """Count warnings (bit 7) and internal limits (bit 11) in the statuswords just received."""
        for axis in axes:
            word = axis.statusword & TOLD
            if not word or not axis.fresh:
                continue
            drive = axis.node.name
            if word & WARNING:
                self.note(f"warning of drive {drive}", now_ns, statusword=axis.statusword)
            if word & INTERNAL_LIMIT:
                self.note(f"internal limit of drive {drive}", now_ns, statusword=axis.statusword)

    def answered_twice(self, message: can.Message, now_ns: int) -> None:
        """Count a drive that has sent the same process data twice for one SYNC."""
        self.note("node answered twice", now_ns, cob_id=message.arbitration_id)

    def sdo_request(self, message: can.Message, node_id: int, now_ns: int) -> None:
        """Count an SDO request of another master; only those that write are noted."""
        data = bytes(message.data)
        if len(data) == 8 and data[0] >> 5 in WRITES:
            written = f"{data[2]:02X}{data[1]:02X}h:{data[3]:02X}"
            self.note("foreign SDO write", now_ns, node=node_id, object=written)
