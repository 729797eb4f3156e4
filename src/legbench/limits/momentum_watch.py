"""Whether link encoders agree with springs and momentum, for a leg that sways; pure."""

import math
from collections import deque
from typing import final

from legbench.limits.knee import Range
from legbench.limits.momentum import (
    LegMomentum,
    LegMotion,
    MomentumReading,
    SupportPoint,
    left_over,
    motion_of,
)
from legbench.limits.plausibility import Doubt

CONTACT_TIME = 0.02
"""Time in which a touchdown or a lift-off is over; the foot of the paper's leg may bounce [s]."""
RUBBER = 0.01
"""Distance from a stop of rubber at which it may push already [rad]."""
NOISE_SHARE = 0.5
"""Share of the limit that rounded encoders may leave as noise [-]; it lasts for less than the
averages reach."""
LEARNING_TIME = 1.0
"""Time constant in which the mismatch of the springs is learned, and first time for it: two hops. A
leg that has only begun to sway is still watched by its sway [s]."""
MISMATCH = 0.06
"""Largest share by which both springs may differ from the design, each to another side [-]."""
WEIGHT_SHARE = 0.2
"""Torque on the knee that rules a support out, relative to what the weight can do there [-]: in the
middle of a stance the springs carry twice the weight, in flight they carry nothing."""


@final
class _Average:
    """Three moving averages over so many cycles, one after the other."""

    def __init__(self, cycles: int) -> None:
        self._stages = tuple(deque([0.0] * cycles, maxlen=cycles) for _ in range(3))
        self._sums = (0.0, 0.0, 0.0)
        self._share = 1.0 / cycles

    def after(self, value: float) -> float:
        """Take one more value; return the average."""
        first, second, third = self._stages
        sum_1, sum_2, sum_3 = self._sums
        share = self._share
        sum_1 += value - first[0]
        first.append(value)
        once = share * sum_1
        sum_2 += once - second[0]
        second.append(once)
        twice = share * sum_2
        sum_3 += twice - third[0]
        third.append(twice)
        self._sums = sum_1, sum_2, sum_3
        return share * sum_3


@final
class _SupportWatch:
    """Unexplained torque about one support, averaged.

    Attributes:
        cycles: cycles over which each of the three averages is taken.
        reach: cycles over which the averages reach.
    """

    def __init__(
        self, leg: LegMomentum, support: SupportPoint, torque: float, period: float
    ) -> None:
        self._support = support
        self.cycles = support.average_cycles(leg.link_step, NOISE_SHARE * torque, period)
        self.reach = 3 * self.cycles
        self.restart()

    def restart(self) -> None:
        """Begin to average anew."""
        self._polar, self._knee = _Average(self.cycles), _Average(self.cycles)

    def after(self, motion: LegMotion) -> tuple[float, float]:
        """Take one more motion; return the averages along q1 + q2 and along the knee [N m]."""
        polar, knee = left_over(self._support, motion)
        return self._polar.after(polar), self._knee.after(knee)


@final
class _Mismatch:
    """Springs that are stiffer or softer than the design says, as far as they differ.

    Torque that is unexplained in proportion to how far the springs are wound, for seconds, is
    theirs; an encoder that dies leaves a torque of its own. Least squares that forget.

    Attributes:
        share: unexplained torque per torque by which the springs are wound [-].
    """

    def __init__(self, torque: float, period: float) -> None:
        """Begin with springs as designed; those wound by less than a torque [N m] tell little."""
        self._memory, self._torque = round(LEARNING_TIME / period), torque
        self._least = torque**2
        self._seen, self._product, self._square = 0, 0.0, 0.0
        self.share = 0.0

    @property
    def known(self) -> bool:
        """Whether it has been learned for long enough."""
        return self._seen >= self._memory

    def learn(self, polar: float, wound: float) -> None:
        """Take what the likeliest support leaves unexplained in a cycle.

        Args:
            polar: torque along q1 + q2, infinite if the knee rules out all supports [N m].
            wound: torque by which the springs are wound [N m].
        """
        self._seen = min(self._seen + 1, self._memory)
        if abs(polar) > self._torque + MISMATCH * abs(wound):
            return  # That much is no spring's.
        gain = 1.0 / self._seen
        self._product += gain * (polar * wound - self._product)
        self._square += gain * (wound * wound - self._square)
        share = self._product / (self._square + self._least)
        self.share = min(max(share, -MISMATCH), MISMATCH)


