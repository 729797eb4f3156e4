"""The emulated bus as a python-can interface: `can.Bus(interface="legbench", channel=FILE)`.

Lock-step and threadless: time is virtual and passes only while somebody waits, in `recv` or in
`NetworkTime.wait_until`. The same calls give the same frames, time stamps included.
"""

import math
from pathlib import Path
from typing import final

import can
from can.typechecking import CanFilters

from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.network import PASSIVE, Network
from legbench.drives.emulated.network_time import NetworkTime
from legbench.drives.emulated.station import Station
from legbench.drives.errors import BusError
from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.transport.virtual_bus import VirtualBus
from legbench.errors import ConfigError

IDLE_NS = 1_000_000_000
"""Longest wait of `recv` without a time-out, as nothing else can happen in lock-step [ns]."""


@final
class LockstepBus(VirtualBus):
    """One master's port to an emulated bus.

    Attributes:
        network: the bus.
        timebase: its virtual time.
    """

    def __init__(
        self,
        channel: str = "hardware/leg.toml",
        can_filters: CanFilters | None = None,
        *,
        network: Network | None = None,
        tx_queue: int = 64,
        bitrate: int | None = None,
        **_others: object,
    ) -> None:
        """Plug into a network, or build one with stiff links from the bus file `channel`.

        The bitrate [bit/s] is that of the wire by default; at another one no frame passes.

        Raises:
            can.CanInitializationError: the bus file makes no sense.
        """
        if network is None:
            try:
                network = emulate(load_bus(Path(channel)))
            except ConfigError as error:
                raise can.CanInitializationError(str(error)) from error
        self.network = network
        self.timebase = NetworkTime(network)
        self._station = network.attach(tx_queue, bitrate)
        self.channel_info = f"emulated bus {channel}"
        self.channel = channel
        super().__init__(channel=channel, can_filters=can_filters)

    @property
    def station(self) -> Station:
        """Controller of this port."""
        return self._station

    @property
    def alone(self) -> bool:
        """Whether this is the only master, and nothing but drives hangs on the bus."""
        return self.network.alone(self._station)

    @property
    def state(self) -> can.BusState:
        """State of the controller by its error counters; setting `ACTIVE` restarts it."""
        errors = max(self.network.errors[self._station], self._station.unread)
        if self.network.off_bus(self._station):
            return can.BusState.ERROR
        return can.BusState.PASSIVE if errors >= PASSIVE else can.BusState.ACTIVE

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        if new_state is can.BusState.ACTIVE:
            self.network.recover(self._station)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Hand a frame to the controller; takes no time.

        Raises:
            can.CanOperationError: bus-off, or the queue is full.
        """
        frame = Frame(msg.arbitration_id, bytes(msg.data), msg.is_remote_frame, msg.is_extended_id)
        try:
            self.network.send(self._station, frame)
        except BusError as error:
            raise can.CanOperationError(str(error)) from error

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame that passes the filters; lets time pass until it comes."""
        span_ns = IDLE_NS if timeout is None else math.ceil(1e9 * max(0.0, timeout))
        until_ns = self.network.now_ns + span_ns
        received = self._station.received
        while True:
            if not received:
                self.network.advance(until_ns, self._station)
            if not received:
                return None
            at_ns, frame = received.popleft()
            message = can.Message(
                timestamp=1e-9 * at_ns,
                arbitration_id=frame.cob_id,
                is_extended_id=frame.extended,
                is_remote_frame=frame.remote,
                is_error_frame=frame.error,
                dlc=len(frame.data),
                data=frame.data,
                channel=self.channel,
            )
            if self._filters is None or self._matches_filters(message):
                return message

    def inject(self, frame: Frame) -> None:
        """Put a frame into the receive queue that was never on the wire, for tests."""
        self._station.received.append((self.network.now_ns, frame))

    @property
    def pending(self) -> int:
        """Frames received and not read yet."""
        return len(self._station.received)

    def shutdown(self) -> None:
        """Detach from the network."""
        if not self._is_shutdown:
            self.network.detach(self._station)
        super().shutdown()
