"""The generated model against the laws that geometry and the design alone dictate."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mjcf_legs import (
    LINKAGES,
    SETUPS,
    embedding,
    mass_matrix,
    model_of,
    posed,
    postures,
)

from legbench.design import LegDesign
from legbench.design.statics import GRAVITY, gravity_load
from legbench.kinematics import leg_points
from legbench.mjcf import Linkage
from legbench.mjcf.sensors import SensorLayout

MOVING = [name for name, setup in SETUPS.items() if setup.trunk_moves]
PIN_MASS = 0.001
"""Of the body that slides sideways under the foot of a leg on a boom [kg]."""


@pytest.mark.parametrize("linkage", LINKAGES)
@pytest.mark.parametrize("setup", SETUPS)
def test_the_system_weighs_what_the_design_says(
    optimal: LegDesign, setup: str, linkage: str
) -> None:
    model = model_of(optimal, setup, linkage)
    total = float(np.sum(model.body_mass))
    pin = PIN_MASS if setup == "boom" else 0.0
    assert total == pytest.approx(optimal.total_mass + pin, abs=1e-15)
    assert optimal.total_mass == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("setup", SETUPS)
def test_loops_are_closed_at_rest_in_every_posture(prototype: LegDesign, setup: str) -> None:
    model = model_of(prototype, setup, "bars")
    layout = SensorLayout.of(model)
    for joint_pos in postures():
        data = posed(model, prototype, joint_pos)
        views = layout.views(data.sensordata)
        assert np.max(np.hypot(views.gap_x, views.gap_z)) < 1e-12
        tip = data.site("tip").xpos
        hip = data.site("hip").xpos
        if setup in MOVING:
            assert abs(tip[0]) < 1e-12
            assert abs(tip[2]) < 1e-12
        if setup in ("ffs", "boom"):
            assert np.max(np.abs(tip - data.site("pin").xpos)) < 1e-12
        if setup != "boom":
            reach = leg_points(joint_pos, prototype.lengths)[3]
            assert np.allclose((tip - hip)[[0, 2]], reach, atol=1e-14)


MODELS: dict[str, mujoco.MjModel] = {}


@settings(derandomize=True, max_examples=30, deadline=None)
@given(
    knee=st.floats(0.3, 2.9),
    polar=st.floats(-0.6, 0.6),
    setup=st.sampled_from(["ffs", "boom", "jump", "vfts"]),
)
def test_every_constraint_of_the_model_holds_at_rest(
    optimal: LegDesign, knee: float, polar: float, setup: str
) -> None:
    """MuJoCo's own residuals, whatever the constraint."""
    if setup not in MODELS:
        MODELS[setup] = model_of(optimal, setup, "bars")
    model = MODELS[setup]
    joint_pos = np.array([polar - 0.5 * knee, polar + 0.5 * knee])
    data = posed(model, optimal, joint_pos)
    residuals = data.efc_pos[: data.ne]
    assert len(residuals) >= 6
    assert np.max(np.abs(residuals)) < 1e-12


def test_a_fixed_trunk_moves_by_the_kinetic_energy_of_rigid_bodies(optimal: LegDesign) -> None:
    model = model_of(optimal, "hfts", "reduced")
    for joint_pos in postures():
        data = posed(model, optimal, joint_pos)
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        onto = np.array([[1.0, 0.0], [-1.0, 1.0], [1.0, -1.0]])
        assert np.allclose(embedding(model, optimal, joint_pos), onto, atol=1e-9)
        expected = mass_matrix(optimal, joint_pos)[2:, 2:]
        assert np.allclose(onto.T @ full @ onto, expected, rtol=1e-12, atol=1e-16)


def test_a_free_trunk_moves_by_the_kinetic_energy_of_rigid_bodies(prototype: LegDesign) -> None:
    model = model_of(prototype, "jump", "reduced")
    onto = np.zeros((5, 4))
    onto[:2, :2] = np.eye(2)
    onto[2:, 2:] = [[1.0, 0.0], [-1.0, 1.0], [1.0, -1.0]]
    for joint_pos in postures():
        data = posed(model, prototype, joint_pos)
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        expected = mass_matrix(prototype, joint_pos)
        assert np.allclose(onto.T @ full @ onto, expected, rtol=1e-12, atol=1e-16)


