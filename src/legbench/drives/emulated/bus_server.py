"""Emulated drives on any python-can bus, paced by the machine's clock, such as a vcan."""

import errno
import time
from collections.abc import Callable
from contextlib import suppress
from typing import final

import can

from legbench.closing import Closing
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.pacer import Pacer
from legbench.drives.errors import BusError
from legbench.drives.protocol.frame import Frame


@final
class BusServer(Closing):
    """Stands between an emulated network, with the times of its wire, and a bus."""

    def __init__(
        self, network: Network, bus: can.BusABC, now_ns: Callable[[], int] = time.monotonic_ns
    ) -> None:
        """Plug in; the bus is closed with this."""
        self.network, self._bus = network, bus
        self._station = network.attach()
        self._pacer = Pacer(network, now_ns)

    def poll(self) -> None:
        """Wait a moment for frames, move them and time on.

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
        """The next frame; an interface that is taken down is a cable pulled, it may come back."""
        try:
            return self._bus.recv(timeout)
        except can.CanOperationError as error:
            if error.error_code != errno.ENETDOWN:
                raise
            return None

    def _take(self, message: can.Message) -> None:
        if message.is_error_frame:
            return
        frame = Frame(
            message.arbitration_id,
            bytes(message.data),
            message.is_remote_frame,
            message.is_extended_id,
        )
        try:
            self.network.send(self._station, frame)
        except BusError:
            # As on a real bus: a full queue or bus-off loses the frame.
            return

    def _give(self) -> None:
        while self._station.received:
            _, frame = self._station.received.popleft()
            if not frame.error:
                # As on a real bus: a full queue or a pulled cable loses the frame.
                with suppress(can.CanOperationError):
                    self._bus.send(
                        can.Message(
                            arbitration_id=frame.cob_id,
                            data=frame.data,
                            is_extended_id=frame.extended,
                            is_remote_frame=frame.remote,
                        )
                    )

    def close(self) -> None:
        """Unplug; may be called twice."""
        self._bus.shutdown()
