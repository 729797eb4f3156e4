"""Modal matching measured on the generated MuJoCo model, over the whole range of x2.

Nothing here uses the algebra of `design.matching` except to compare with it: inertia matrix, bias,
spring and damper forces are MuJoCo's own, the constraints are eliminated with MuJoCo's Jacobians,
and what is left is projected onto the polar coordinates. The linkage is `reduced`, the paper's
massless one; bars would add masses that the conditions do not know.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from legbench.design import LegDesign
from legbench.design.matching import Condition, Parameters, check_conditions
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import GRAVITY
from legbench.mjcf import BuildOptions, Linkage, LinkageKind, build_spec, rest_qpos, to_xml
from legbench.signals import Floats

POSTURES = 60
"""Leg lengths x2 that are looked at, spread evenly in the half angle."""
SWING = 10.0
"""Rate of the half angle at which velocity forces are taken [rad/s]: a hop's."""
WINDUP = 0.1
"""How far the motors stand off the joints when spring forces are taken [rad]."""
TILT = 1e-4
"""Polar angle by which the leg is tilted to measure stability [rad]."""
AGREES = 1e-9
"""Difference of model and algebra that is rounding, of the scale of the terms [-]."""
TILT_AGREES = 1e-6
"""The same for stability, where the model's value is a finite difference [-]."""

SETUPS = (SetupKind.HFTS, SetupKind.VFTS, SetupKind.FFS, SetupKind.JUMP)


@dataclass(frozen=True, slots=True, kw_only=True)
class Projection:
    """One condition in one setup, over the whole range of x2."""

    setup: SetupKind
    condition: str
    coupling: float
    """Largest coupling of the radial motion into the others, of the terms' size [-]."""
    disagreement: float | None
    """Largest difference from the algebra, of its scale [-]; none where it has no formula."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelCheck:
    """The generated model against the conditions, and against the algebra."""

    rows: tuple[Projection, ...]
    shortest: float
    """Range of leg lengths that was looked at [m]."""
    longest: float

    @property
    def coupling(self) -> float:
        """Largest coupling of all [-]; a matched leg's is rounding."""
        return max(row.coupling for row in self.rows if row.condition != "stability")

    @property
    def disagreement(self) -> float:
        """Largest difference of model and algebra, in units of what is allowed [-]."""
        return max(
            row.disagreement / (TILT_AGREES if row.condition == "stability" else AGREES)
            for row in self.rows
            if row.disagreement is not None
        )

    @property
    def agrees(self) -> bool:
        """Whether generator and algebra say the same."""
        return self.disagreement <= 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Forces:
    """The model in minimal coordinates: trunk x and z where free, then q1, q2."""

    mass: Floats
    """(n, n)"""
    bias: Floats
    """Gravity and velocity forces while x2 moves at a constant rate (n,)."""
    gravity: Floats
    spring: Floats
    damper: Floats


