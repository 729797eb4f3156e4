"""What the interfaces of this package do once they are shut down: refuse any use."""

from typing import Any

import can


class CheckedBus(can.BusABC):
    """Interface of python-can whose use after `shutdown` is an error."""

    _shut = False

    def _check_open(self) -> None:
        if self._shut:
            raise can.CanOperationError(f"{self.channel_info} is shut down")

    def send_periodic(self, *args: Any, **options: Any) -> can.broadcastmanager.CyclicSendTaskABC:
        """Send periodically as `can.BusABC.send_periodic` does, which takes the same arguments.

        Raises:
            can.CanOperationError: the bus is shut down.
        """
        self._check_open()
        return super().send_periodic(*args, **options)

    def shutdown(self) -> None:
        """End what is sent periodically, for the last time, and refuse any use from then on."""
        super().shutdown()
        self._shut = True
