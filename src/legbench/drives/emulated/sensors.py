"""Readings of the two encoders of an emulated axis, and their faults; pure."""

from enum import Enum
from typing import final

from legbench.drives.setup.config import NodeConfig

SECOND_NS = 1_000_000_000


class SensorFault(Enum):
    """Kinds of fault that an encoder may have."""

    FROZEN = "frozen"
    """The encoder keeps its last value."""
    STEP = "step"
    """The encoder's reading jumps by an angle from one sample to the next [rad]."""
    DRIFT = "drift"
    """The encoder's reading drifts away at a constant speed [rad/s]."""


_FROZEN, _STEP, _DRIFT = SensorFault.FROZEN, SensorFault.STEP, SensorFault.DRIFT


@final
class Encoder:
    """Encoder that turns true counts into shown counts, with its fault if it has one.

    The position loop of the emulated drive goes on with the true position: a fault changes the
    reading, not the motion.
    """

    def __init__(self, counts_per_rad: float) -> None:
        """Make an encoder without a fault."""
        self._counts_per_rad = counts_per_rad
        self._ailment: SensorFault | None = None
        self._size = self._offset = self._noise = 0.0
        self._shown = 0

    def fail(self, ailment: SensorFault | None, size: float = 0.0) -> None:
        """Fail from now on, by an angle [rad] or a speed [rad/s]; None heals."""
        self._ailment, self._size, self._offset = ailment, size, 0.0

    def tick(self, step_ns: int) -> None:
        """Advance the time of the fault [ns]."""
        if self._ailment is _DRIFT:
            self._offset += self._size * step_ns / SECOND_NS
        elif self._ailment is _STEP:
            self._offset = self._size

    def disturb(self, error: float) -> None:
        """Read wrong by an angle from now on, beside any fault [rad]."""
        self._noise = error

    def show(self, counts: int) -> int:
        """Return the reading for a true position [counts]."""
        if self._ailment is not _FROZEN:
            error = self._offset + self._noise
            self._shown = counts + round(error * self._counts_per_rad) if error else counts
        return self._shown


@final
class Sensors:
    """Both encoders of an axis.

    Attributes:
        motor: encoder of the motor.
        link: encoder of the link.
    """

    def __init__(self, node: NodeConfig) -> None:
        """Take the resolutions from the bus file."""
        self.motor = Encoder(node.motor.counts_per_rad)
        self.link = Encoder((node.link or node.motor).counts_per_rad)

    def tick(self, step_ns: int) -> None:
        """Advance the time of the fault [ns]."""
        self.motor.tick(step_ns)
        self.link.tick(step_ns)
