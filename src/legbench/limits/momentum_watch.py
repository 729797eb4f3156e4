"""Whether link encoders agree with springs and momentum, for a leg that sways; pure."""

import math
from collections import deque
from collections.abc import Sequence
from typing import final

from legbench.limits.knee import Range
from legbench.limits.momentum import (
    LegMomentum,
    MomentumReading,
    SupportPoint,
    Unexplained,
    unexplained,
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
        self._stages = [deque([0.0] * cycles, maxlen=cycles) for _ in range(3)]
        self._sums = [0.0, 0.0, 0.0]
        self._share = 1.0 / cycles

    def after(self, value: float) -> float:
        """Take one more value; return the average."""
        for place, stage in enumerate(self._stages):
            self._sums[place] += value - stage[0]
            stage.append(value)
            value = self._share * self._sums[place]
        return value


@final
class _SupportWatch:
    """Unexplained torque about one support, averaged.

    Attributes:
        reach: cycles over which the averages reach.
    """

    def __init__(
        self, leg: LegMomentum, support: SupportPoint, torque: float, period: float
    ) -> None:
        self._leg, self._support = leg, support
        self._cycles = support.average_cycles(leg.link_step, NOISE_SHARE * torque, period)
        self.reach = 3 * self._cycles
        self.restart()

    def restart(self) -> None:
        """Begin to average anew."""
        self._averages = [_Average(self._cycles) for _ in Unexplained._fields]

    def after(self, readings: Sequence[MomentumReading]) -> Unexplained:
        """Take three readings; return the average."""
        torque = unexplained(self._leg, self._support, readings)
        both = zip(self._averages, torque, strict=True)
        return Unexplained(*[average.after(value) for average, value in both])


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
        self._seen, self._product, self._square = 0, 0.0, 0.0
        self.share = 0.0

    @property
    def known(self) -> bool:
        """Whether it has been learned for long enough."""
        return self._seen >= self._memory

    def learn(self, torque: Unexplained | None) -> None:
        """Take what the likeliest support leaves unexplained; none if the knee rules out all."""
        self._seen = min(self._seen + 1, self._memory)
        if torque is None or abs(torque.polar) > self._torque + MISMATCH * abs(torque.wound):
            return  # That much is no spring's.
        gain = 1.0 / self._seen
        self._product += gain * (torque.polar * torque.wound - self._product)
        self._square += gain * (torque.wound * torque.wound - self._square)
        share = self._product / (self._square + self._torque**2)
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
        """Begin anew with whatever is shown next; a watch that has seen nothing yet already does.

        A leg that does not sway asks for this in every cycle.
        """
        if self._readings:
            self._begin()

    def _begin(self) -> None:
        self.residual: float | None = None
        self._readings = deque[MomentumReading](maxlen=3)
        for support in self._supports:
            support.restart()
        self._seen = self._age = self._pushed = 0
        self._patience = max(self._patiences)

    def see(self, reading: MomentumReading, *, stands: bool = False) -> Doubt | None:
        """Look at one more cycle, in which every drive has told something new.

        Args:
            reading: of that cycle.
            stands: whether one link stands while the other one swings.
        """
        if not (self._regular(reading) and _inside(reading.joint[0], self._leg.hip_range)):
            self.restart()
            return None
        self._readings.append(reading)
        if len(self._readings) < 3:
            return None
        free = _inside(reading.joint[1] - reading.joint[0], self._leg.knee_range)
        self._pushed = max(0, self._pushed - 1) if free else self._reach + 2
        left = self._left()
        self._seen += 1
        if self._seen < self._reach:
            return None
        self.residual = min(left)
        self._age += 1
        if self.residual <= self._torque:
            self._age = 0
            each = zip(left, self._patiences, strict=True)
            self._patience = max(cycles for torque, cycles in each if torque <= self._torque)
        # A link that is thrown onto the ground, or off it, does not stand.
        lasts = self._age > (self._reach if stands else self._patience)
        return self._doubt() if lasts and self._mismatch.known else None

    def _left(self) -> list[float]:
        """Torques along q1 + q2 that the supports leave; infinite where the knee rules one out."""
        torques = [support.after(self._readings) for support in self._supports]
        share, most = self._mismatch.share, math.inf if self._pushed else self._knee_torque
        left = [
            abs(torque.polar - share * torque.wound) if abs(torque.knee) <= most else math.inf
            for torque in torques
        ]
        likeliest = min(left)
        if self._seen >= self._reach:
            explains = likeliest < math.inf
            self._mismatch.learn(torques[left.index(likeliest)] if explains else None)
        return left

    def _doubt(self) -> Doubt:
        return Doubt(
            "joint encoder",
            "the springs' torques contradict the motion of the links, on the ground and in the air "
            f"alike, by more than {self._torque:.3f} N m for {self._age} cycles; the limit is a "
            f"link_error of {self._link_error:g} rad: look at the link encoders, at the springs' "
            "stiffness, and whether the foot slides",
        )

    def _regular(self, reading: MomentumReading) -> bool:
        """Whether a reading came about a period after the one before."""
        return 0.5 * self._period < reading.interval < 1.5 * self._period


def _inside(angle: float, between: Range) -> bool:
    return between[0] + RUBBER < angle < between[1] - RUBBER
