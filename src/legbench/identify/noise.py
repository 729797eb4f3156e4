"""Precision of an encoder, measured from what it recorded: its count and its noise.

A sixth difference removes every motion of a leg (0.3 rad at 5 Hz leave 1e-10 rad at 1 kHz) and
keeps white noise, whose variance it multiplies by 924. The median of its size is not moved by
the few rows about a step of the motors.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from legbench.signals import Floats

ORDER: Final = 6
"""Order of the difference that separates noise from motion [-]."""
GAIN: Final = math.comb(2 * ORDER, ORDER)
"""Sum of the squares of that difference's coefficients [-]."""
NORMAL: Final = 0.6744897501960817
"""Median of the size of a standard normal number [-]."""
FLOOR: Final = 2e-5
"""Smallest standard deviation that a fit believes [rad]: equations and simulation of a leg with
bars agree to 8e-6 rad in a step and to 1.5e-5 rad in a chirp."""
FINEST: Final = 1e-6
"""Finest count that is looked for [rad]: six million counts a revolution."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Precision:
    """Precision of one encoder."""

    sigma: float
    """Standard deviation of a reading, of its rounding too [rad]."""
    count: float
    """Angle of one count [rad]; zero: no count can be seen."""

    def counting(self, count: float) -> "Precision":
        """Return this precision with a count [rad] that was not seen in the readings."""
        if self.count > 0.0:
            return self
        return Precision(sigma=max(self.sigma, count / math.sqrt(12.0)), count=count)


def precision_of(values: Floats, noise: float | None = None) -> Precision:
    """Measure the precision of an encoder from its readings (n,) [rad].

    Args:
        values: one reading a row.
        noise: standard deviation, where it is known [rad].
    """
    count = count_of(values)
    rounding = count / math.sqrt(12.0)
    if noise is not None:
        return Precision(sigma=max(math.hypot(noise, rounding), FLOOR), count=count)
    rough = np.abs(np.diff(values, ORDER))
    white = float(np.median(rough)) / NORMAL / math.sqrt(GAIN) if len(rough) else 0.0
    return Precision(sigma=max(white, rounding, FLOOR), count=count)


def count_of(values: Floats) -> float:
    """Angle of one count [rad], of which all readings (n,) are whole multiples; zero if there is
    none.
    """
    levels = np.unique(values)
    if len(levels) < 3:
        return 0.0
    gaps = np.diff(levels)
    count = float(gaps.min())
    if count < FINEST:
        return 0.0
    multiples = gaps / count
    return count if bool(np.all(np.abs(multiples - np.round(multiples)) < 1e-3)) else 0.0
