"""A drive's temperature, read by SDO beside the cycle, one frame now and then; pure."""

import math
from typing import final

from legbench.drives.errors import CodecError, SdoAbortError
from legbench.drives.protocol.frame import SDO_REQUEST_BASE, Frame
from legbench.drives.protocol.sdo_client import Progress, Upload
from legbench.drives.setup.config import BusConfig, NodeConfig

EVERY_MS = 200
"""Time between two requests of a temperature [ms]."""


@final
class TemperaturePoll:
    """Poll of a drive's temperature every `EVERY_MS`; an unanswered request is repeated.

    Attributes:
        every: cycles between two requests.
        celsius: last temperature, none before or where the bus file names no object [deg C].
        unanswered: requests in a row that brought no temperature.
    """

    def __init__(self, node: NodeConfig, every_cycles: int = EVERY_MS) -> None:
        """Poll every so many cycles; by default of 1 ms each."""
        self.every = every_cycles
        self._object, self._scale = node.temperature_object, node.temperature_scale
        self._request_id = SDO_REQUEST_BASE + node.node_id
        self._upload: Upload | None = None
        self._waiting = False
        self.celsius: float | None = None
        self.unanswered = 0

    def due(self, cycle: int) -> Frame | None:
        """SDO request of this cycle, none if none is due."""
        if self._object is None or cycle % self.every:
            return None
        if self._waiting:
            self.unanswered += 1
        self._waiting = True
        self._upload = Upload(self._object.index, self._object.sub)
        return Frame(self._request_id, self._upload.request)

    def feed(self, data: bytes) -> None:
        """Take an SDO reply of the drive."""
        if self._upload is None or self._object is None:
            return
        try:
            if self._upload.feed(data) is not Progress.DONE:
                return
            value = self._upload.value(self._object.kind)
        except (SdoAbortError, CodecError):
            self._upload = None
            return
        self._upload = None
        if isinstance(value, int | float) and math.isfinite(value):
            self.take(value)

    def take(self, value: float) -> None:
        """Take a reading of the temperature object [counts]."""
        self.celsius = self._scale * value
        self._waiting, self.unanswered = False, 0


def temperature_polls(config: BusConfig) -> tuple[TemperaturePoll, ...]:
    """Make the polls of all drives of a bus, in their order."""
    every_cycles = config.cycles_in(EVERY_MS)
    return tuple(TemperaturePoll(node, every_cycles) for node in config.nodes)
