"""A wire that answers one cycle as a test says, in virtual time."""

from collections.abc import Callable
from typing import Any, cast

import can
from drives_rig import config

from legbench.drives.errors import BusError
from legbench.drives.master.cycle import Cycle
from legbench.drives.master.port import Port
from legbench.drives.setup.config import BusConfig

US = 1000
DATA = bytes.fromhex("3712E80300000000")
"""Operation enabled, follows its command; motor at 1000 counts, link at 0."""
BOTH = ((240 * US, 0x181, DATA), (350 * US, 0x182, DATA))
"""Answers to a SYNC: how much later, identifier, data."""
Answers = tuple[tuple[int, int, bytes], ...]


def message(cob_id: int, data: bytes = b"", *, error: bool = False, own: bool = False) -> Any:
    return can.Message(
        arbitration_id=cob_id,
        data=data,
        is_extended_id=False,
        is_error_frame=error,
        is_rx=not own,
    )


class Wire:
    """A port in virtual time; what comes is planned, what goes out is kept."""

    def __init__(self, now_ns: int = 0) -> None:
        self.time_ns = now_ns
        self.timebase = self
        self.sent: list[tuple[int, int, bytes]] = []
        self.coming: list[tuple[int, can.Message]] = []
        self.answers: Callable[[int], Answers] = lambda number: BOTH
        self.syncs = 0
        self.refuses: set[int] = set()
        self.deaf = self.off_bus = False
        self.message = Port.message

    def now_ns(self) -> int:
        return self.time_ns

    def wait_until(self, at_ns: int) -> None:
        self.time_ns = max(self.time_ns, at_ns)

    def put(self, message: can.Message) -> None:
        if message.arbitration_id in self.refuses:
            raise BusError(f"{message.arbitration_id:03X}h refused")
        self.sent.append((self.time_ns, message.arbitration_id, bytes(message.data)))
        if message.arbitration_id == 0x080:
            for after_ns, cob_id, data in self.answers(self.syncs):
                self.plan(self.time_ns + after_ns, cob_id, data)
            self.syncs += 1

    def send_frame(self, frame: Any) -> None:
        self.put(message(frame.cob_id, frame.data, own=True))

    def plan(self, at_ns: int, cob_id: int, data: bytes = b"", **more: bool) -> None:
        self.coming.append((at_ns, message(cob_id, data, **more)))
        self.coming.sort(key=lambda entry: entry[0])

    def receive(self, until_ns: int) -> can.Message | None:
        if self.deaf:
            raise BusError("deaf")
        if self.coming and self.coming[0][0] <= max(until_ns, self.time_ns):
            at_ns, found = self.coming.pop(0)
            self.wait_until(at_ns)
            return found
        self.wait_until(until_ns)
        return None

    def take(self) -> can.Message | None:
        return self.receive(self.time_ns)

    def foreign(self, message: can.Message) -> bool:
        return message.is_rx

    def when(self, cob_id: int) -> list[int]:
        return [at for at, sent, _ in self.sent if sent == cob_id]


def cycle(wire: Wire, bus: BusConfig | None = None) -> Cycle:
    made = Cycle(cast(Any, wire), bus or config())
    made.begin()
    return made


def missed(it: Cycle) -> list[int]:
    return [watch.lost_total for watch in it.watches]


def stale(place: int, lost: set[int]) -> Callable[[int], Answers]:
    """Answers without those of a drive to some SYNCs."""
    return lambda number: BOTH[1 - place :: 2] if number in lost else BOTH
