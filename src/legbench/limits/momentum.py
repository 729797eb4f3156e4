"""Whether link encoders agree with the springs: balance of the leg's angular momentum; pure.

A leg that sways by 0.2 rad from hop to hop hides an encoder that drifts by as much. But however it
sways, the angular momentum of its links about a point changes by the torques of springs, damping
and weight alone, if that point is the foot on the ground, the trunk that is held, or in flight the
centre of mass. An encoder that is wrong by an angle makes its spring's torque wrong by stiffness
times that angle, and this torque is then unexplained about each of these points.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, final

from legbench.limits.knee import Range
from legbench.limits.plausibility import Doubt

AVERAGE_TIME = 0.006
"""Shortest time of each of the three moving averages [s]; coarse encoders need a longer one."""
CONTACT_TIME = 0.02
"""Time in which a touchdown or a lift-off is over; the foot of the paper's leg may bounce [s]."""
RUBBER = 0.01
"""Distance from a stop of rubber at which it may push already [rad]."""
WEIGHT_SHARE = 0.2
"""Torque on the knee that rules a support out, relative to what the weight can do there [-]: in the
middle of a stance the springs carry twice the weight, in flight they carry nothing."""

Pair = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Support:
    """Constants of q1 and q2 about a point, in the form of Appendix I: `M qddot + C + g = tau`."""

    inertia: Pair
    """Inertias of q1 and q2 [kg m^2]."""
    coupling: float
    """Coupling of the two inertias at q1 = q2 [kg m^2]."""
    moment: Pair
    """Moments of gravity about q1 and q2 at sin(q) = 1 [N m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LegMomentum:
    """What the angular momentum of a leg obeys, for each way in which it may be supported."""

    stiffness: Pair
    """Stiffness of the series springs [N m/rad]."""
    damping: Pair
    """Viscous damping of q1 and q2 [N m s/rad]."""
    supports: tuple[Support, ...]
    """Supports between which the leg may change, such as the ground and free fall."""
    hip_range: Range
    """Range of q1 between its stops [rad]."""
    knee_range: Range
    """Range of q2 - q1 between its stops [rad]."""
    link_step: float = 0.0
    """Smallest step that the link encoders can show [rad]."""

    def average_cycles(self, torque: float, period: float) -> int:
        """Return over how many cycles to average, so that rounding leaves less than a torque.

        Second differences of readings that are rounded to steps `s`, averaged three times over n
        cycles T, scatter by `sqrt(12 / n^5) (s / sqrt(12)) / T^2` on two joints.

        Args:
            torque: standard deviation that rounding may leave [N m].
            period: of the cycles [s].
        """
        heaviest = max(max(one.inertia) + abs(one.coupling) for one in self.supports)
        needed = (heaviest * self.link_step / (torque * period**2)) ** 0.4
        return max(2, round(AVERAGE_TIME / period), math.ceil(needed))


class Reading(NamedTuple):
    """What the encoders of a leg showed in one cycle."""

    interval: float
    """Time since the reading before [s]."""
    motor: Pair
    """Motor positions [rad]."""
    joint: Pair
    """Link angles q1, q2 [rad]."""


class Unexplained(NamedTuple):
    """Torque that neither springs nor damping nor weight explain."""

    polar: float
    """On q1 and q2 together [N m]."""
    knee: float
    """On q2 less on q1; the push of a knee stop is part of it [N m]."""


def unexplained(leg: LegMomentum, support: Support, readings: Sequence[Reading]) -> Unexplained:
    """Return the unexplained torque at the second one of three readings.

    Turning the whole leg changes no inertia, so `(I1 + C c) v1 + (I2 + C c) v2` with
    `c = cos(q1 - q2)` changes by the torques alone; `(I2 - C c) v2 - (I1 - C c) v1` has the
    centrifugal term `2 C sin(q1 - q2) v1 v2` besides.
    """
    before, at, after = readings
    (i1, i2), mixed = support.inertia, support.coupling
    (k1, k2), (d1, d2), (m1, m2) = leg.stiffness, leg.damping, support.moment
    (p1, p2), (q1, q2) = before.joint, at.joint
    n1, n2 = after.joint
    back_1, back_2 = (q1 - p1) / at.interval, (q2 - p2) / at.interval
    on_1, on_2 = (n1 - q1) / after.interval, (n2 - q2) / after.interval
    c_back = mixed * math.cos(0.5 * (p1 + q1 - p2 - q2))
    c_on = mixed * math.cos(0.5 * (q1 + n1 - q2 - n2))
    v1, v2 = 0.5 * (back_1 + on_1), 0.5 * (back_2 + on_2)
    torque_1 = k1 * (at.motor[0] - q1) - d1 * v1 - m1 * math.sin(q1)
    torque_2 = k2 * (at.motor[1] - q2) - d2 * v2 - m2 * math.sin(q2)
    whirl = 2.0 * mixed * math.sin(q1 - q2) * v1 * v2
    gain_1 = (i1 + c_on) * on_1 - (i1 + c_back) * back_1
    gain_2 = (i2 + c_on) * on_2 - (i2 + c_back) * back_2
    part_1 = (i1 - c_on) * on_1 - (i1 - c_back) * back_1
    part_2 = (i2 - c_on) * on_2 - (i2 - c_back) * back_2
    interval = 0.5 * (at.interval + after.interval)
    return Unexplained(
        polar=(gain_1 + gain_2) / interval - torque_1 - torque_2,
        knee=(part_2 - part_1) / interval - torque_2 + torque_1 - whirl,
    )


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
class MomentumWatch:
    """Looks for torque that no support of the leg explains.

    While the averages reach from the ground into the air, no support explains all of it. So the
    torque must last for longer than their reach and a touchdown together.

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
        weight = max(sum(map(abs, support.moment)) for support in leg.supports)
        # A leg that is always supported alike needs nothing to be ruled out.
        self._knee_torque = WEIGHT_SHARE * weight if len(leg.supports) > 1 else math.inf
        self._cycles = leg.average_cycles(self._torque, period)
        self._reach = 3 * self._cycles
        self._patience = self._reach + round(CONTACT_TIME / period)
        self.restart()

    def restart(self) -> None:
        """Begin anew with whatever is shown next."""
        self.residual: float | None = None
        self._readings = deque[Reading](maxlen=3)
        self._averages = [
            (_Average(self._cycles), _Average(self._cycles)) for _ in self._leg.supports
        ]
        self._seen = self._age = self._pushed = 0

    def see(self, reading: Reading) -> Doubt | None:
        """Look at one more cycle, in which every drive has told something new."""
        if not (self._regular(reading) and _inside(reading.joint[0], self._leg.hip_range)):
            self.restart()
            return None
        self._readings.append(reading)
        if len(self._readings) < 3:
            return None
        knee = reading.joint[1] - reading.joint[0]
        free = _inside(knee, self._leg.knee_range)
        self._pushed = max(0, self._pushed - 1) if free else self._reach + 2
        residual = self._smallest()
        self._seen += 1
        if self._seen < self._reach:
            return None
        self.residual = residual
        self._age = self._age + 1 if residual > self._torque else 0
        if self._age <= self._patience:
            return None
        return Doubt(
            "joint encoder",
            "the springs' torques contradict the motion of the links, on the ground and in the air "
            f"alike, by more than {self._torque:.3f} N m for {self._age} cycles; the limit is a "
            f"link_error of {self._link_error:g} rad: look at the link encoders, at the springs' "
            "stiffness, and whether the foot slides",
        )

    def _smallest(self) -> float:
        """Smallest unexplained torque along q1 + q2 of the supports that are not ruled out."""
        smallest = math.inf
        for support, (polar, knee) in zip(self._leg.supports, self._averages, strict=True):
            torque = unexplained(self._leg, support, self._readings)
            on_polar, on_knee = abs(polar.after(torque.polar)), abs(knee.after(torque.knee))
            if self._pushed or on_knee <= self._knee_torque:
                smallest = min(smallest, on_polar)
        return smallest

    def _regular(self, reading: Reading) -> bool:
        """Whether a reading came about a period after the one before."""
        return 0.5 * self._period < reading.interval < 1.5 * self._period


def _inside(angle: float, between: Range) -> bool:
    return between[0] + RUBBER < angle < between[1] - RUBBER
