"""Equations of motion in one form for numbers, arrays and symbols.

Every function takes its elementary functions from `ops` and its angles one by one, so that the same
lines run on floats (`SCALAR`), on batches of any shape (`ARRAY`), on complex numbers for exact
derivatives (`COMPLEX`), and on the expressions from which `taylor` compiles its integrators.
A pair is `(component 1, component 2)` or `(forward, up)`.

Constants stand outside the products of variables: `h (s a)`, not `h s a`. The compiler then finds
the products that several equations share, and the cost of a Taylor series is that of its products.
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from legbench.analytic.terms import FloatingTerms, PairTerms

Term = Any
"""A float, an array, a complex number or an expression."""
Pair = tuple[Term, Term]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ops:
    """Elementary functions of one kind of number."""

    sin: Callable[[Term], Term]
    cos: Callable[[Term], Term]
    sqrt: Callable[[Term], Term]


SCALAR = Ops(sin=math.sin, cos=math.cos, sqrt=math.sqrt)
ARRAY = Ops(sin=np.sin, cos=np.cos, sqrt=np.sqrt)
COMPLEX = Ops(sin=cmath.sin, cos=cmath.cos, sqrt=cmath.sqrt)


def spring_torque(stiffness: Pair, motor: Pair, q: Pair) -> Pair:
    """Right-hand side of eq. (1): `k_i (q_d,i - q_i)` [N m]."""
    return stiffness[0] * (motor[0] - q[0]), stiffness[1] * (motor[1] - q[1])


def damped(torque: Pair, damping: Pair, v: Pair) -> Pair:
    """A torque less viscous damping, `- d_i qdot_i` (Table III) [N m]."""
    return torque[0] - damping[0] * v[0], torque[1] - damping[1] * v[1]


def guide_torque(ops: Ops, reach: float, guide: Pair, q: Pair, v: Pair) -> Pair:
    """Torques of a guide that brakes the trunk over a pinned foot, on q1 and q2 [N m].

    The trunk moves by `-reach (dir(q1) + dir(q2))`; a force `-c v` on it is the torque
    `-J^T c J qdot`, with the damping `c` of the guide forward and upward [N s/m].
    """
    foot_vel = sweep_rate(ops, q, v, (reach, reach))
    forward, upward = guide[0] * foot_vel[0], guide[1] * foot_vel[1]
    return (
        -reach * (ops.cos(q[0]) * forward + ops.sin(q[0]) * upward),
        -reach * (ops.cos(q[1]) * forward + ops.sin(q[1]) * upward),
    )


def pair_solve(ops: Ops, terms: PairTerms, q: Pair, right: Pair) -> Pair:
    """`M(q)^-1 right` for the inertia matrix of Appendix I, by Cramer's rule."""
    (i1, i2), mixed = terms.inertia, terms.coupling
    cosine = ops.cos(q[0] - q[1])
    determinant = i1 * i2 - mixed * mixed * (cosine * cosine)
    return (
        (i2 * right[0] - mixed * (cosine * right[1])) / determinant,
        (i1 * right[1] - mixed * (cosine * right[0])) / determinant,
    )


def pair_share(ops: Ops, terms: PairTerms, q: Pair, along: Pair) -> Pair:
    """Accelerations that a torque `along` gives, per acceleration `along` itself [-].

    `M^-1 n / (n . M^-1 n)`, where the determinant of M drops out.
    """
    (i1, i2), mixed = terms.inertia, terms.coupling
    cosine = mixed * ops.cos(q[0] - q[1])
    first, second = i2 * along[0] - cosine * along[1], i1 * along[1] - cosine * along[0]
    whole = along[0] * first + along[1] * second
    return first / whole, second / whole


def pair_acceleration(ops: Ops, terms: PairTerms, q: Pair, v: Pair, torque: Pair) -> Pair:
    """Eq. (1) solved for the accelerations: `M^-1 (tau - C qdot - g)` [rad/s^2].

    `C(q, qdot) qdot + g(q)` is that of Appendix I.
    """
    (q1, q2), (v1, v2), mixed, moment = q, v, terms.coupling, terms.moment
    swirl = ops.sin(q1 - q2)
    bias_1 = mixed * (swirl * (v2 * v2)) + moment[0] * ops.sin(q1)
    bias_2 = -mixed * (swirl * (v1 * v1)) + moment[1] * ops.sin(q2)
    return pair_solve(ops, terms, q, (torque[0] - bias_1, torque[1] - bias_2))


def pair_kinetic(ops: Ops, terms: PairTerms, q: Pair, v: Pair) -> Term:
    """`qdot^T M(q) qdot / 2` [J]."""
    mixed = terms.coupling * ops.cos(q[0] - q[1])
    own = terms.inertia[0] * v[0] * v[0] + terms.inertia[1] * v[1] * v[1]
    return 0.5 * own + mixed * v[0] * v[1]


def pair_potential(ops: Ops, terms: PairTerms, q: Pair) -> Term:
    """Potential energy of gravity [J]; its gradient is `g(q)` of Appendix I."""
    return -terms.moment[0] * ops.cos(q[0]) - terms.moment[1] * ops.cos(q[1])


