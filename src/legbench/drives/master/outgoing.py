"""The frames that a master sends after the process data of a cycle: commands and heartbeat."""

from collections.abc import Callable, Sequence
from typing import final

from legbench.drives.errors import BusError
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.port import Port
from legbench.drives.protocol.nmt import NmtState, heartbeat_frame
from legbench.drives.setup.config import BusConfig


@final
class Outgoing:
    """Sender of what follows SYNC; a bus that fails is told to its owner, and nothing is raised."""

    def __init__(
        self,
        port: Port,
        config: BusConfig,
        axes: Sequence[AxisLink],
        failed: Callable[[BusError], None],
    ) -> None:
        """Prepare the frames; nothing is sent.

        Args:
            port: port of the bus.
            config: drives on the bus.
            axes: the drives.
            failed: called with the error of a frame that could not be sent.
        """
        self._port, self._axes, self._failed = port, axes, failed
        self._beat = heartbeat_frame(config.master_id, NmtState.OPERATIONAL)
        self._beat_ns = 1_000_000 * config.master_heartbeat_ms
        self._beat_due_ns = 0
        self._commands = {cob_id: port.message(cob_id) for axis in axes for cob_id in axis.rpdo_ids}

    def begin(self, due_ns: int) -> None:
        """Place the next heartbeat one interval after a tick of the grid [ns]."""
        self._beat_due_ns = due_ns + self._beat_ns

    def commands(self, controlwords: Sequence[int | None]) -> bool:
        """Send the RPDOs of all drives, which act at the next SYNC; false if the bus failed.

        A frame that is refused keeps no other drive from its own. A drive without a controlword
        gets no frame.
        """
        sent = True
        for axis, controlword in zip(self._axes, controlwords, strict=True):
            if controlword is None:
                continue
            for cob_id, data in axis.frames(controlword):
                message = self._commands[cob_id]
                message.data = bytearray(data)
                message.dlc = len(data)
                try:
                    self._port.put(message)
                except BusError as error:
                    self._failed(error)
                    sent = False
        return sent

    def heartbeat(self, due_ns: int) -> bool:
        """Send the heartbeat, if it is due at the next tick of the grid [ns]; false if it failed.

        It follows the grid, not the cycles: silent ticks must not delay it.
        """
        if due_ns < self._beat_due_ns:
            return True
        try:
            self._port.send_frame(self._beat)
        except BusError as error:
            self._failed(error)
            return False
        self._beat_due_ns = due_ns + self._beat_ns
        return True
