"""A third engine, from the package index: recursive algorithms on the open tree of bodies.

Needs the test group `pinocchio`; skipped without it.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from legbench.analytic import Bars, LegModel, floating_terms
from legbench.analytic import equations as eq
from legbench.analytic import matrices as mx
from legbench.design import load_design
from legbench.design.statics import GRAVITY
from legbench.signals import Floats

pin: Any = pytest.importorskip("pinocchio")

DESIGN = load_design(Path(__file__).parents[2] / "models" / "prototype.toml")
BARS = Bars(density=0.007, crank_length=0.02)
LEG = ("x", "z", "hip", "knee", "ankle")
ALL = (*LEG, "crank", "bar_thigh", "bar_shank")
IN_ABSOLUTE = {
    "x": (1, 0, 0, 0),
    "z": (0, 1, 0, 0),
    "hip": (0, 0, 1, 0),
    "knee": (0, 0, -1, 1),
    "ankle": (0, 0, 1, -1),
    "crank": (0, 0, 0, 1),
    "bar_thigh": (0, 0, 1, -1),
    "bar_shank": (0, 0, -1, 1),
}
"""Relative joint angles from `[x_t, z_t, q1, q2]`, loops closed."""
PLANE = [0, 2]
TORQUE = (0.7, -1.3)


def rod(length: float) -> tuple[float, float, float]:
    mass = BARS.density * length
    return mass, 0.5 * length, mass * length**2 / 12.0


def build(*, bars: bool) -> Any:
    """The tree: trunk on two slides, a body a segment, hanging down at zero."""
    model = pin.Model()
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    ids = {"trunk": 0}

    def add(name: str, parent: str, joint: Any, down: float, body: tuple[float, ...]) -> None:
        place = pin.SE3(np.eye(3), np.array([0.0, 0.0, -down]))
        ids[name] = model.addJoint(ids[parent], joint, place, name)
        mass, com, inertia = body
        tensor = np.diag([inertia, inertia, 1e-9])
        inertial = pin.Inertia(mass, np.array([0.0, 0.0, -com]), tensor)
        model.appendBodyToJoint(ids[name], inertial, pin.SE3.Identity())

    def hinge() -> Any:
        return pin.JointModelRevoluteUnaligned(np.array([0.0, -1.0, 0.0]))

    def of(segment: Any) -> tuple[float, float, float]:
        return segment.mass, segment.com, segment.inertia

    l1, l2, _ = DESIGN.lengths
    arm = BARS.crank_length
    linkage = sum(rod(length)[0] for length in (arm, l1, l2)) if bars else 0.0
    add("x", "trunk", pin.JointModelPX(), 0.0, (0.0, 0.0, 0.0))
    add("z", "x", pin.JointModelPZ(), 0.0, (DESIGN.trunk_mass - linkage, 0.0, 0.0))
    add("hip", "z", hinge(), 0.0, of(DESIGN.thigh))
    add("knee", "hip", hinge(), l1, of(DESIGN.shank))
    add("ankle", "knee", hinge(), l2, of(DESIGN.foot))
    if bars:
        # Depth first: the engine wants the coordinates of a subtree side by side.
        add("bar_shank", "hip", hinge(), l1 + arm, rod(l2))
        add("crank", "z", hinge(), 0.0, rod(arm))
        add("bar_thigh", "crank", hinge(), arm, rod(l1))
        for name, parent, down in (
            ("thigh_a", "bar_thigh", l1),
            ("thigh_b", "knee", arm),
            ("foot_a", "bar_shank", l2),
            ("foot_b", "ankle", arm),
        ):
            place = pin.SE3(np.eye(3), np.array([0.0, 0.0, -down]))
            model.addFrame(pin.Frame(name, ids[parent], place, pin.FrameType.OP_FRAME))
    return model


def order(model: Any, names: tuple[str, ...]) -> Floats:
    """Rows of the tree's coordinates as functions of the absolute ones."""
    mapping = np.zeros((model.nv, 4))
    for name in names:
        mapping[model.joints[model.getJointId(name)].idx_v] = IN_ABSOLUTE[name]
    return mapping


