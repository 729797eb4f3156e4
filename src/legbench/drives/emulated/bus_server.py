"""Emulated drives on any python-can bus, paced by the machine's clock, such as a vcan."""

import errno
import time
from collections.abc import Callable
from contextlib import suppress
from typing import final

import can

from legbench.closing import Closing
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.network_time import NetworkTime
from legbench.drives.emulated.pacer import Pacer
from legbench.drives.errors import BusError
from legbench.drives.transport.messages import frame_of, message_of


@final
class BusServer(Closing):
    """Stands between an emulated network, with the times of its wire, and a bus."""

    def __init__(
        self, network: Network, bus: can.BusABC, now_ns: Callable[[], int] = time.monotonic_ns
    ) -> None:
        """Attach to a network and a bus, which closes together with this server."""
        self.network, self._bus = network, bus
        self._station = network.attach()
        self._pacer = Pacer(NetworkTime(network), now_ns)

    def poll(self) -> None:
        """Wait a moment for frames, pass them on and advance virtual time.

        Raises:
            BusError: the bus has failed.
        """
        try:
            message = self._receive(self._pacer.wait_s())
            self._pacer.advance()
            while message is not None:
                self._take(message)
                message = self._receive(0.0)
            self._pacer.advance()
            self._give()
        except (can.CanError, OSError) as error:
            raise BusError(f"{self._bus.channel_info}: {error}") from error

    def _receive(self, timeout: float) -> can.Message | None:
        """Receive the next frame; an interface that is down counts as an unplugged cable."""
        try:
            return self._bus.recv(timeout)
        except can.CanOperationError as error:
            if error.error_code != errno.ENETDOWN:
                raise
            return None

    def _take(self, message: can.Message) -> None:
        # A full queue or bus-off loses the frame, as on a real bus; other frames than those of
        # classic CAN do not reach classic drives.
        with suppress(BusError, can.CanOperationError):
            self.network.send(self._station, frame_of(message))

    def _give(self) -> None:
        while self._station.received:
            at_ns, frame, _ = self._station.received.popleft()
            if not frame.error:
                # A full queue or an unplugged cable loses the frame, as on a real bus.
                with suppress(can.CanOperationError):
                    self._bus.send(message_of(frame, 1e-9 * at_ns, ""))

    def close(self) -> None:
        """Close the bus; may be called twice."""
        self._bus.shutdown()
