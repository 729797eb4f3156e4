"""Encoder counts <-> radians of one axis, and positions that wrap."""

import math
from dataclasses import dataclass, field

from legbench.errors import ConfigError

MOST_COUNTS = 1 << 31
"""First count beyond the range of a 32-bit position object [counts]."""
FEWEST_COUNTS = 16
"""Fewest counts after which a position repeats [counts]."""
LENGTHS = (8, 16, 32, 64)
"""Lengths of the position objects that there are [bits]."""
LEAST_GEAR = 1e-4
"""Smallest gear ratio of a joint [-]; the largest is its inverse."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisUnits:
    """Units of one axis: `counts = offset + sign gear counts_per_rev angle / 2 pi`.

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
    """Length of the position object [bits]."""
    modulus_counts: int | None = None
    """Counts after which the position repeats, such as 4096 of a 12-bit encoder of a single turn;
    by default all that the object holds, 2^bits [counts]."""
    lowest_count: int | None = None
    """Lowest count that the object shows; by default 0 with a modulus, else -2^(bits - 1), that of
    a signed object [counts]."""
    counts_per_rad: float = field(init=False)
    """Counts for one radian of the axis, negative for a mirrored one [counts/rad]."""
    modulus: int = field(init=False, repr=False, compare=False)
    """Counts after which the position repeats."""
    lowest: int = field(init=False, repr=False, compare=False)
    """Lowest count that the position object shows."""

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
        most = max(MOST_COUNTS, 1 << self.bits - 1) if self.bits in LENGTHS else MOST_COUNTS
        if not abs(self.offset_counts) < most:
            raise ConfigError(
                f"offset_counts is {self.offset_counts}; a position object of {self.bits} bits "
                f"shows less than {most} either way"
            )
        if self.sign not in (-1, 1):
            raise ConfigError(f"sign is {self.sign}; it must be 1 or -1")
        if self.bits not in LENGTHS:
            raise ConfigError(
                f"bits is {self.bits}; a position object has {', '.join(map(str, LENGTHS))}"
            )
        self._set_window()
        scale = self.sign * self.gear * self.counts_per_rev / (2.0 * math.pi)
        object.__setattr__(self, "counts_per_rad", scale)

    def _set_window(self) -> None:
        """Set the counts that the object shows, refusing those that none of this length does."""
        half = 1 << self.bits - 1
        modulus = 2 * half if self.modulus_counts is None else self.modulus_counts
        low = -half if self.modulus_counts is None else 0
        if self.lowest_count is not None:
            low = self.lowest_count
        if not FEWEST_COUNTS <= modulus <= 2 * half:
            raise ConfigError(
                f"modulus_counts is {modulus}; an object of {self.bits} bits repeats after "
                f"{FEWEST_COUNTS} to {2 * half} counts"
            )
        if not -half <= low <= 2 * half - modulus:
            raise ConfigError(
                f"lowest_count is {low}; an object of {self.bits} bits that repeats after "
                f"{modulus} counts begins at {-half} to {2 * half - modulus}"
            )
        object.__setattr__(self, "modulus", modulus)
        object.__setattr__(self, "lowest", low)

    @property
    def lap(self) -> float:
        """Angle after which the position repeats [rad]."""
        return self.modulus * self.resolution

    def show(self, counts: int) -> int:
        """A count as the position object shows it: within one lap from its lowest count."""
        low = self.lowest
        return low + (counts - low) % self.modulus

    def nearest(self, shown: int, near: int) -> int:
        """The count that shows as `shown` and lies closest to `near`."""
        half = self.modulus // 2
        return near + (shown - near + half) % self.modulus - half

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
