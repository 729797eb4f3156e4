"""Emulated channels as one python-can interface, in lock-step: `SplitBus` in virtual time."""

import math
from typing import final

import can

from legbench.drives.emulated.bus import IDLE_NS, LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.shared_body import LockstepChannels
from legbench.drives.setup.config import BusConfig
from legbench.drives.transport.checked_bus import CheckedBus
from legbench.drives.transport.split_bus import Routes, worst_state
from legbench.drives.transport.virtual_bus import VirtualBus


@final
class ChannelsBus(CheckedBus, VirtualBus):
    """One master's ports to the emulated channels of a bus file.

    Attributes:
        networks: channels, in the order of `config.channels`.
        timebase: their virtual time.
    """

    def __init__(
        self, networks: tuple[Network, ...], config: BusConfig, bitrate: int | None = None
    ) -> None:
        """Plug into all networks, by default at their bitrate [bit/s]."""
        self.networks = networks
        self.timebase = self._time = LockstepChannels(networks)
        names = [str(channel) for channel in config.channels]
        self._parts = [
            LockstepBus(name, network=network, bitrate=bitrate)
            for name, network in zip(names, networks, strict=True)
        ]
        self._stations = [part.station for part in self._parts]
        self._routes = Routes(config)
        self.channel_info = f"emulated buses {' + '.join(names)}"
        self.channel = "+".join(names)
        super().__init__(channel=self.channel)

    @property
    def alone(self) -> bool:
        """Whether this is the only master on all channels."""
        return all(part.alone for part in self._parts)

    @property
    def state(self) -> can.BusState:
        """The worst state of all channels."""
        return worst_state(self._parts)

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        for part in self._parts:
            part.state = new_state

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Hand a frame to the controllers of its channels; takes no time.

        Raises:
            can.CanOperationError: one is bus-off, or its queue is full; the others have it.
        """
        refused: can.CanOperationError | None = None
        for place in self._routes.of(msg.arbitration_id, msg.data):
            try:
                self._parts[place].send(msg)
            except can.CanOperationError as error:
                refused = refused or error
        if refused is not None:
            raise refused

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame of any channel; lets time pass until it comes.

        Raises:
            can.CanOperationError: the bus is shut down.
        """
        self._check_open()
        span_ns = IDLE_NS if timeout is None else math.ceil(1e9 * max(0.0, timeout))
        if not any([station.received for station in self._stations]):
            self._time.advance(self._time.now_ns() + span_ns, self._stations)
        waiting = [part for part in self._parts if part.station.received]
        if not waiting:
            return None
        return min(waiting, key=lambda part: part.station.received[0][0]).recv(0.0)

    def shutdown(self) -> None:
        """Detach from all networks."""
        super().shutdown()
        for part in self._parts:
            part.shutdown()
