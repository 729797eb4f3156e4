"""SDO requests beside the cycle, each at a time at which its answer holds up no SYNC."""

import math
from collections.abc import Callable, Sequence
from typing import Protocol, final

from legbench.drives.errors import BusError
from legbench.drives.master.port import Port
from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.asking import PATIENCE_MS, latest_request_us
from legbench.drives.setup.config import BusConfig


class Poll(Protocol):
    """A request that is due in some cycles."""

    every: int
    """Number of cycles between two requests; in those between, `due` returns none."""

    def due(self, cycle: int) -> Frame | None:
        """Request of this cycle, none if none is due."""
        ...


@final
class Requests:
    """Requests that wait for a cycle with room; one is sent at a time, the oldest first."""

    def __init__(
        self,
        port: Port,
        config: BusConfig,
        polls: Sequence[Poll],
        failed: Callable[[BusError], None],
    ) -> None:
        """Prepare to ask; nothing is sent.

        Args:
            port: port of the bus.
            config: drives on the bus.
            polls: requests, which take turns a cycle apart.
            failed: called with the error of a request that could not be sent.
        """
        self._port, self._polls, self._failed = port, polls, failed
        self._latest_ns = 1000 * latest_request_us(config)
        self._patience = config.cycles_in(PATIENCE_MS)
        self._cycle = 0
        self._step = math.gcd(*(poll.every for poll in polls))
        self._waiting: dict[Poll, tuple[int, Frame]] = {}
        """Poll -> cycle in which its request became due, and the request."""

    def turn(self, after_tick_ns: int | None) -> None:
        """Count a cycle, and send the oldest request if there is room, or was none for too long.

        Args:
            after_tick_ns: time since the tick at which all answers to its SYNC are in [ns]; none in
                a cycle in which nothing may be asked.
        """
        self._cycle += 1
        # None is due unless a multiple of all their intervals is at most one turn of them away.
        if -self._cycle % self._step < len(self._polls):
            for place, poll in enumerate(self._polls):
                frame = poll.due(self._cycle + place)
                if frame is not None:
                    self._waiting.setdefault(poll, (self._cycle, frame))
        if not self._waiting or after_tick_ns is None:
            return
        poll, (since, frame) = next(iter(self._waiting.items()))
        if after_tick_ns <= self._latest_ns or self._cycle - since >= self._patience:
            del self._waiting[poll]
            try:
                self._port.send_frame(frame)
            except BusError as error:
                self._failed(error)
