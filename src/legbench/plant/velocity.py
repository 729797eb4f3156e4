"""Velocities from encoders that are read at uneven times."""

import math
from collections.abc import Sequence
from typing import final

import numpy as np

from legbench.signals import Floats


@final
class VelocityEstimate:
    """Estimate of velocities: differences of positions over time, behind a first-order low-pass.

    The gain follows the interval: `1 - exp(-2 pi bandwidth dt)`, the exact response to an input
    that is constant over `dt`. An axis without a fresh reading keeps its velocity; its next
    difference is taken over the whole time since its last one.
    """

    def __init__(self, bandwidth: float, period: float) -> None:
        """Prepare for readings that mostly come a period apart.

        Args:
            bandwidth: corner frequency of the low-pass [Hz].
            period: usual interval [s]; its gain is computed once.
        """
        self._bandwidth, self._period = bandwidth, period
        self._usual_gain = self._gain_over(period)
        self._times_ns: list[int] = []
        self._positions: list[float] = []
        self._velocities: list[float] = []

    def reset(self, time_ns: int, positions: Sequence[float]) -> None:
        """Begin at rest with a reading of all axes at `time_ns` [ns], [rad]."""
        self._positions = list(positions)
        self._times_ns = [time_ns] * len(self._positions)
        self._velocities = [0.0] * len(self._positions)

    def update(self, time_ns: int, positions: Sequence[float], fresh: Sequence[bool]) -> Floats:
        """Take a reading at `time_ns` [ns] and return the velocities of all axes [rad/s].

        Args:
            time_ns: later than the last one; a reading of the same instant changes nothing.
            positions: of all axes [rad].
            fresh: whether each of them was read now, or repeats what was read before.
        """
        for axis, (position, is_new) in enumerate(zip(positions, fresh, strict=True)):
            elapsed_ns = time_ns - self._times_ns[axis]
            if not is_new or elapsed_ns <= 0:
                continue
            # Divided, not multiplied: whole milliseconds become the nearest number to them.
            interval = elapsed_ns / 1e9
            usual = interval == self._period
            gain = self._usual_gain if usual else self._gain_over(interval)
            last = self._velocities[axis]
            rate = (position - self._positions[axis]) / interval
            self._velocities[axis] = last + gain * (rate - last)
            self._positions[axis], self._times_ns[axis] = position, time_ns
        return np.array(self._velocities)

    def _gain_over(self, interval: float) -> float:
        return 1.0 - math.exp(-2.0 * math.pi * self._bandwidth * interval)