@final
class MomentumWatch:
    """Looks for torque that no support of the leg explains.

    While the averages reach from the ground into the air, or back, no support explains all of it.
    So the torque must last for longer than it takes the other supports to explain it.

    Attributes:
        residual: smallest torque along q1 + q2 that a support leaves unexplained, of those that the
            knee does not rule out; infinite if it rules out all, none while averages fill [N m].
    """

    def __init__(self, leg: LegMomentum, link_error: float, period: float) -> None:
        """Watch over a leg.

        Args:
            leg: what its momentum obeys.
            link_error: angle by which a link encoder may be wrong [rad].
            period: of the cycles [s].
        """
        self._leg, self._link_error, self._period = leg, link_error, period
        self._torque = link_error * min(leg.stiffness)
        only = len(leg.supports) == 1
        weight = max(sum(map(abs, support.moment)) for support in leg.supports)
        # A leg that is always supported alike needs nothing to be ruled out.
        self._knee_torque = math.inf if only else WEIGHT_SHARE * weight
        self._supports = [
            _SupportWatch(leg, support, self._torque, period) for support in leg.supports
        ]
        self._lengths = sorted({one.cycles for one in self._supports})
        self._reach = max(one.reach for one in self._supports)
        contact = round(CONTACT_TIME / period)
        self._patiences = [
            contact + max(other.reach for other in self._supports if other is not one or only)
            for one in self._supports
        ]
        self.start()

    def start(self) -> None:
        """Begin anew with whatever is shown next, and forget the leg's springs."""
        self._mismatch = _Mismatch(self._torque, self._period)
        self._begin()

    def restart(self) -> None:
        """Begin anew with whatever is shown next, unless nothing has been seen yet."""
        if self._readings:
            self._begin()

    def _begin(self) -> None:
        self.residual: float | None = None
        self._readings = deque[MomentumReading](maxlen=3)
        for support in self._supports:
            support.restart()
        self._wound = {cycles: _Average(cycles) for cycles in self._lengths}
        self._seen = self._age = self._pushed = 0
        self._patience = max(self._patiences)

    def see(self, reading: MomentumReading, *, stands: bool = False) -> Doubt | None:
        """Look at one more cycle, in which every drive has told something new.

        Args:
            reading: of that cycle.
            stands: whether one link stands while the other one swings.
        """
        # A reading must have come about a period after the one before.
        regular = 0.5 * self._period < reading.interval < 1.5 * self._period
        if not (regular and _inside(reading.joint[0], self._leg.hip_range)):
            self.restart()
            return None
        self._readings.append(reading)
        if len(self._readings) < 3:
            return None
        if not _inside(reading.joint[1] - reading.joint[0], self._leg.knee_range):
            self._pushed = self._reach + 2
        elif self._pushed:
            self._pushed -= 1
        residual, patience = self._left(motion_of(self._leg, self._readings))
        self._seen += 1
        if self._seen < self._reach:
            return None
        self.residual = residual
        self._age += 1
        if residual <= self._torque:
            self._age, self._patience = 0, patience
        # A link that is thrown onto the ground, or off it, does not stand.
        lasts = self._age > (self._reach if stands else self._patience)
        return self._doubt() if lasts and self._mismatch.known else None

    def _left(self, motion: LegMotion) -> tuple[float, int]:
        """Smallest torque along q1 + q2 that a support leaves, and the longest patience of all.

        The torque is infinite where the knee rules all out. Patience is asked of those supports
        that leave no more than the limit; it is 0 if there are none [cycles].
        """
        wound = {cycles: average.after(motion.wound) for cycles, average in self._wound.items()}
        share, most = self._mismatch.share, math.inf if self._pushed else self._knee_torque
        patience = 0
        likeliest, torque = math.inf, (math.inf, 0.0)
        for support, cycles in zip(self._supports, self._patiences, strict=True):
            polar, knee = support.after(motion)
            by = wound[support.cycles]
            unexplained = abs(polar - share * by) if abs(knee) <= most else math.inf
            if cycles > patience and unexplained <= self._torque:
                patience = cycles
            if unexplained < likeliest:
                likeliest, torque = unexplained, (polar, by)
        if self._seen >= self._reach:
            self._mismatch.learn(*torque)
        return likeliest, patience

    def _doubt(self) -> Doubt:
        return Doubt(
            "joint encoder",
            "the springs' torques contradict the motion of the links, on the ground and in the air "
            f"alike, by more than {self._torque:.3f} N m for {self._age} cycles; the limit is a "
            f"link_error of {self._link_error:g} rad: look at the link encoders, at the springs' "
            "stiffness, and whether the foot slides",
        )


def _inside(angle: float, between: Range) -> bool:
    return between[0] + RUBBER < angle < between[1] - RUBBER
