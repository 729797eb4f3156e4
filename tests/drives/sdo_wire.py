"""A port to two drives that answer over SDO as a test says, in virtual time."""

from collections.abc import Callable
from typing import Any, cast

import can
from drives_rig import MS, node

from legbench.drives.master.sdo_stop import SdoStop
from legbench.drives.master.stop_report import StopReport
from legbench.drives.protocol.frame import Frame

ASK = bytes.fromhex("4041600000000000")
SINCE = 7_000_000 * MS
"""What the clock shows when a test begins [ns]."""
Script = Callable[[int], int | None]
"""Time since the start [ns] -> statusword; None for no answer."""


class Wire:
    """A port to two drives, in virtual time; an answer takes 0.2 ms."""

    def __init__(self, *scripts: Script) -> None:
        self.scripts = scripts
        self.time_ns = 0
        self.log: list[tuple[int, int, bytes]] = []
        self.fails: Callable[[int, bytes], BaseException | None] = lambda cob_id, data: None
        self.refused = 0
        self.timebase = self.bus = self
        self.channel_info = "wire"
        self.answers: list[can.Message] = []

    def now_ns(self) -> int:
        return SINCE + self.time_ns

    def wait_until(self, at_ns: int) -> None:
        self.time_ns = max(self.time_ns, at_ns - SINCE)

    def send(self, cob_id: int, data: bytes) -> None:
        error = self.fails(cob_id, data)
        if error is not None:
            self.refused += 1
            raise error
        self.log.append((self.time_ns, cob_id, bytes(data)))
        if bytes(data) == ASK:
            shown = self.scripts[cob_id - 0x601](self.time_ns)
            if shown is not None:
                answer = b"\x4b\x41\x60\x00" + shown.to_bytes(2, "little") + b"\0\0"
                self.answers.append(
                    can.Message(arbitration_id=cob_id - 0x80, data=answer, is_extended_id=False)
                )

    def send_frame(self, frame: Frame) -> None:
        self.send(frame.cob_id, frame.data)

    def receive(self, until_ns: int) -> can.Message | None:
        if not self.answers:
            self.wait_until(until_ns)
            return None
        self.time_ns += MS // 5
        return self.answers.pop(0)

    def stop(self, **more: Any) -> tuple[StopReport, list[str]]:
        """Stop, and what was held on the way."""
        held: list[str] = []
        nodes = [node(0), node(1)]
        stop = SdoStop(
            cast(Any, self), nodes, lambda error: held.append(type(error).__name__), **more
        )
        return stop.run(), held

    def told(self, place: int, word: bytes) -> list[int]:
        """When a drive was told something [ns]."""
        return [at for at, cob_id, data in self.log if (cob_id, data) == (0x601 + place, word)]


def until(moment_ns: int, before: int | None, after: int | None) -> Script:
    return lambda now_ns: before if now_ns < moment_ns else after


def always(shown: int | None) -> Script:
    return lambda now_ns: shown


def pair(place: int, odd: Script, usual: Script) -> tuple[Script, Script]:
    return (odd, usual) if place == 0 else (usual, odd)
