"""MuJoCo's coordinates of a posture, with the loops closed."""

import mujoco
import numpy as np

from legbench.design import LegDesign
from legbench.design.rig import BOOM_BEND
from legbench.kinematics import leg_points
from legbench.signals import Floats

BENT = np.array([-BOOM_BEND, BOOM_BEND])
"""Posture of the keyframe `bent` [rad]; qpos0 is the straight leg, where the loops are singular."""


def hip_height(design: LegDesign, joint_pos: Floats) -> float:
    """Height of the hip over the foot tip [m]."""
    return float(-leg_points(joint_pos, design.lengths)[..., 3, 1])


def rest_qpos(model: mujoco.MjModel, design: LegDesign, joint_pos: Floats) -> Floats:
    """MuJoCo's qpos for a posture (2,) [rad], loops closed, foot tip at the origin.

    With a fixed trunk the foot is wherever the posture puts it.
    """
    q1, q2 = float(joint_pos[0]), float(joint_pos[1])
    angles = {
        "hip": q1,
        "knee": q2 - q1,
        "ankle": q1 - q2,
        "crank": q2,
        "bar_thigh": q1 - q2,
        "bar_shank": q2 - q1,
    }
    tip = leg_points(np.asarray(joint_pos, dtype=np.float64), design.lengths)[3]
    if (yaw_joint := _joint(model, "boom_yaw")) >= 0:
        angles |= _boom_angles(model, yaw_joint, tip)
    else:
        angles |= {"trunk_x": -tip[0], "trunk_z": -tip[1]}
    qpos = np.array(model.qpos0)
    for name, angle in angles.items():
        if (joint := _joint(model, name)) >= 0:
            qpos[model.jnt_qposadr[joint]] = angle
    return qpos


def _joint(model: mujoco.MjModel, name: str) -> int:
    """Index of a joint; -1 for one that the model lacks. Named views take ten times as long."""
    return mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)


def _boom_angles(model: mujoco.MjModel, yaw_joint: int, tip: Floats) -> dict[str, float]:
    """Boom and pin positions that put the tip, (2,) [m] in the trunk's frame, at x = z = 0."""
    radius = -float(model.jnt_pos[yaw_joint, 1])
    height = float(model.body("trunk").pos[2])
    roll = np.arcsin(-height / np.hypot(radius, tip[1])) - np.arctan2(tip[1], radius)
    reach = radius * np.cos(roll) - tip[1] * np.sin(roll)
    yaw = np.arctan2(tip[0], reach)
    sideways = tip[0] * np.sin(yaw) + reach * np.cos(yaw) - radius
    return {"boom_yaw": float(yaw), "boom_roll": float(roll), "pin_y": float(sideways)}