def states(count: int = 40) -> tuple[Floats, Floats]:
    random = np.random.default_rng(21)
    q1 = random.uniform(-1.8, 0.5, count)
    knee = random.uniform(0.35, 2.8, count)
    pos = np.stack([*random.uniform(-1.0, 1.0, (2, count)), q1, q1 + knee], axis=-1)
    return pos, random.uniform(-1.0, 1.0, (count, 4)) * np.array([2.0, 2.0, 15.0, 15.0])


@pytest.mark.parametrize("bars", [False, True], ids=["massless", "bars"])
def test_mass_matrix_and_bias(bars: bool) -> None:
    model = build(bars=bars)
    data, mapping = model.createData(), order(model, ALL if bars else LEG)
    terms = floating_terms(DESIGN, bars=BARS if bars else None)
    for pos, vel in zip(*states(), strict=True):
        mass = pin.crba(model, data, mapping @ pos)
        mass = np.triu(mass) + np.triu(mass, 1).T
        bias = pin.nonLinearEffects(model, data, mapping @ pos, mapping @ vel)
        ours = mx.floating_coriolis(terms, pos, vel) @ vel + mx.floating_gravity(terms, pos)
        assert np.max(np.abs(mapping.T @ mass @ mapping - mx.floating_mass(terms, pos))) < 1e-12
        assert np.max(np.abs(mapping.T @ bias - ours)) < 1e-12 * (1.0 + np.max(np.abs(ours)))


def test_constrained_acceleration_of_the_bars() -> None:
    model = build(bars=True)
    data, mapping = model.createData(), order(model, ALL)
    leg = LegModel.of(DESIGN, bars=BARS)
    frames = [
        [model.getFrameId(f"{loop}_{end}") for end in ("a", "b")] for loop in ("thigh", "foot")
    ]
    world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    drive = np.zeros(model.nv)  # springs 1 and 2 turn hip and crank, as in the real leg
    drive[model.joints[model.getJointId("hip")].idx_v] = TORQUE[0]
    drive[model.joints[model.getJointId("crank")].idx_v] = TORQUE[1]
    for pos, vel in zip(*states(), strict=True):
        tree_pos, tree_vel = mapping @ pos, mapping @ vel
        pin.forwardKinematics(model, data, tree_pos, tree_vel, np.zeros(model.nv))
        pin.updateFramePlacements(model, data)
        gaps, rows, drifts = [], [], []
        for first, second in frames:
            gaps.append((data.oMf[first].translation - data.oMf[second].translation)[PLANE])
            both = [
                pin.computeFrameJacobian(model, data, tree_pos, frame, world)[PLANE]
                for frame in (first, second)
            ]
            rows.append(both[0] - both[1])
            moved = [
                pin.getFrameClassicalAcceleration(model, data, frame, world).linear[PLANE]
                for frame in (first, second)
            ]
            drifts.append(moved[0] - moved[1])
        assert np.max(np.abs(gaps)) < 1e-14
        jacobian, drift = np.concatenate(rows), np.concatenate(drifts)
        mass = pin.crba(model, data, tree_pos)
        mass = np.triu(mass) + np.triu(mass, 1).T
        bias = pin.nonLinearEffects(model, data, tree_pos, tree_vel)
        system = np.block([[mass, jacobian.T], [jacobian, np.zeros((4, 4))]])
        solved = np.linalg.solve(system, np.concatenate([drive - bias, -drift]))[: model.nv]
        q, v = (pos[2], pos[3]), (vel[2], vel[3])
        joints = eq.pair_acceleration(eq.SCALAR, leg.falling, q, v, TORQUE)
        trunk = eq.trunk_acceleration(eq.SCALAR, leg.floating, q, v, joints)
        wanted = mapping @ np.array([*trunk, *joints]) + 0.0
        assert np.max(np.abs(solved - wanted)) < 1e-9 * (1.0 + np.max(np.abs(wanted)))
