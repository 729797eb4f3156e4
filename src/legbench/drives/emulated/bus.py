"""The emulated bus as a python-can interface: `can.Bus(interface="legbench", channel=FILE)`.

Lock-step and threadless: time is virtual and passes only while somebody waits, in `recv` or in
`NetworkTime.wait_until`. The same calls give the same frames, time stamps included. Programs that
receive in a thread, such as python-can's `Notifier`, may do so; their order is then up to threads.
"""

import math
import time
from pathlib import Path
from typing import final

import can
from can.typechecking import CanFilters

from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.network import PASSIVE, Network
from legbench.drives.emulated.network_time import NetworkTime
from legbench.drives.emulated.station import Heard, Station
from legbench.drives.errors import BusError
from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.transport.checked_bus import CheckedBus
from legbench.drives.transport.messages import frame_of, message_of, refuse_fd
from legbench.drives.transport.virtual_bus import VirtualBus
from legbench.errors import ConfigError
from legbench.shipped import locate

IDLE_NS = 1_000_000_000
"""Time that passes at once while `recv` waits without a time-out [ns]."""
YIELD_S = 1e-3
"""Pause of such a wait, in which another thread may send [s]."""
LOOK_NS = 50_000
"""Time after which a sender who waits for room looks again: the shortest frame at 1 Mbit/s [ns]."""


@final
class LockstepBus(CheckedBus, VirtualBus):
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
        receive_own_messages: bool = False,
        fd: bool = False,
        single_handle: bool = False,
    ) -> None:
        """Plug into a network, or build one with stiff links from a bus file.

        Args:
            channel: the bus file.
            can_filters: frames to receive; by default all.
            network: the network, instead of one of its own.
            tx_queue: number of frames that the controller takes before they are on the wire.
            bitrate: bitrate of this controller; by default that of the wire [bit/s]. At another
                one no frame passes.
            receive_own_messages: receive the frames that are sent here, when they were on the wire.
            fd: flexible data rate, which these buses do not have.
            single_handle: without effect; python-can's programs give it to every interface.

        Raises:
            can.CanInitializationError: the bus file makes no sense, or `fd` is set.
        """
        refuse_fd(fd)
        if network is None:
            try:
                network = emulate(load_bus(locate(Path(channel))))
            except ConfigError as error:
                raise can.CanInitializationError(str(error)) from error
        self.network = network
        self.timebase = NetworkTime(network)
        self._station = network.attach(tx_queue, bitrate, echo=receive_own_messages)
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
        if self.network.off_bus(self._station):
            return can.BusState.ERROR
        passive = self.network.level(self._station) >= PASSIVE
        return can.BusState.PASSIVE if passive else can.BusState.ACTIVE

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        if new_state is not can.BusState.ACTIVE:
            raise NotImplementedError(f"{new_state.name} cannot be set, only ACTIVE")
        self.network.recover(self._station)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Hand a frame to the controller; lets time pass only to wait for room, up to `timeout`.

        Raises:
            can.CanOperationError: bus-off, the queue is full, or this is no frame of classic CAN.
        """
        self._check_open()
        frame = frame_of(msg)
        with self.network.lock:
            if timeout and not self.network.takes(self._station):
                self._wait_for_room(math.ceil(1e9 * timeout))
            try:
                self.network.send(self._station, frame)
            except BusError as error:
                raise can.CanOperationError(str(error)) from error

    def _wait_for_room(self, span_ns: int) -> None:
        network, until_ns = self.network, self.network.now_ns + span_ns
        while not network.takes(self._station) and network.now_ns < until_ns:
            network.advance(min(until_ns, network.now_ns + LOOK_NS))

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame that passes the filters; lets time pass until it comes.

        Raises:
            can.CanOperationError: the bus is shut down.
        """
        if timeout is not None:
            return self._recv_within(math.ceil(1e9 * timeout) if timeout > 0.0 else 0)
        while (message := self._recv_within(IDLE_NS)) is None:
            time.sleep(YIELD_S)
        return message

    def _recv_within(self, span_ns: int) -> can.Message | None:
        self._check_open()
        network, received = self.network, self._station.received
        with network.lock:
            until_ns = network.now_ns + span_ns
            while True:
                if not received:
                    network.advance(until_ns, self._station)
                if not received:
                    return None
                at_ns, frame, own = received.popleft()
                message = message_of(frame, 1e-9 * at_ns, self.channel, own=own)
                if self._filters is None or self._matches_filters(message):
                    return message

    def inject(self, frame: Frame) -> None:
        """Put a frame into the receive queue that was never on the wire, for tests."""
        self._station.received.append(Heard(self.network.now_ns, frame))

    @property
    def pending(self) -> int:
        """Frames received and not read yet."""
        return len(self._station.received)

    def shutdown(self) -> None:
        """End what is sent periodically and detach from the network."""
        attached = not self._shut
        super().shutdown()
        if attached:
            with self.network.lock:
                self.network.detach(self._station)
