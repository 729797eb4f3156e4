"""The frames that a master sends in every cycle: SYNC, commands and heartbeat."""

from collections.abc import Callable, Sequence
from typing import final

from legbench.drives.errors import BusError
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.port import Port
from legbench.drives.protocol.frame import SYNC_ID
from legbench.drives.protocol.nmt import NmtState, heartbeat_frame
from legbench.drives.setup.config import BusConfig


@final
class Outgoing:
    """Sender of cyclic frames; a bus that fails is told to its owner, and nothing is raised."""

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
        self._sync = port.message(SYNC_ID)
        beat = heartbeat_frame(config.master_id, NmtState.OPERATIONAL)
        self._beat = port.message(beat.cob_id, beat.data)
        self._beat_ns = 1_000_000 * config.master_heartbeat_ms
        self._beat_due_ns = 0
        self._commands = {
            cob_id: port.message(cob_id, bytes(size))
            for axis in axes
            for cob_id, size in axis.rpdo_sizes.items()
        }
        """COB-ID -> message of its true length, whose bytes are replaced in every cycle."""

    def begin(self, due_ns: int) -> None:
        """Place the next heartbeat one interval after a tick of the grid [ns]."""
        self._beat_due_ns = due_ns + self._beat_ns

    def sync(self) -> bool:
        """Send SYNC; false if the bus failed."""
        try:
            self._port.put(self._sync)
        except BusError as error:
            self._failed(error)
            return False
        return True

    def commands(self, controlwords: Sequence[int | None]) -> bool:
        """Send the RPDOs of all drives, which act at the next SYNC; false if the bus failed.

        A frame that is refused keeps no other drive from its own. A drive without a controlword
        gets no frame.

        Raises:
            ValueError: not one controlword, or none, for each drive.
        """
        if len(controlwords) != len(self._axes):
            raise ValueError(f"{len(controlwords)} controlwords for {len(self._axes)} drives")
        sent, messages, put = True, self._commands, self._port.put
        for place, controlword in enumerate(controlwords):
            if controlword is None:
                continue
            for cob_id, data in self._axes[place].frames(controlword):
                message = messages[cob_id]
                message.data[:] = data
                try:
                    put(message)
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
            self._port.put(self._beat)
        except BusError as error:
            self._failed(error)
            return False
        self._beat_due_ns = due_ns + self._beat_ns
        return True
