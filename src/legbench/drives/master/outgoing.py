"""The frames that a master sends after the process data of a cycle: commands, heartbeat, polls."""

from collections.abc import Callable, Sequence
from typing import Protocol, final

from legbench.drives.errors import BusError
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.port import Port
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.nmt import NmtState, heartbeat_frame
from legbench.drives.setup.config import BusConfig


class Poll(Protocol):
    """A request that is due in some cycles."""

    def due(self, cycle: int) -> Frame | None:
        """Request of this cycle, none if none is due."""
        ...


@final
class Outgoing:
    """Sender of what follows SYNC; a bus that fails is told to its owner, and nothing is raised."""

    def __init__(
        self,
        port: Port,
        config: BusConfig,
        axes: Sequence[AxisLink],
        polls: Sequence[Poll],
        failed: Callable[[BusError], None],
    ) -> None:
        """Prepare the frames; nothing is sent.

        Args:
            port: port of the bus.
            config: drives on the bus.
            axes: the drives.
            polls: requests that are sent beside the commands, now and then.
            failed: called with the error of a frame that could not be sent.
        """
        self._port, self._axes, self._polls, self._failed = port, axes, polls, failed
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

    def rest(self, due_ns: int, count: int) -> bool:
        """Send heartbeat and polls, where due; false if the bus failed.

        Args:
            due_ns: next tick of the grid [ns].
            count: number of this cycle, by which the polls take turns.
        """
        try:
            # The heartbeat follows the grid, not the cycles: silent ticks must not delay it.
            if due_ns >= self._beat_due_ns:
                self._port.send_frame(self._beat)
                self._beat_due_ns = due_ns + self._beat_ns
            for place, poll in enumerate(self._polls):
                frame = poll.due(count + place)
                if frame is not None:
                    self._port.send_frame(frame)
        except BusError as error:
            self._failed(error)
            return False
        return True