def spring_energy(stiffness: Pair, motor: Pair, q: Pair) -> Term:
    """`U_e` of Fig. 2: `sum k_i (q_d,i - q_i)^2 / 2` [J]."""
    stretch = (motor[0] - q[0], motor[1] - q[1])
    return 0.5 * (stiffness[0] * stretch[0] * stretch[0] + stiffness[1] * stretch[1] * stretch[1])


def sweep(ops: Ops, q: Pair, along: Pair) -> Pair:
    """`along_1 dir(q1) + along_2 dir(q2)`, with `dir(a) = (sin a, -cos a)` (forward, up)."""
    return along[0] * ops.sin(q[0]) + along[1] * ops.sin(q[1]), sweep_height(ops, q, along)


def sweep_height(ops: Ops, q: Pair, along: Pair) -> Term:
    """Upward component of `sweep` alone."""
    return -along[0] * ops.cos(q[0]) - along[1] * ops.cos(q[1])


def sweep_rate(ops: Ops, q: Pair, v: Pair, along: Pair) -> Pair:
    """First time derivative of `sweep`: `dir'(a) = (cos a, sin a)`."""
    return (
        along[0] * ops.cos(q[0]) * v[0] + along[1] * ops.cos(q[1]) * v[1],
        along[0] * ops.sin(q[0]) * v[0] + along[1] * ops.sin(q[1]) * v[1],
    )


def sweep_motion(ops: Ops, q: Pair, v: Pair, along: Pair) -> tuple[Pair, Pair]:
    """`sweep` and `sweep_rate` together."""
    s1, c1, s2, c2 = ops.sin(q[0]), ops.cos(q[0]), ops.sin(q[1]), ops.cos(q[1])
    along_1, along_2 = along
    return (
        (along_1 * s1 + along_2 * s2, -along_1 * c1 - along_2 * c2),
        (along_1 * c1 * v[0] + along_2 * c2 * v[1], along_1 * s1 * v[0] + along_2 * s2 * v[1]),
    )


def sweep_acceleration(ops: Ops, q: Pair, v: Pair, a: Pair, along: Pair) -> Pair:
    """Second time derivative of `sweep`: `dir'(q_i) a_i - dir(q_i) v_i^2`."""
    s1, c1, s2, c2 = ops.sin(q[0]), ops.cos(q[0]), ops.sin(q[1]), ops.cos(q[1])
    square_1, square_2 = v[0] * v[0], v[1] * v[1]
    return (
        along[0] * (c1 * a[0] - s1 * square_1) + along[1] * (c2 * a[1] - s2 * square_2),
        along[0] * (s1 * a[0] + c1 * square_1) + along[1] * (s2 * a[1] + c2 * square_2),
    )


def trunk_acceleration(ops: Ops, terms: FloatingTerms, q: Pair, v: Pair, a: Pair) -> Pair:
    """Acceleration of the trunk while nothing touches the ground (forward, up) [m/s^2].

    Seen from the falling centre of mass the angles move as in eq. (1) without gravity; their
    accelerations `a` give the trunk by `m (a_t + g) + d^2/dt^2 sum_i first_i dir(q_i) = 0`.
    """
    inner = sweep_acceleration(ops, q, v, a, terms.first)
    return -inner[0] / terms.mass, -inner[1] / terms.mass - terms.gravity


def contact_force(ops: Ops, terms: FloatingTerms, q: Pair, v: Pair, a: Pair) -> Pair:
    """Ground on pinned foot (forward, up): what the centre of mass needs beyond gravity [N].

    `m r_com = m r_foot + sum_i (first_i - m l2) dir(q_i)`, differentiated twice.
    """
    inertial = sweep_acceleration(ops, q, v, a, terms.above_foot)
    return inertial[0], inertial[1] + terms.mass * terms.gravity


def free_foot_acceleration(ops: Ops, terms: FloatingTerms, q: Pair, v: Pair, a: Pair) -> Pair:
    """Acceleration of a foot tip that nothing holds, angles accelerating by `a` [m/s^2]."""
    trunk = trunk_acceleration(ops, terms, q, v, a)
    inner = sweep_acceleration(ops, q, v, a, (terms.reach, terms.reach))
    return trunk[0] + inner[0], trunk[1] + inner[1]


def touchdown(
    ops: Ops, stance: PairTerms, terms: FloatingTerms, q: Pair, v: Pair, foot_vel: Pair
) -> tuple[Pair, Term]:
    """Eq. (12) in closed form: joint rates after the foot, at `foot_vel` before, has stopped.

    The impulse acts on the foot alone, so in coordinates (foot, q) the momentum of q stays:
    `M qdot+ = M qdot- + B v_foot`, `B_i = (first_i - m l2) dir'(q_i)^T`, M of Appendix I.

    Returns the rates and the energy that is lost, `(m v_foot^2 - (qdot+ - qdot-) . B v_foot) / 2`,
    in rad/s and J.
    """
    (h1, h2), (q1, q2), (forward, up) = terms.above_foot, q, foot_vel
    kick_1 = h1 * (ops.cos(q1) * forward + ops.sin(q1) * up)
    kick_2 = h2 * (ops.cos(q2) * forward + ops.sin(q2) * up)
    change_1, change_2 = pair_solve(ops, stance, q, (kick_1, kick_2))
    whole = terms.mass * (forward * forward + up * up)
    lost = 0.5 * (whole - change_1 * kick_1 - change_2 * kick_2)
    return (v[0] + change_1, v[1] + change_2), lost
