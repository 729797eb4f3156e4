"""A generated model in minimal coordinates: MuJoCo's own forces, constraints eliminated."""

from dataclasses import dataclass

import mujoco
import numpy as np

from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.kinematics import half_angle
from legbench.mjcf import BuildOptions, Linkage, LinkageKind, build_spec, rest_qpos, to_xml
from legbench.signals import Floats

SWING = 10.0
"""Rate of the half angle at which velocity forces are taken [rad/s]: a hop's."""
WINDUP = 0.1
"""How far the motors stand off the joints when spring forces are taken [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Forces:
    """The model in minimal coordinates: trunk x and z where free, then q1, q2."""

    mass: Floats
    """(n, n)"""
    bias: Floats
    """Gravity and velocity forces while x2 moves at a constant rate (n,)."""
    gravity: Floats
    spring: Floats
    damper: Floats


class Reduced:
    """A generated model with its constraints eliminated."""

    def __init__(self, design: LegDesign, kind: SetupKind) -> None:
        options = BuildOptions(setup=Setup(kind=kind), linkage=Linkage(kind=LinkageKind.REDUCED))
        spec = build_spec(design, options)
        self.design, self.kind = design, kind
        self.model = mujoco.MjModel.from_xml_string(to_xml(spec))
        self.data = mujoco.MjData(self.model)
        self.tip = self.model.site("tip").id
        self.foot = int(self.model.site_bodyid[self.tip])
        address = {self.model.joint(i).name: i for i in range(self.model.njnt)}
        legs = np.zeros((self.model.nv, 2))
        legs[address["hip"], 0] = 1.0
        legs[address["knee"]] = (-1.0, 1.0)
        legs[address["ankle"]] = (1.0, -1.0)
        self.legs = legs
        self.trunk = [address[name] for name in ("trunk_x", "trunk_z") if name in address]

    def at(self, joint_pos: Floats) -> Forces:
        """All forces at a posture (2,) [rad]."""
        model, data = self.model, self.data
        rate = SWING * np.array([-1.0, 1.0])
        half = float(half_angle(joint_pos))
        # x2 = 2 l2 cos(half) moves evenly: d2(half)/dt2 = -rate^2 cot(half)
        bend = -(SWING**2) / np.tan(half) * np.array([-1.0, 1.0])
        self._place(joint_pos, np.zeros(2))
        basis, _ = self._basis(np.zeros(2))
        gravity = basis.T @ data.qfrc_bias
        spring = basis.T @ data.qfrc_actuator
        self._place(joint_pos, rate)
        basis, turning = self._basis(rate)
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        minimal = np.zeros(basis.shape[1])
        minimal[-2:] = bend
        velocity = data.qfrc_bias + full @ (turning + basis @ minimal)
        return Forces(
            mass=basis.T @ full @ basis,
            bias=basis.T @ velocity,
            gravity=gravity,
            spring=spring,
            damper=basis.T @ data.qfrc_passive,
        )

    def static(self, joint_pos: Floats, motor_pos: Floats) -> Floats:
        """Spring less gravity on q1, q2 (2,) [N m] at a posture and motor positions (2,) [rad]."""
        self._place(joint_pos, np.zeros(2), motor_pos)
        basis, _ = self._basis(np.zeros(2))
        return (basis.T @ (self.data.qfrc_actuator - self.data.qfrc_bias))[-2:]

    def _place(self, joint_pos: Floats, rate: Floats, motor_pos: Floats | None = None) -> None:
        data = self.data
        windup = WINDUP * np.array([-1.0, 1.0])
        data.qpos[:] = rest_qpos(self.model, self.design, joint_pos)
        data.qvel[:] = 0.0
        data.ctrl[:] = joint_pos + windup if motor_pos is None else motor_pos
        mujoco.mj_forward(self.model, data)
        basis, _ = self._basis(np.zeros(2))
        minimal = np.zeros(basis.shape[1])
        minimal[-2:] = rate
        data.qvel[:] = basis @ minimal
        mujoco.mj_forward(self.model, data)

    def _basis(self, rate: Floats) -> tuple[Floats, Floats]:
        """`qvel = basis @ minimal`, and the part of qacc that velocities alone make.

        A pinned foot makes the trunk follow the joints: its row of the tip's Jacobian is solved
        for the trunk. A free trunk has coordinates of its own.
        """
        nothing = np.zeros(self.model.nv)
        if not self.trunk:
            return self.legs, nothing
        columns = np.zeros((self.model.nv, 2))
        columns[self.trunk, [0, 1]] = 1.0
        if self.kind is not SetupKind.FFS:
            return np.concatenate((columns, self.legs), axis=1), nothing
        jacobian = np.zeros((3, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, jacobian, None, self.tip)
        plane = jacobian[[0, 2]]
        follow = -np.linalg.solve(plane[:, self.trunk], plane @ self.legs)
        basis = self.legs + columns @ follow
        drift = np.zeros((3, self.model.nv))
        point = self.data.site_xpos[self.tip]
        mujoco.mj_jacDot(self.model, self.data, drift, None, point, self.foot)
        turning = -np.linalg.solve(plane[:, self.trunk], drift[[0, 2]] @ (basis @ rate))
        return basis, columns @ turning