def test_bars_add_their_own_kinetic_energy_and_no_other(optimal: LegDesign) -> None:
    """Thin rods: the crank about the hip, both bars moved in parallel with a segment."""
    model = model_of(optimal, "hfts", "bars")
    linkage = Linkage()
    arm, density = linkage.crank_length, linkage.density(optimal)
    l1, l2, _ = optimal.lengths
    for joint_pos in postures():
        data = posed(model, optimal, joint_pos)
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        onto = embedding(model, optimal, joint_pos)
        expected = mass_matrix(optimal, joint_pos)[2:, 2:]
        c = np.cos(joint_pos[1] - joint_pos[0])
        expected[1, 1] += density * arm**3 / 3.0
        rod1, rod2 = density * l1, density * l2
        along_thigh = [[l1**2 / 3.0, 0.5 * arm * l1 * c], [0.5 * arm * l1 * c, arm**2]]
        reach = l1 + arm
        along_shank = [[reach**2, 0.5 * reach * l2 * c], [0.5 * reach * l2 * c, l2**2 / 3.0]]
        expected += rod1 * np.array(along_thigh) + rod2 * np.array(along_shank)
        assert np.allclose(onto.T @ full @ onto, expected, rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("setup", ["hfts", "vfts", "ffs", "jump"])
def test_gravity_pulls_as_statics_says(optimal: LegDesign, setup: str) -> None:
    model = model_of(optimal, setup, "reduced")
    load = gravity_load(optimal, SETUPS[setup].support)
    for joint_pos in postures():
        data = posed(model, optimal, joint_pos)
        pull = embedding(model, optimal, joint_pos).T @ data.qfrc_bias
        assert np.allclose(pull, load.torque(joint_pos), atol=1e-8)


@pytest.mark.parametrize("linkage", LINKAGES)
@pytest.mark.parametrize("setup", [name for name in SETUPS if name != "hfts"])
def test_gravity_torque_is_the_slope_of_the_potential_energy(
    prototype: LegDesign, setup: str, linkage: str
) -> None:
    model = model_of(prototype, setup, linkage)
    step = 1e-5

    def potential(joint_pos: np.ndarray) -> float:
        return float(posed(model, prototype, joint_pos).energy[0])

    for joint_pos in postures()[::4]:
        data = posed(model, prototype, joint_pos)
        pull = embedding(model, prototype, joint_pos).T @ data.qfrc_bias
        slope = [
            (potential(joint_pos + step * side) - potential(joint_pos - step * side)) / (2.0 * step)
            for side in np.eye(2)
        ]
        assert np.allclose(pull, slope, atol=1e-6)


def test_bars_change_gravity_by_no_more_than_their_weight(optimal: LegDesign) -> None:
    model = model_of(optimal, "ffs", "bars")
    load = gravity_load(optimal, SETUPS["ffs"].support)
    bound = GRAVITY * Linkage().mass(optimal) * 2.0 * optimal.shank.length
    for joint_pos in postures():
        data = posed(model, optimal, joint_pos)
        pull = embedding(model, optimal, joint_pos).T @ data.qfrc_bias
        assert np.max(np.abs(pull - load.torque(joint_pos))) < bound


def test_gravity_does_no_work_on_a_table(optimal: LegDesign) -> None:
    model = model_of(optimal, "hfts", "bars")
    energies = {round(float(posed(model, optimal, q).energy[0]), 12) for q in postures()}
    assert len(energies) == 1
    assert np.linalg.norm(model.opt.gravity) == pytest.approx(GRAVITY)


@pytest.mark.parametrize("linkage", LINKAGES)
@pytest.mark.parametrize("setup", SETUPS)
def test_springs_pull_links_to_motors_and_dampers_brake_them(
    prototype: LegDesign, setup: str, linkage: str
) -> None:
    model = model_of(prototype, setup, linkage)
    joint_pos, motor_pos, rates = (
        np.array([-0.7, 0.5]),
        np.array([-0.9, 0.8]),
        np.array([1.3, -2.1]),
    )
    data = posed(model, prototype, joint_pos)
    onto = embedding(model, prototype, joint_pos)
    data.ctrl[:] = motor_pos
    data.qvel[:] = onto @ rates
    mujoco.mj_forward(model, data)
    torque = onto.T @ data.qfrc_actuator
    assert np.allclose(torque, np.array(prototype.stiffness) * (motor_pos - joint_pos), atol=1e-8)
    braking = onto.T @ data.qfrc_passive
    assert np.allclose(braking, -np.array(prototype.damping) * rates, atol=1e-8)


@pytest.mark.parametrize("linkage", LINKAGES)
@pytest.mark.parametrize("setup", SETUPS)
def test_it_looks_like_a_leg_and_looks_move_nothing(
    optimal: LegDesign, setup: str, linkage: str
) -> None:
    model = model_of(optimal, setup, linkage)
    geoms = {model.geom(index).name for index in range(model.ngeom)}
    assert {"trunk_box", "thigh", "shank", "foot", "servo_thigh", "servo_shank"} <= geoms
    assert ("bar_thigh_rod" in geoms) == (linkage == "bars")
    assert ("table" if setup == "hfts" else "ground") in geoms
    assert model.camera("side").id >= 0
    assert model.nlight == 1
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    assert model.npair == (1 if setup == "jump" else 0)


def test_joints_stop_where_the_design_says(optimal: LegDesign) -> None:
    for setup in SETUPS:
        for linkage in LINKAGES:
            model = model_of(optimal, setup, linkage)
            assert tuple(model.joint("hip").range) == optimal.limits.hip
            assert tuple(model.joint("knee").range) == optimal.limits.knee
