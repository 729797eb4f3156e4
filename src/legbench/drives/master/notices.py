"""What a run has to tell though nothing ended it: how often, since when, and what it was first."""

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
    """Counts what a person wants to know of a bus and its drives.

    Attributes:
        events: what has been seen, by name: how often, when first on the bus's time base [s], and
            what it was then.
    """

    def __init__(self) -> None:
        self.events: dict[str, dict[str, Any]] = {}

    def note(self, name: str, now_ns: int, **detail: object) -> None:
        """Count something that has been seen; its detail is kept the first time."""
        event = self.events.get(name)
        if event is None:
            event = self.events[name] = {"count": 0, "first": 1e-9 * now_ns, **detail}
        event["count"] += 1

    def statuswords(self, axes: Sequence[AxisLink], now_ns: int) -> None:
        """Look at bits 7 (warning) and 11 (internal limit) of what drives have just sent."""
        for axis in axes:
            word = axis.statusword & TOLD
            if not (word and axis.fresh):
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
