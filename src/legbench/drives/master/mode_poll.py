"""The mode of a drive that shows it only once it is enabled, read by SDO beside the cycle; pure."""

from collections.abc import Sequence
from typing import final

from legbench.drives.errors import CodecError, SdoAbortError
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.protocol.cia402 import DriveState, Mode, decode_state
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import SDO_REQUEST_BASE, Frame
from legbench.drives.protocol.sdo_client import Progress, Upload
from legbench.drives.setup.config import BusConfig

EVERY_MS = 20
"""Time between two requests [ms]: within it a drive answers, and an answer that is lost is asked
for again."""
MODE = (0x6061, 0)


@final
class ModePoll:
    """Poll of 6061h from when a drive is enabled until it shows cyclic synchronous position mode.

    Drives that have shown their mode before are not asked.

    Attributes:
        every: cycles between two requests.
    """

    def __init__(self, axis: AxisLink, every_cycles: int = EVERY_MS) -> None:
        """Poll every so many cycles; by default of 1 ms each."""
        self._axis, self.every = axis, every_cycles
        self._upload: Upload | None = None

    def due(self, cycle: int) -> Frame | None:
        """SDO request of this cycle, none if none is due."""
        axis = self._axis
        if axis.in_mode or cycle % self.every:
            return None
        if decode_state(axis.statusword) is not DriveState.OPERATION_ENABLED:
            return None
        self._upload = Upload(*MODE)
        return Frame(SDO_REQUEST_BASE + axis.node.node_id, self._upload.request)

    def feed(self, data: bytes) -> None:
        """Take an SDO reply of the drive."""
        if self._upload is None:
            return
        try:
            if self._upload.feed(data) is not Progress.DONE:
                return
            mode = self._upload.value(DataType.INTEGER8)
        except (SdoAbortError, CodecError):
            mode = None
        self._upload = None
        self._axis.in_mode = mode == Mode.CYCLIC_SYNCHRONOUS_POSITION


def mode_polls(axes: Sequence[AxisLink], config: BusConfig) -> tuple[ModePoll, ...]:
    """Make the polls of all drives of a bus, in their order."""
    every_cycles = config.cycles_in(EVERY_MS)
    return tuple(ModePoll(axis, every_cycles) for axis in axes)
