"""Balance of a leg's angular momentum, which tells what its springs do not explain; pure.

A leg that sways by 0.2 rad from hop to hop hides an encoder that drifts by as much. But however it
sways, the angular momentum of its links about a point changes by the torques of springs, damping
and weight alone, if that point is the foot on the ground, the trunk that is held, or in flight the
centre of mass. An encoder that is wrong by an angle makes its spring's torque wrong by stiffness
times that angle, and this torque is then unexplained about each of these points.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from legbench.limits.knee import Range

AVERAGE_TIME = 0.018
"""Shortest time over which the averages reach [s]; coarse encoders need a longer one."""
AVERAGE_SHARES = (0.5, 0.33)
"""Shares of that time that the first two of three moving averages take, the third one has the rest
[-]: these leave 0.77 times the noise of second differences that equal ones leave, and 1.1 times
that of the best of all averages, whose weights are the square of a parabola."""
ROUNDING_SCATTER = 12.3
"""Scatter of such averages over N cycles, of second differences in which two encoders take part,
relative to `N^-2.5` of their step [-]."""

Pair = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class SupportPoint:
    """Constants of q1 and q2 about a point, in the form of Appendix I: `M qddot + C + g = tau`."""

    inertia: Pair
    """Inertias of q1 and q2 [kg m^2]."""
    coupling: float
    """Coupling of the two inertias at q1 = q2 [kg m^2]."""
    moment: Pair
    """Moments of gravity about q1 and q2 at sin(q) = 1 [N m]."""

    def average_cycles(self, link_step: float, torque: float, period: float) -> int:
        """Return over how many cycles to average, so that rounding leaves less than a torque.

        Second differences of readings that are rounded to steps `s`, averaged over N cycles T,
        scatter by `ROUNDING_SCATTER s / (N^2.5 T^2)` on two joints.

        Args:
            link_step: smallest step that the encoders can show [rad].
            torque: standard deviation that rounding may leave [N m].
            period: of the cycles [s].
        """
        heaviest = max(self.inertia) + abs(self.coupling)
        scatter = ROUNDING_SCATTER * heaviest * link_step / period**2
        needed = (scatter / torque) ** 0.4
        return max(6, round(AVERAGE_TIME / period), math.ceil(needed))


@dataclass(frozen=True, slots=True, kw_only=True)
class LegMomentum:
    """What the angular momentum of a leg obeys, for each way in which it may be supported."""

    stiffness: Pair
    """Stiffness of the series springs [N m/rad]."""
    damping: Pair
    """Viscous damping of q1 and q2 [N m s/rad]."""
    supports: tuple[SupportPoint, ...]
    """The only support of the leg, or the ground and free fall, between which it changes."""
    hip_range: Range
    """Range of q1 between its stops [rad]."""
    knee_range: Range
    """Range of q2 - q1 between its stops [rad]."""
    link_step: float = 0.0
    """Smallest step that the link encoders can show [rad]."""


class MomentumReading(NamedTuple):
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
    """Part that turns q1 and q2 together [N m]."""
    knee: float
    """Part that turns q2 against q1; the push of a knee stop belongs to it [N m]."""
    wound: float
    """Torque of spring 2 less that of spring 1 [N m]."""


def unexplained(
    leg: LegMomentum, support: SupportPoint, readings: Sequence[MomentumReading]
) -> Unexplained:
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
    spring_1, spring_2 = k1 * (at.motor[0] - q1), k2 * (at.motor[1] - q2)
    torque_1 = spring_1 - d1 * v1 - m1 * math.sin(q1)
    torque_2 = spring_2 - d2 * v2 - m2 * math.sin(q2)
    whirl = 2.0 * mixed * math.sin(q1 - q2) * v1 * v2
    gain_1 = (i1 + c_on) * on_1 - (i1 + c_back) * back_1
    gain_2 = (i2 + c_on) * on_2 - (i2 + c_back) * back_2
    part_1 = (i1 - c_on) * on_1 - (i1 - c_back) * back_1
    part_2 = (i2 - c_on) * on_2 - (i2 - c_back) * back_2
    interval = 0.5 * (at.interval + after.interval)
    return Unexplained(
        polar=(gain_1 + gain_2) / interval - torque_1 - torque_2,
        knee=(part_2 - part_1) / interval - torque_2 + torque_1 - whirl,
        wound=spring_2 - spring_1,
    )
