"""Observations from MuJoCo's arrays, for one leg or a batch with the same code."""

import math
from dataclasses import dataclass
from typing import final

import mujoco
import numpy as np

from legbench.encoders import EncoderErrors
from legbench.mjcf.sensors import SensorLayout
from legbench.servo import Servo
from legbench.signals import Bools, Floats, Observation, Truth

CROSSED_TOLERANCE = 0.05
"""A foot or crank this far from parallel sits on the crossed branch of its loop [rad]; the bars
of a healthy leg stay within 1e-4."""
STRAIGHT_MARGIN = 0.02
"""Distance of a knee from 0 or pi at which it has gone through its stop [rad]."""
DIVERGED = 1e3
"""All coordinates of a leg together never get this far [rad and m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointLayout:
    """Places of the leg's coordinates in qpos and, since all have one dimension, in qvel."""

    hip: int
    knee: int
    """Place of the knee; it follows the hip at once, as the shank follows the thigh."""
    ankle: int
    crank: int | None

    @classmethod
    def of(cls, model: mujoco.MjModel) -> "JointLayout":
        """Look the joints up once; named access in the loop is slow."""
        address = {
            model.joint(index).name: int(model.jnt_qposadr[index]) for index in range(model.njnt)
        }
        return cls(
            hip=address["hip"],
            knee=address["knee"],
            ankle=address["ankle"],
            crank=address.get("crank"),
        )


def relative(layout: JointLayout, coordinates: Floats) -> Floats:
    """Hip and knee (..., 2) in MuJoCo's coordinates (..., nq), a view; added up they are q1, q2."""
    return coordinates[..., layout.hip : layout.knee + 1]


def branch_fault(layout: JointLayout, qpos: Floats) -> str | None:
    """Name what happened to a leg (nq,) that is no longer the pantograph it was built as."""
    angles = qpos.tolist()
    if not math.hypot(*angles) < DIVERGED:
        return "simulation diverged"
    knee = angles[layout.knee]
    if knee < STRAIGHT_MARGIN:
        return "leg straightened through"
    if knee > np.pi - STRAIGHT_MARGIN:
        return "leg folded through"
    if abs(angles[layout.ankle] + knee) > CROSSED_TOLERANCE:
        return "foot loop crossed"
    if layout.crank is not None:
        lag = angles[layout.crank] - angles[layout.hip] - knee
        if abs(lag) > CROSSED_TOLERANCE:
            return "thigh loop crossed"
    return None


def branch_message(cause: str, time: float) -> str:
    """What to tell a user of a leg that left its branch at `time` [s]."""
    return (
        f"{cause} at t = {time:.3f} s: the leg is no longer on the branch it was assembled on; "
        "push less (--dz2) or limit the servo (--slew-rate)"
    )


def branch_fault_mask(layout: JointLayout, qpos: Floats) -> Bools:
    """Which legs of a batch (n, nq) `branch_fault` would name; (n,)."""
    knee = qpos[:, layout.knee]
    fault = ~(np.hypot.reduce(qpos, axis=-1) < DIVERGED)
    fault |= (knee < STRAIGHT_MARGIN) | (knee > np.pi - STRAIGHT_MARGIN)
    fault |= np.abs(qpos[:, layout.ankle] + knee) > CROSSED_TOLERANCE
    if layout.crank is not None:
        lag = qpos[:, layout.crank] - qpos[:, layout.hip] - knee
        fault |= np.abs(lag) > CROSSED_TOLERANCE
    return fault


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveArrays:
    """MuJoCo's arrays of one leg (...,) or a batch (n, ...), bound once; they change in place."""

    qpos: Floats
    qvel: Floats
    ctrl: Floats
    sensordata: Floats
    energy: Floats


@final
class Observer:
    """Maker of observations of the current state, which alias neither simulation nor command."""

    def __init__(
        self,
        model: mujoco.MjModel,
        arrays: LiveArrays,
        stiffness: Floats,
        servo: Servo,
        errors: EncoderErrors,
    ) -> None:
        """Look the layout up once.

        Args:
            model: the compiled model.
            arrays: its live state.
            stiffness: what springs are taken for when their torque is read (..., 2) [N m/rad].
            servo: drives, which know where the motors' encoders are.
            errors: what the encoders show beside that.
        """
        self.joints = JointLayout.of(model)
        self._sensors = SensorLayout.of(model).views(arrays.sensordata)
        self._relative = relative(self.joints, arrays.qpos)
        self._rates = relative(self.joints, arrays.qvel)
        self._arrays, self._stiffness, self._servo = arrays, stiffness, servo
        self._errors = errors

    def links(self) -> tuple[Floats, Floats]:
        """Return true link angles [rad] and velocities [rad/s] (..., 2) of this instant."""
        joint_pos = np.add.accumulate(self._relative, axis=-1)
        return joint_pos, np.add.accumulate(self._rates, axis=-1)

    def look(self, time: float, applied_pos: Floats) -> Observation:
        """Return the observation at `time` [s], after the command `applied_pos` (..., 2) [rad]."""
        arrays, sensors = self._arrays, self._sensors
        joint_pos, joint_vel = self.links()
        motor_pos = self._servo.position.copy()
        if not self._errors.exact:
            self._errors.advance()
            motor_pos, joint_pos = motor_pos + self._errors.motor, joint_pos + self._errors.link
        motor_pos, joint_pos = self._servo.encode(motor_pos), self._servo.encode(joint_pos)
        truth = Truth(
            trunk_pos=sensors.trunk_pos.copy(),
            trunk_vel=sensors.trunk_vel.copy(),
            foot_pos=sensors.foot_pos.copy(),
            contact_force=sensors.force.copy(),
            contact=sensors.contact,
            energy=arrays.energy.copy(),
            loop_gap=np.hypot(sensors.gap_x, sensors.gap_z),
        )
        return Observation(
            time=time,
            motor_pos=motor_pos,
            joint_pos=joint_pos,
            joint_vel=joint_vel,
            spring_torque=self._stiffness * (motor_pos - joint_pos),
            applied_pos=applied_pos.copy(),
            truth=truth,
        )
