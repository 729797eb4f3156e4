"""Statics of a leg: torques of gravity, and motor positions that hold a posture."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from legbench.design.leg import LegDesign
from legbench.errors import DesignError
from legbench.signals import Bools, Floats

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""


class Support(StrEnum):
    """Support that carries the leg's weight."""

    FOOT = "foot"
    """The foot is pinned, the trunk rests on the leg (FFS, stance)."""
    TRUNK = "trunk"
    """The trunk is fixed, the leg hangs (vFTS)."""
    NONE = "none"
    """Nothing to carry: motion plane horizontal (hFTS), or free fall (flight)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GravityLoad:
    """Gravity torque of a supported leg: `g_i(q) = moment_i sin(q_i)`.

    Source: Appendix I for the pinned foot; the same potential with the hip fixed for the trunk.
    """

    moment: tuple[float, float]
    """Moments of gravity [N m]; negative where it drives a segment away from straight down."""

    def torque(self, joint_pos: Floats) -> Floats:
        """Torque of gravity, g(q) = dV/dq (..., 2) [N m]."""
        return np.asarray(self.moment) * np.sin(joint_pos)


def gravity_load(design: LegDesign, support: Support) -> GravityLoad:
    """Load of gravity on q1 and q2 with a support."""
    thigh, shank, foot = design.segments
    if support is Support.NONE:
        return GravityLoad(moment=(0.0, 0.0))
    if support is Support.TRUNK:
        first = thigh.mass * thigh.com + shank.mass * thigh.length
        first += foot.mass * (thigh.length + foot.com)
        second = shank.mass * shank.com + foot.mass * shank.length
        return GravityLoad(moment=(GRAVITY * first, GRAVITY * second))
    above_knee = design.trunk_mass + thigh.mass
    above_ankle = above_knee + shank.mass
    t1 = above_knee * thigh.length - thigh.com * thigh.mass
    t2 = above_ankle * shank.length - shank.com * shank.mass
    t3 = (above_ankle + foot.mass) * foot.length - foot.com * foot.mass
    return GravityLoad(moment=(-GRAVITY * (t1 + t3), -GRAVITY * t2))


def motor_holding(design: LegDesign, joint_pos: Floats, support: Support) -> Floats:
    """Motor positions whose springs balance gravity at `joint_pos`: `q_d = q + g(q)/k`."""
    load = gravity_load(design, support).torque(joint_pos)
    return joint_pos + load / np.asarray(design.stiffness)


def balance(
    stiffness: Floats, moment: Floats, motor_pos: Floats, joint_pos: Floats, steps: int = 20
) -> Floats:
    """Link angles (..., 2) [rad] at which springs and gravity balance, by Newton's method.

    The joints decouple in statics, so each is solved alone; all arrays broadcast. Whether the
    result is an equilibrium, and a stable one, `is_stable` tells.

    Args:
        stiffness: of the springs (..., 2) [N m/rad].
        moment: of gravity, as in `GravityLoad` (..., 2) [N m].
        motor_pos: motor positions (..., 2) [rad].
        joint_pos: link angles to start from (..., 2) [rad].
        steps: largest number of Newton steps.
    """
    for _ in range(steps):
        residual = stiffness * (motor_pos - joint_pos) - moment * np.sin(joint_pos)
        slope = stiffness + moment * np.cos(joint_pos)
        last = joint_pos
        joint_pos = joint_pos + residual / np.where(np.abs(slope) < 1e-9, 1e-9, slope)
        if (joint_pos == last).all():
            # Every further step would give the same numbers.
            break
    return joint_pos


def is_stable(stiffness: Floats, moment: Floats, motor_pos: Floats, joint_pos: Floats) -> Bools:
    """Whether each joint (..., 2) is balanced to 1e-9 N m, and returns when it is pushed."""
    residual = stiffness * (motor_pos - joint_pos) - moment * np.sin(joint_pos)
    slope = stiffness + moment * np.cos(joint_pos)
    return (np.abs(residual) < 1e-9) & (slope > 0.0)


def equilibrium(
    design: LegDesign | Sequence[LegDesign], motor_pos: Floats, support: Support
) -> Floats:
    """Link posture at which gravity balances the springs for `motor_pos` (..., 2) [rad].

    Newton's method starts at the motor position and follows the branch that continues into it when
    gravity is turned up from zero. Legs of a sequence, one for each row of `motor_pos`, are solved
    together, to the bit as alone.

    Raises:
        DesignError: the springs are too soft to hold a leg at that motor position; the message
            shows the first one.
    """
    if isinstance(design, LegDesign):
        stiffness = np.asarray(design.stiffness)
        moment = np.asarray(gravity_load(design, support).moment)
    else:
        stiffness = np.array([each.stiffness for each in design])
        moment = np.array([gravity_load(each, support).moment for each in design])
    joint_pos = np.array(motor_pos, dtype=np.float64)
    for share in np.linspace(0.1, 1.0, 10):
        joint_pos = balance(stiffness, share * moment, motor_pos, joint_pos)
    stable = is_stable(stiffness, moment, motor_pos, joint_pos)
    if not np.all(stable):
        if not isinstance(design, LegDesign):
            first = int(np.flatnonzero(~stable.all(axis=-1))[0])
            design, motor_pos = design[first], motor_pos[first]
        raise DesignError(
            f"no stable equilibrium for motor positions {np.round(motor_pos, 3)} rad: stiffness "
            f"{design.stiffness} N m/rad does not carry the leg on its {support.value}"
        )
    return joint_pos
