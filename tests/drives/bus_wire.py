"""A wire without drives and the two ways to plug into it, for what every bus has to keep."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Protocol, final

import can

from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.faults import Fault, FrameFault, FrameFaultKind
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.unix_server import UnixServer
from legbench.drives.transport.unix_bus import UnixBus

MS = 1_000_000
BROKEN = 0x7F0
"""Identifier whose frames are destroyed on the wire: a sender of 32 goes bus-off."""


class Ports(Protocol):
    """Opens buses on one wire and lets its time pass."""

    def open(self, **options: Any) -> can.BusABC:
        """Open one more bus."""
        ...

    def pass_time(self) -> None:
        """Let 1 to 2 ms pass on the wire."""
        ...

    def pass_a_little_time(self) -> None:
        """Let about 0.1 ms pass on the wire."""
        ...


def _network() -> Network:
    fault: Fault = FrameFault(kind=FrameFaultKind.BAD_BITS, cob_id=BROKEN)
    return Network((), faults=(fault,))


@final
class LockstepPorts:
    """Buses in this process, in virtual time."""

    def __init__(self, _folder: Path) -> None:
        self.network = _network()

    def open(self, **options: Any) -> can.BusABC:
        return LockstepBus("wire", network=self.network, **options)

    def pass_time(self) -> None:
        self.network.advance(self.network.now_ns + MS)

    def pass_a_little_time(self) -> None:
        self.network.advance(self.network.now_ns + MS // 10)

    def close(self) -> None:
        """Nothing is held."""


@final
class UnixPorts:
    """Buses over a socket; the server of the wire runs in this process, by the test's clock."""

    def __init__(self, folder: Path) -> None:
        self._now_ns = 0
        self.server = UnixServer(_network(), folder / "wire.sock", self._clock)

    def _clock(self) -> int:
        self._now_ns += MS // 10
        return self._now_ns

    def open(self, **options: Any) -> can.BusABC:
        bus = UnixBus(str(self.server.path), **options)
        for _ in range(3):
            self.server.poll()
        return bus

    def pass_time(self) -> None:
        for _ in range(10):
            self.server.poll()

    def pass_a_little_time(self) -> None:
        self.server.poll()

    def close(self) -> None:
        self.server.close()


def drain(ports: Ports, bus: can.BusABC, milliseconds: int = 20) -> list[can.Message]:
    """All that a bus receives while some time passes."""
    found: list[can.Message] = []
    for _ in range(milliseconds):
        ports.pass_time()
        found += iter(lambda: bus.recv(0.0), None)
    return found


def message(cob_id: int = 0x123, data: bytes | None = b"\1\2", **changes: Any) -> can.Message:
    """A data frame with an 11-bit identifier, unless it is changed."""
    plain: dict[str, Any] = {"arbitration_id": cob_id, "data": data, "is_extended_id": False}
    return can.Message(**{**plain, **changes})


def accepted(bus: can.BusABC, frames: Iterator[can.Message]) -> list[can.Message]:
    """Those of a burst of frames that a bus takes without an error."""
    taken: list[can.Message] = []
    for frame in frames:
        try:
            bus.send(frame)
        except can.CanOperationError:
            continue
        taken.append(frame)
    return taken


def until(ports: Ports, done: Callable[[], bool], milliseconds: int = 200) -> bool:
    """Whether something comes true while some time passes."""
    for _ in range(milliseconds):
        if done():
            return True
        ports.pass_time()
    return done()


def clock() -> float:
    """Time as python-can stamps it [s]."""
    return time.time()
