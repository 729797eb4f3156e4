"""Equations of motion as matrices: batched arrays (..., n, n), for analysis and for checks.

Joint arrays (..., 2) hold q1, q2; floating ones (..., 4) hold x_t, z_t, q1, q2.
"""

import numpy as np

from legbench.analytic.terms import FloatingTerms, PairTerms
from legbench.errors import ConfigError
from legbench.signals import Floats

STRAIGHT = 1e-9
"""Smallest |sin(q1 - q2)| for which eq. (19) has an inverse: neither straight nor folded [-]."""


def pair_mass(terms: PairTerms, joint_pos: Floats) -> Floats:
    """Inertia matrix of Appendix I (..., 2, 2) [kg m^2]."""
    mixed = terms.coupling * np.cos(joint_pos[..., 0] - joint_pos[..., 1])
    return _matrix(
        (
            (np.full(mixed.shape, terms.inertia[0]), mixed),
            (mixed, np.full_like(mixed, terms.inertia[1])),
        )
    )


def pair_coriolis(terms: PairTerms, joint_pos: Floats, joint_vel: Floats) -> Floats:
    """C(q, qdot) of Appendix I (..., 2, 2) [N m s/rad]."""
    swirl = terms.coupling * np.sin(joint_pos[..., 0] - joint_pos[..., 1])
    none = np.zeros(swirl.shape)
    return _matrix(((none, swirl * joint_vel[..., 1]), (-swirl * joint_vel[..., 0], none)))


def pair_gravity(terms: PairTerms, joint_pos: Floats) -> Floats:
    """g(q) of Appendix I (..., 2) [N m]."""
    return np.asarray(terms.moment) * np.sin(joint_pos)


def floating_mass(terms: FloatingTerms, pos: Floats) -> Floats:
    """Inertia matrix of the floating leg (..., 4, 4)."""
    q1, q2 = pos[..., 2], pos[..., 3]
    s1, s2 = terms.first
    none, one = np.zeros(q1.shape), np.ones(q1.shape)
    mixed = terms.coupling * np.cos(q1 - q2)
    return _matrix(
        (
            (terms.mass * one, none, s1 * np.cos(q1), s2 * np.cos(q2)),
            (none, terms.mass * one, s1 * np.sin(q1), s2 * np.sin(q2)),
            (s1 * np.cos(q1), s1 * np.sin(q1), terms.inertia[0] * one, mixed),
            (s2 * np.cos(q2), s2 * np.sin(q2), mixed, terms.inertia[1] * one),
        )
    )


def floating_coriolis(terms: FloatingTerms, pos: Floats, vel: Floats) -> Floats:
    """C(q, qdot) of the floating leg from Christoffel's symbols (..., 4, 4)."""
    q1, q2, v1, v2 = pos[..., 2], pos[..., 3], vel[..., 2], vel[..., 3]
    s1, s2 = terms.first
    none = np.zeros(q1.shape)
    swirl = terms.coupling * np.sin(q1 - q2)
    return _matrix(
        (
            (none, none, -s1 * np.sin(q1) * v1, -s2 * np.sin(q2) * v2),
            (none, none, s1 * np.cos(q1) * v1, s2 * np.cos(q2) * v2),
            (none, none, none, swirl * v2),
            (none, none, -swirl * v1, none),
        )
    )


def floating_gravity(terms: FloatingTerms, pos: Floats) -> Floats:
    """g(q) of the floating leg (..., 4) [N, N, N m, N m]."""
    q1, q2 = pos[..., 2], pos[..., 3]
    weight = np.full(q1.shape, terms.gravity * terms.mass)
    lever = [terms.gravity * s * np.sin(q) for s, q in zip(terms.first, (q1, q2), strict=True)]
    return np.stack([np.zeros(q1.shape), weight, *lever], axis=-1)


def contact_jacobian(terms: FloatingTerms, pos: Floats) -> Floats:
    """J_c of eq. (12): foot velocity (forward, up) from floating velocities (..., 2, 4)."""
    q1, q2 = pos[..., 2], pos[..., 3]
    none, one, reach = np.zeros(q1.shape), np.ones(q1.shape), terms.reach
    return _matrix(
        (
            (one, none, reach * np.cos(q1), reach * np.cos(q2)),
            (none, one, reach * np.sin(q1), reach * np.sin(q2)),
        )
    )


def impact_map(terms: FloatingTerms, pos: Floats) -> Floats:
    """Eq. (12): `qdot+ = P qdot-`, `P = I - M^-1 J^T (J M^-1 J^T)^-1 J` (..., 4, 4)."""
    jacobian = contact_jacobian(terms, pos)
    transposed = np.swapaxes(jacobian, -1, -2)
    answer = np.linalg.solve(floating_mass(terms, pos), transposed)
    return np.eye(4) - answer @ np.linalg.solve(jacobian @ answer, jacobian)


def polar_jacobian(reach: float, joint_pos: Floats) -> Floats:
    """J = dx/dq of eq. (2) (..., 2, 2); its inverse is eq. (19)."""
    half = 0.5 * (joint_pos[..., 1] - joint_pos[..., 0])
    share = np.full(half.shape, 0.5)
    shorten = reach * np.sin(half)
    return _matrix(((share, share), (shorten, -shorten)))


def polar_jacobian_rate(reach: float, joint_pos: Floats, joint_vel: Floats) -> Floats:
    """Time derivative of `polar_jacobian` (..., 2, 2)."""
    half = 0.5 * (joint_pos[..., 1] - joint_pos[..., 0])
    shorten = 0.5 * reach * np.cos(half) * (joint_vel[..., 1] - joint_vel[..., 0])
    none = np.zeros(half.shape)
    return _matrix(((none, none), (shorten, -shorten)))


def polar_dynamics(
    terms: PairTerms, reach: float, joint_pos: Floats, joint_vel: Floats
) -> tuple[Floats, Floats, Floats]:
    """M_x (..., 2, 2), C_x (..., 2, 2) and g_x (..., 2) in polar coordinates x = (x1, x2).

    `M_x = J^-T M J^-1` (Appendix II), `C_x = J^-T (C - M J^-1 Jdot) J^-1`, `g_x = J^-T g`.

    Raises:
        ConfigError: a straight or a folded leg, where x does not fix q.
    """
    if np.any(np.abs(np.sin(joint_pos[..., 0] - joint_pos[..., 1])) < STRAIGHT):
        raise ConfigError("the leg is straight or folded: polar coordinates are singular there")
    inverse = np.linalg.inv(polar_jacobian(reach, joint_pos))
    transposed = np.swapaxes(inverse, -1, -2)
    mass = pair_mass(terms, joint_pos)
    drift = mass @ inverse @ polar_jacobian_rate(reach, joint_pos, joint_vel)
    coriolis = pair_coriolis(terms, joint_pos, joint_vel) - drift
    gravity = np.einsum("...ij,...j->...i", transposed, pair_gravity(terms, joint_pos))
    return transposed @ mass @ inverse, transposed @ coriolis @ inverse, gravity


def _matrix(rows: tuple[tuple[Floats, ...], ...]) -> Floats:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
