"""What one support of a leg leaves unexplained, on average; pure."""

import math
from collections import deque
from typing import final

from legbench.limits.momentum import AVERAGE_SHARES, LegMomentum, LegMotion, SupportPoint, left_over

CONTACT_TIME = 0.02
"""Time in which a touchdown or a lift-off is over; the foot of the paper's leg may bounce [s]."""
FLIGHT_TIME = 0.01
"""Time for which torque of one sign is unexplained before a leg is doubted that is for certain in
flight, where nothing but its springs acts [s]."""
PATIENT_SHARE = 0.5
"""Shortest such time, relative to the reach of the averages [-]: a single step of an encoder leaves
torque of one sign for as long."""
NOISE_SHARE = 0.6
"""Share of the limit that rounded encoders may leave as noise [-]."""


@final
class MovingAverage:
    """Three moving averages, one after the other, that together reach over so many cycles."""

    def __init__(self, cycles: int) -> None:
        first, second = [round(share * cycles) for share in AVERAGE_SHARES]
        lengths = (first, second, cycles - first - second)
        self._stages = tuple(deque([0.0] * length, maxlen=length) for length in lengths)
        self._sums = (0.0, 0.0, 0.0)
        self._scale = 1.0 / math.prod(lengths)

    def after(self, value: float) -> float:
        """Take one more value; return the average."""
        first, second, third = self._stages
        sum_1, sum_2, sum_3 = self._sums
        sum_1 += value - first[0]
        first.append(value)
        sum_2 += sum_1 - second[0]
        second.append(sum_1)
        sum_3 += sum_2 - third[0]
        third.append(sum_2)
        self._sums = sum_1, sum_2, sum_3
        return self._scale * sum_3


@final
class SupportWatch:
    """Unexplained torque about one support, averaged.

    Attributes:
        reach: cycles over which the averages reach.
        patience: cycles of torque of one sign that it may leave while the leg has it for certain.
        pushed: a stop may push at the knee in one of them.
    """

    def __init__(
        self, leg: LegMomentum, support: SupportPoint, torque: float, period: float
    ) -> None:
        self._support = support
        self.reach = support.average_cycles(leg.link_step, NOISE_SHARE * torque, period)
        bears = FLIGHT_TIME if support is leg.supports[-1] else CONTACT_TIME
        self.patience = max(round(bears / period), round(PATIENT_SHARE * self.reach))
        self.restart()

    def restart(self) -> None:
        """Begin to average anew."""
        self._polar, self._knee = MovingAverage(self.reach), MovingAverage(self.reach)
        self._pushes = 0
        self.pushed = False

    def after(self, motion: LegMotion, *, free: bool) -> tuple[float, float]:
        """Take one more motion; return the averages along q1 + q2 and along the knee [N m].

        Args:
            motion: of the leg.
            free: whether its knee is free of its stops.
        """
        self._pushes = max(0, self._pushes - 1) if free else self.reach + 2
        self.pushed = self._pushes > 0
        polar, knee = left_over(self._support, motion)
        return self._polar.after(polar), self._knee.after(knee)
