"""Readings of one leg on plain floats, each formula written out in one piece.

They are asked for at every event of a hop, where calls and attributes of the general equations
(`analytic.equations`) take longer than the arithmetic.
"""

from math import cos, sin
from typing import final

from legbench.analytic.equations import Pair
from legbench.analytic.model import LegModel
from legbench.analytic.terms import PairTerms
from legbench.design.statics import GRAVITY


@final
class FloatLeg:
    """Accelerations, contact force and height of the foot of one leg without joint stops.

    Args:
        model: the leg, in plain floats.
        arm: foot tip seen from the centre of mass, along dir(q1) and dir(q2) [m].
    """

    __slots__ = ("_arm", "_falling", "_gravity", "_springs", "_stance")

    def __init__(self, model: LegModel, arm: Pair) -> None:
        floating, stance = model.floating, model.stance
        weight = floating.mass * GRAVITY
        self._springs = (*model.stiffness, *model.damping)
        self._stance = (
            *self._springs,
            *stance.inertia,
            stance.coupling,
            *stance.moment,
            *(moment / weight for moment in floating.above_foot),
            floating.gravity / GRAVITY,
        )
        self._arm, self._falling, self._gravity = arm, model.falling, floating.gravity

    def torque(self, motor: Pair, q: Pair, v: Pair) -> Pair:
        """Torque of springs and dampers on q1 and q2 [N m]."""
        k1, k2, d1, d2 = self._springs
        return k1 * (motor[0] - q[0]) - d1 * v[0], k2 * (motor[1] - q[1]) - d2 * v[1]

    def accelerations(self, terms: PairTerms, motor: Pair, q: Pair, v: Pair) -> Pair:
        """Accelerations of q1 and q2 under the inertia `terms` [rad/s^2]."""
        k1, k2, d1, d2 = self._springs
        (m1, m2), (q1, q2), (v1, v2) = motor, q, v
        (i1, i2), (g1, g2), mixed = terms.inertia, terms.moment, terms.coupling
        coupled, swirl = mixed * cos(q1 - q2), mixed * sin(q1 - q2)
        right_1 = k1 * (m1 - q1) - d1 * v1 - swirl * (v2 * v2) - g1 * sin(q1)
        right_2 = k2 * (m2 - q2) - d2 * v2 + swirl * (v1 * v1) - g2 * sin(q2)
        determinant = i1 * i2 - coupled * coupled
        return (
            (i2 * right_1 - coupled * right_2) / determinant,
            (i1 * right_2 - coupled * right_1) / determinant,
        )

    def force(self, motor: Pair, q: Pair, v: Pair) -> float:
        """Vertical contact force on the standing foot over the weight [-]."""
        k1, k2, d1, d2, i1, i2, mixed, g1, g2, h1, h2, carried = self._stance
        (m1, m2), (q1, q2), (v1, v2) = motor, q, v
        s1, s2 = sin(q1), sin(q2)
        coupled, swirl = mixed * cos(q1 - q2), mixed * sin(q1 - q2)
        square_1, square_2 = v1 * v1, v2 * v2
        right_1 = k1 * (m1 - q1) - d1 * v1 - swirl * square_2 - g1 * s1
        right_2 = k2 * (m2 - q2) - d2 * v2 + swirl * square_1 - g2 * s2
        turned = h1 * s1 * (i2 * right_1 - coupled * right_2)
        turned += h2 * s2 * (i1 * right_2 - coupled * right_1)
        lifted = turned / (i1 * i2 - coupled * coupled) + carried
        return lifted + h1 * cos(q1) * square_1 + h2 * cos(q2) * square_2

    def released(self, motor: Pair, q: Pair, v: Pair) -> float:
        """Upward acceleration of the foot tip if nothing held it, over gravity [-]."""
        a1, a2 = self.accelerations(self._falling, motor, q, v)
        (q1, q2), (v1, v2), (arm_1, arm_2) = q, v, self._arm
        turned = arm_1 * (sin(q1) * a1 + cos(q1) * (v1 * v1))
        turned += arm_2 * (sin(q2) * a2 + cos(q2) * (v2 * v2))
        return (turned - self._gravity) / GRAVITY
