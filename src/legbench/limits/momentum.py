"""Balance of a leg's angular momentum, which tells what its springs do not explain; pure.

A leg that sways by 0.2 rad from hop to hop hides an encoder that drifts by as much. But however it
sways, the angular momentum of its links about a point changes by the torques of springs, damping
and weight alone, if that point is the foot on the ground, the trunk that is held, or in flight the
centre of mass. An encoder that is wrong by an angle makes its spring's torque wrong by stiffness
times that angle, and this torque is then unexplained about each of these points.
"""

import math
from collections.abc import Iterable
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


class LegMotion(NamedTuple):
    """Motion of a leg and torques of its springs, which do not depend on what supports it."""

    accel_1: float
    """Acceleration of q1 [rad/s^2]."""
    accel_2: float
    """Acceleration of q2 [rad/s^2]."""
    coupled_polar: float
    """Part of the rate of angular momentum that turns q1 and q2 together, for a coupling of 1
    [1/s^2]."""
    coupled_knee: float
    """Part that turns q2 against q1, centrifugal term included, for a coupling of 1 [1/s^2]."""
    sine_1: float
    """Sine of q1 [-]."""
    sine_2: float
    """Sine of q2 [-]."""
    torque_1: float
    """Torque of spring and damping on q1 [N m]."""
    torque_2: float
    """Torque of spring and damping on q2 [N m]."""
    wound: float
    """Torque of spring 2 less that of spring 1 [N m]."""


def motion_of(leg: LegMomentum, readings: Iterable[MomentumReading]) -> LegMotion:
    """Return the motion at the second one of three readings.

    With `c = cos(q1 - q2)` the coupling turns q1 and q2 together by the rate of `c (v1 + v2)`, and
    against each other by the rate of `c (v2 - v1)` and the centrifugal `2 sin(q1 - q2) v1 v2`.
    """
    (_, _, (p1, p2)), (since, (motor_1, motor_2), (q1, q2)), (until, _, (n1, n2)) = readings
    (k1, k2), (d1, d2) = leg.stiffness, leg.damping
    back_1, back_2 = (q1 - p1) / since, (q2 - p2) / since
    on_1, on_2 = (n1 - q1) / until, (n2 - q2) / until
    c_back = math.cos(0.5 * (p1 + q1 - p2 - q2))
    c_on = math.cos(0.5 * (q1 + n1 - q2 - n2))
    v1, v2 = 0.5 * (back_1 + on_1), 0.5 * (back_2 + on_2)
    spring_1, spring_2 = k1 * (motor_1 - q1), k2 * (motor_2 - q2)
    per_second = 2.0 / (since + until)
    against = c_on * (on_2 - on_1) - c_back * (back_2 - back_1)
    return LegMotion(
        (on_1 - back_1) * per_second,
        (on_2 - back_2) * per_second,
        (c_on * (on_1 + on_2) - c_back * (back_1 + back_2)) * per_second,
        against * per_second + 2.0 * math.sin(q1 - q2) * v1 * v2,
        math.sin(q1),
        math.sin(q2),
        spring_1 - d1 * v1,
        spring_2 - d2 * v2,
        spring_2 - spring_1,
    )


def left_over(support: SupportPoint, motion: LegMotion) -> tuple[float, float]:
    """Return the torques along q1 + q2 and along the knee that a support leaves unexplained [N m].

    Turning the whole leg changes no inertia, so `(I1 + C c) v1 + (I2 + C c) v2` with
    `c = cos(q1 - q2)` changes by the torques alone; `(I2 - C c) v2 - (I1 - C c) v1` has the
    centrifugal term `2 C sin(q1 - q2) v1 v2` besides.
    """
    (i1, i2), (m1, m2), coupling = support.inertia, support.moment, support.coupling
    a1, a2, polar, knee, sine_1, sine_2, torque_1, torque_2, _ = motion
    left_1 = i1 * a1 + m1 * sine_1 - torque_1
    left_2 = i2 * a2 + m2 * sine_2 - torque_2
    return left_1 + left_2 + coupling * polar, left_2 - left_1 - coupling * knee
