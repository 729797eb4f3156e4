"""Several channels as one bus: a drive on each, one master, one SYNC to all of them."""

import select
import time
from collections.abc import Sequence
from contextlib import ExitStack
from typing import final

import can

from legbench.drives.protocol.frame import LAST_NODE, NMT_ID, SDO_REQUEST_BASE
from legbench.drives.setup.config import BusConfig
from legbench.drives.transport.checked_bus import CheckedBus

LOOK_S = 2e-4
"""Time between two looks at interfaces that cannot be waited for together [s]."""


@final
class Routes:
    """Channels that a frame of the master goes to, by number."""

    def __init__(self, config: BusConfig) -> None:
        """Look up whose frames go where; those of nobody in particular go to all."""
        channels = config.channels
        self._all = tuple(range(len(channels)))
        self._nodes: dict[int, tuple[int, ...]] = {}
        self._ids: dict[int, tuple[int, ...]] = {}
        for node in config.nodes:
            where = (channels.index(config.channel_of(node)),)
            self._nodes[node.node_id] = where
            self._ids |= {node.rpdo_id(pdo): where for pdo in node.rpdos}

    def of(self, cob_id: int, data: bytes | bytearray) -> tuple[int, ...]:
        """Channels of a frame: those of the drive that it is for, all for SYNC and heartbeat."""
        found = self._ids.get(cob_id)
        if found is not None:
            return found
        if cob_id == NMT_ID and len(data) > 1:
            return self._nodes.get(data[1], self._all)
        if SDO_REQUEST_BASE < cob_id <= SDO_REQUEST_BASE + LAST_NODE:
            return self._nodes.get(cob_id - SDO_REQUEST_BASE, self._all)
        return self._all


def worst_state(parts: Sequence[can.BusABC]) -> can.BusState:
    """The state of the worst of several interfaces."""
    states = [part.state for part in parts]
    for state in (can.BusState.ERROR, can.BusState.PASSIVE):
        if state in states:
            return state
    return can.BusState.ACTIVE


def wait_for_any(parts: Sequence[can.BusABC], left: float | None) -> None:
    """Wait until an interface has something or the time [s] is over, or a moment if unknown."""
    try:
        select.select([part.fileno() for part in parts], [], [], left)
    except (NotImplementedError, ValueError, OSError):
        time.sleep(LOOK_S if left is None else min(LOOK_S, left))


@final
class SplitBus(CheckedBus):
    """Buses of several channels as one interface of python-can.

    Attributes:
        parts: interfaces, one a channel, which this bus shuts down.
    """

    def __init__(self, parts: Sequence[can.BusABC], config: BusConfig) -> None:
        """Join open interfaces, in the order of `config.channels`."""
        self.parts = tuple(parts)
        self._routes = Routes(config)
        self._first = 0
        self.channel_info = " + ".join(str(part.channel_info) for part in parts)
        self.channel = "+".join(str(getattr(part, "channel", "can")) for part in parts)
        super().__init__(channel=self.channel)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame on its channels; one that refuses it keeps no other from it.

        Raises:
            Exception: as an interface that refuses.
        """
        with ExitStack() as sending:
            for place in reversed(self._routes.of(msg.arbitration_id, msg.data)):
                sending.callback(self.parts[place].send, msg, timeout)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame of any channel, none within the time [s]; channels take turns."""
        until = None if timeout is None else time.monotonic() + timeout
        while True:
            for _ in self.parts:
                self._first = (self._first + 1) % len(self.parts)
                message = self.parts[self._first].recv(0.0)
                if message is not None:
                    return message
            left = None if until is None else until - time.monotonic()
            if left is not None and left <= 0.0:
                return None
            wait_for_any(self.parts, left)

    @property
    def state(self) -> can.BusState:
        """The worst state of all channels."""
        return worst_state(self.parts)

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        for part in self.parts:
            part.state = new_state

    def shutdown(self) -> None:
        """Shut all interfaces down, whatever one of them raises."""
        super().shutdown()
        with ExitStack() as closing:
            for part in self.parts:
                closing.callback(part.shutdown)
