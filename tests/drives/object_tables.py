"""Two drives that are no more than a table of objects, on a bus in virtual time."""

import struct
from typing import Any, cast

import can
from drives_rig import MS, config

from legbench.drives.master.bring_up import BringUp
from legbench.drives.master.port import Port
from legbench.drives.setup.config import BusConfig

NO_OBJECT = 0x06020000


def identity(place: int) -> dict[tuple[int, int], int]:
    return {
        (0x1000, 0): 0x00020192,
        (0x1018, 1): 0x1234,
        (0x1018, 2): 7,
        (0x1018, 3): 3,
        (0x1018, 4): 100 + place,
        (0x6502, 0): 1 << 7,
        (0x6041, 0): 0x0250,
        (0x6061, 0): 8,
        (0x6064, 0): 5000 - 9000 * place,
        (0x607A, 0): 0,
    }


class Objects:
    """A bus with two tables of objects, in virtual time: an answer takes 0.1 ms."""

    channel_info = "objects"
    state = can.BusState.ACTIVE

    def __init__(self) -> None:
        self.tables = [identity(0), identity(1)]
        self.time_ns = 0
        self.wrote: list[tuple[int, int, int, int]] = []
        self.asked: list[tuple[int, int, int]] = []
        self.orders: list[tuple[int, ...]] = []
        self.sizes = {(0x6041, 0): 2, (0x603F, 0): 2, (0x6061, 0): 1, (0x2070, 0): 2}
        self.keeps: set[tuple[int, int]] = set()
        """Objects that take every value and hold their own."""
        self.aborts: dict[tuple[int, int], int] = {}
        self.refuses: set[int] = set()
        """Nodes whose orders the bus does not take."""
        self._answers: list[bytes] = []
        self._from = 0

    def now_ns(self) -> int:
        return self.time_ns

    def wait_until(self, at_ns: int) -> None:
        self.time_ns = max(self.time_ns, at_ns)

    def send(self, message: can.Message) -> None:
        data = bytes(message.data)
        if message.arbitration_id == 0x000:
            if data[1] in self.refuses:
                raise can.CanOperationError("full")
            self.orders.append(tuple(data))
            return
        place = message.arbitration_id - 0x601
        index, sub = struct.unpack_from("<HB", data, 1)
        self._from = 0x581 + place
        where = data[1:4]
        code = self.aborts.get((index, sub))
        if data[0] == 0x40:
            self.asked.append((place, index, sub))
            if (index, sub) not in self.tables[place]:
                code = code or NO_OBJECT
            size = self.sizes.get((index, sub), 4)
            value = self.tables[place].get((index, sub), 0) & (1 << 8 * size) - 1
            answer = bytes([0x43 | (4 - size) << 2]) + where + value.to_bytes(4, "little")
        else:
            size = 4 - (data[0] >> 2 & 3)
            value = int.from_bytes(data[4 : 4 + size], "little", signed=True)
            self.wrote.append((place, index, sub, value))
            if code is None and (index, sub) not in self.keeps:
                self.tables[place][index, sub] = value
            answer = b"\x60" + where + bytes(4)
        if code is not None:
            answer = b"\x80" + where + code.to_bytes(4, "little")
        self._answers.append(answer)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if not self._answers:
            self.time_ns += round(1e9 * (timeout or 0.0))
            return None
        self.time_ns += MS // 10
        return can.Message(
            arbitration_id=self._from, data=self._answers.pop(0), is_extended_id=False
        )

    def bring_up(self, bus: BusConfig | None = None) -> BringUp:
        port = Port(cast(Any, self), self)
        return BringUp(port, bus or config(), lambda message: None)
