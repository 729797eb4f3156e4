"""Emulated drives on any python-can buses, paced by the machine's clock, such as on vcan."""

import errno
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import final

import can

from legbench.closing import Closing
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.pacer import Pacer
from legbench.drives.emulated.shared_body import time_of
from legbench.drives.errors import BusError
from legbench.drives.transport.messages import frame_of, message_of
from legbench.drives.transport.split_bus import SplitBus, wait_for_any


@final
class BusPort:
    """Place where the frames of one emulated network pass to a bus, and those of the bus to it."""

    def __init__(self, network: Network, bus: can.BusABC) -> None:
        """Attach to a network and a bus."""
        self.network, self.bus = network, bus
        self._station = network.attach()

    def receive(self, timeout: float) -> can.Message | None:
        """Receive the next frame; an interface that is down counts as an unplugged cable."""
        try:
            return self.bus.recv(timeout)
        except can.CanOperationError as error:
            if error.error_code != errno.ENETDOWN:
                raise
            return None

    def take(self, message: can.Message | None) -> None:
        """Hand a frame of the bus to the network, and all others that have come."""
        while message is not None:
            # A full queue or bus-off loses the frame, as on a real bus; other frames than those of
            # classic CAN do not reach classic drives.
            with suppress(BusError, can.CanOperationError):
                self.network.send(self._station, frame_of(message))
            message = self.receive(0.0)

    def give(self) -> None:
        """Send the frames of the network on the bus."""
        while self._station.received:
            at_ns, frame, _ = self._station.received.popleft()
            if not frame.error:
                # A full queue or an unplugged cable loses the frame, as on a real bus.
                with suppress(can.CanOperationError):
                    self.bus.send(message_of(frame, 1e-9 * at_ns, ""))


@final
class BusServer(Closing):
    """Stands between emulated networks, with the times of their wires, and a bus for them."""

    def __init__(
        self,
        networks: Sequence[Network],
        bus: can.BusABC,
        now_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Attach to networks and a bus, which closes together with this server.

        Args:
            networks: emulated channels, which pass time together; no frame of one is on another.
            bus: interface for them, a `SplitBus` for several.
            now_ns: clock that paces the networks [ns].
        """
        self._bus = bus
        self._parts = bus.parts if isinstance(bus, SplitBus) else (bus,)
        self._ports = [
            BusPort(network, bus) for network, bus in zip(networks, self._parts, strict=True)
        ]
        self._pacer = Pacer(time_of(networks), now_ns)

    def poll(self) -> None:
        """Wait a moment for frames, pass them on and advance virtual time.

        Raises:
            BusError: a bus has failed.
        """
        port = self._ports[0]
        try:
            wait_s = self._pacer.wait_s()
            if len(self._ports) > 1:
                wait_for_any(self._parts, wait_s)
                wait_s = 0.0
            message = port.receive(wait_s)
            self._pacer.advance()
            port.take(message)
            for port in self._ports[1:]:
                port.take(port.receive(0.0))
            self._pacer.advance()
            for port in self._ports:
                port.give()
        except (can.CanError, OSError) as error:
            raise BusError(f"{port.bus.channel_info}: {error}") from error

    def close(self) -> None:
        """Close the bus; may be called twice."""
        self._bus.shutdown()
