"""Kinematics of the leg: joint angles q, polar coordinates x, modal coordinates z.

Pure and batched: every function takes arrays whose last axis holds the two components and works
on any number of leading axes. Angles are absolute, from straight down, positive forward.
"""

import math
from enum import StrEnum

import numpy as np

from legbench.signals import Floats


class ModalConvention(StrEnum):
    """Reading of eq. (15)."""

    ORTHONORMAL = "orthonormal"
    """z = [q1 + q2, q2 - q1] / sqrt(2): columns of W of unit length, as the text calls them."""
    LITERAL = "literal"
    """z = [q1 + q2, q2 - q1] / 2: W inverted as printed; z2 is then the half angle."""

    @property
    def scale(self) -> float:
        """Factor on the sum and the difference of the joint angles."""
        return math.sqrt(0.5) if self is ModalConvention.ORTHONORMAL else 0.5


MODE_RADIAL = np.array([-1.0, 1.0])
"""w_q of eq. (14): the radial mode in joint space, not normalised."""


def direction(angle: Floats) -> Floats:
    """Unit vector (x forward, z up) of a segment hanging at `angle` [rad]; adds a last axis."""
    return np.stack([np.sin(angle), -np.cos(angle)], axis=-1)


def half_angle(joint_pos: Floats) -> Floats:
    """Half angle of the knee, (q2 - q1) / 2 [rad]: zero for the straight leg, pi/2 folded."""
    return 0.5 * (joint_pos[..., 1] - joint_pos[..., 0])


def polar_angle(joint_pos: Floats) -> Floats:
    """Polar angle x1 = (q1 + q2) / 2 [rad]: direction of the foot tip seen from the hip."""
    return 0.5 * (joint_pos[..., 0] + joint_pos[..., 1])


def joint_to_polar(joint_pos: Floats, shank_length: float) -> Floats:
    """Polar angle x1 [rad] and leg length x2 [m] of the foot seen from the hip, eq. (2)."""
    x2 = 2.0 * shank_length * np.cos(half_angle(joint_pos))
    return np.stack([polar_angle(joint_pos), x2], axis=-1)


def joint_to_polar_rate(joint_pos: Floats, joint_vel: Floats, shank_length: float) -> Floats:
    """Time derivative of `joint_to_polar`: [rad/s], [m/s]."""
    rate2 = -2.0 * shank_length * np.sin(half_angle(joint_pos)) * half_angle(joint_vel)
    return np.stack([polar_angle(joint_vel), rate2], axis=-1)


def joint_to_modal(
    joint: Floats, convention: ModalConvention = ModalConvention.ORTHONORMAL
) -> Floats:
    """Modal coordinates z1 (polar), z2 (radial) of joint angles, rates or torques, eq. (15)."""
    total = joint[..., 0] + joint[..., 1]
    difference = joint[..., 1] - joint[..., 0]
    return convention.scale * np.stack([total, difference], axis=-1)


def modal_to_joint(
    modal: Floats, convention: ModalConvention = ModalConvention.ORTHONORMAL
) -> Floats:
    """Inverse of `joint_to_modal`."""
    factor = 0.5 / convention.scale
    q1 = factor * (modal[..., 0] - modal[..., 1])
    q2 = factor * (modal[..., 0] + modal[..., 1])
    return np.stack([q1, q2], axis=-1)


def leg_points(joint_pos: Floats, lengths: tuple[float, float, float]) -> Floats:
    """Hip, knee, ankle and foot tip in the hip's frame (..., 4, 2) [m]."""
    q1, q2 = joint_pos[..., 0], joint_pos[..., 1]
    hip = np.zeros((*joint_pos.shape[:-1], 2))
    knee = hip + lengths[0] * direction(q1)
    ankle = knee + lengths[1] * direction(q2)
    tip = ankle + lengths[2] * direction(q1)
    return np.stack([hip, knee, ankle, tip], axis=-2)