class _Reduced:
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

    def at(self, joint_pos: Floats) -> _Forces:
        """All forces at a posture (2,) [rad]."""
        model, data = self.model, self.data
        rate = SWING * np.array([-1.0, 1.0])
        half = 0.5 * float(joint_pos[1] - joint_pos[0])
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
        return _Forces(
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


def check_model(design: LegDesign) -> ModelCheck:
    """Project the generated model of a design onto polar coordinates in all four setups."""
    low, high = design.limits.knee
    halves = np.linspace(0.5 * low, 0.5 * high, POSTURES)
    rows = [row for kind in SETUPS for row in _check_setup(design, kind, halves)]
    reach = 2.0 * design.shank.length
    return ModelCheck(
        rows=tuple(rows),
        shortest=float(reach * np.cos(halves[-1])),
        longest=float(reach * np.cos(halves[0])),
    )


def _check_setup(design: LegDesign, kind: SetupKind, halves: Floats) -> list[Projection]:
    reduced = _Reduced(design, kind)
    seen = [reduced.at(np.array([-half, half])) for half in halves]
    inertia, elastic, gravity, damping, _ = check_conditions(
        Parameters.of(design), float(halves[0])
    )
    even = np.ones_like(halves)
    weight = GRAVITY * np.sin(halves)
    rows = [
        _inertia(kind, seen, halves, design, (inertia, gravity)),
        _forces(kind, "elastic", [forces.spring for forces in seen], (elastic, -WINDUP * even)),
        _forces(kind, "damping", [forces.damper for forces in seen], (damping, SWING * even)),
        _forces(kind, "velocity", [forces.bias - forces.gravity for forces in seen], None),
    ]
    if kind is not SetupKind.HFTS:
        formula = None if kind is SetupKind.JUMP else (gravity, weight)
        rows.append(_forces(kind, "gravity", [forces.gravity for forces in seen], formula))
    if kind is SetupKind.FFS:
        rows.append(_stability(reduced, design, halves))
    return rows


def _forces(
    kind: SetupKind, name: str, forces: list[Floats], formula: tuple[Condition, Floats] | None
) -> Projection:
    """The polar part of forces (n,) at every length, against `factor * residual` of the algebra.

    x1 moves q1 and q2 together: the polar part is the sum of the two.
    """
    joints = np.array([force[-2:] for force in forces])
    polar, size = joints.sum(axis=1), float(np.abs(joints).sum(axis=1).max())
    apart = None
    if formula is not None:
        condition, factor = formula
        scale = float(np.abs(factor).max()) * condition.scale
        apart = _relative(float(np.abs(polar - factor * condition.residual).max()), scale)
    return Projection(
        setup=kind,
        condition=name,
        coupling=_relative(float(np.abs(polar).max()), size),
        disagreement=apart,
    )


def _relative(value: float, scale: float) -> float:
    return value / scale if scale > 0.0 else 0.0


def _inertia(
    kind: SetupKind,
    seen: list[_Forces],
    halves: Floats,
    design: LegDesign,
    conditions: tuple[Condition, Condition],
) -> Projection:
    """Inertia coupling of x2 into x1, and with a free trunk of (z, x2) into (x, x1).

    The algebra has eq. (5) for the pinned foot. With the trunk fixed it is `M11 = M22` of the
    hanging leg, which differs from (5) by `2 l2` times the residual of gravity.
    """
    inertia, gravity = conditions
    l2 = design.shank.length
    expected, scale = -inertia.residual, inertia.scale
    if kind is not SetupKind.FFS:
        expected -= 2.0 * l2 * gravity.residual
        scale += 2.0 * l2 * gravity.scale
    coupling, apart = 0.0, 0.0
    for forces, half in zip(seen, halves, strict=True):
        t8 = 1.0 / (2.0 * l2 * np.sin(half))
        change = np.eye(len(forces.mass))
        change[-2:, -2:] = np.array([[1.0, t8], [1.0, -t8]])
        mass = change.T @ forces.mass @ change
        size = np.sqrt(np.diag(mass))
        share = np.abs(mass) / np.outer(size, size)
        radial = [-1] if len(mass) == 2 else [-1, 1]
        other = [-2] if len(mass) == 2 else [-2, 0]
        coupling = max(coupling, float(share[np.ix_(radial, other)].max()))
        apart = max(apart, abs(float(mass[-2, -1]) / t8 - expected) / scale)
    return Projection(
        setup=kind,
        condition="inertia",
        coupling=coupling,
        disagreement=None if kind is SetupKind.JUMP else apart,
    )


def _stability(reduced: _Reduced, design: LegDesign, halves: Floats) -> Projection:
    """Restoring torque of a tilted leg against eq. (10), at every length."""
    apart = []
    for half in halves:
        upright = np.array([-half, half])
        condition = check_conditions(Parameters.of(design), float(half))[-1]
        pushed = [
            reduced.static(upright + sign * TILT, upright).sum() / TILT for sign in (-1.0, 1.0)
        ]
        margin = 0.5 * (pushed[0] - pushed[1])
        apart.append(abs(margin - condition.residual) / condition.scale)
    return Projection(
        setup=reduced.kind, condition="stability", coupling=0.0, disagreement=float(max(apart))
    )
