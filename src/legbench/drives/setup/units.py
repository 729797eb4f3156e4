"""Encoder counts <-> radians of one axis, and positions that wrap."""

import math
from dataclasses import dataclass, field
from typing import final

from legbench.errors import ConfigError

MOST_COUNTS = 1 << 31
"""First count beyond the range of a 32-bit position object [counts]."""
LEAST_GEAR = 1e-4
"""Smallest gear ratio of a joint [-]; the largest is its inverse."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisUnits:
    """How an encoder counts an angle: `counts = offset + sign gear counts_per_rev angle / 2 pi`.

    Raises:
        ConfigError: a number of counts, a gear or a sign that no axis has.
    """

    counts_per_rev: int
    """Number of counts for one turn of the encoder's own shaft."""
    gear: float = 1.0
    """Turns of the encoder's shaft for one turn of the axis."""
    sign: int = 1
    """Direction of counting: 1, or -1 for a mirrored axis."""
    offset_counts: int = 0
    """Count that the encoder shows at angle 0."""
    bits: int = 32
    """Length of the position object, which wraps at 2^bits [bits]."""
    counts_per_rad: float = field(init=False)
    """Counts for one radian of the axis, negative for a mirrored one [counts/rad]."""

    def __post_init__(self) -> None:
        if not 0 < self.counts_per_rev <= MOST_COUNTS:
            raise ConfigError(
                f"counts_per_rev is {self.counts_per_rev}; it must be positive and at most "
                f"{MOST_COUNTS}"
            )
        if not LEAST_GEAR <= self.gear <= 1.0 / LEAST_GEAR:
            raise ConfigError(
                f"gear is {self.gear:g}; it must be positive, {LEAST_GEAR:g} to "
                f"{1.0 / LEAST_GEAR:g}, the sign is 'sign'"
            )
        if not abs(self.offset_counts) < MOST_COUNTS:
            raise ConfigError(
                f"offset_counts is {self.offset_counts}; a position object of 32 bits shows less "
                f"than {MOST_COUNTS} either way"
            )
        if self.sign not in (-1, 1):
            raise ConfigError(f"sign is {self.sign}; it must be 1 or -1")
        if self.bits not in (16, 32):
            raise ConfigError(f"bits is {self.bits}; a position object has 16 or 32")
        scale = self.sign * self.gear * self.counts_per_rev / (2.0 * math.pi)
        object.__setattr__(self, "counts_per_rad", scale)

    @property
    def resolution(self) -> float:
        """Angle of one count [rad]."""
        return 1.0 / abs(self.counts_per_rad)

    def to_rad(self, counts: int) -> float:
        """Angle of a count, which may lie beyond the object's range [rad]."""
        return (counts - self.offset_counts) / self.counts_per_rad

    def to_counts(self, angle: float) -> int:
        """Nearest count of an angle [rad], not wrapped."""
        return self.offset_counts + round(angle * self.counts_per_rad)


def wrap(counts: int, bits: int = 32) -> int:
    """A count as the signed position object shows it."""
    half = 1 << (bits - 1)
    return (counts + half & (1 << bits) - 1) - half


def unwrap(shown: int, near: int, bits: int = 32) -> int:
    """The count that shows as `shown` and lies closest to `near`."""
    return near + wrap(shown - near, bits)


@final
class Unwrapper:
    """Follows a wrapping position object across its seam."""

    def __init__(self, bits: int, near: int) -> None:
        self._half, self._mask = 1 << (bits - 1), (1 << bits) - 1
        self.counts = near

    def feed(self, shown: int) -> int:
        """The unwrapped count: `unwrap` without its calls, four times a cycle."""
        half = self._half
        near = self.counts
        self.counts = near + ((shown - near + half) & self._mask) - half
        return self.counts
