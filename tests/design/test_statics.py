from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.design import LegDesign
from legbench.design.statics import (
    GRAVITY,
    Support,
    equilibrium,
    gravity_load,
    motor_holding,
)
from legbench.errors import DesignError
from legbench.kinematics import leg_points

BY_LAW = settings(derandomize=True, max_examples=50, deadline=None)
SUPPORTS = st.sampled_from(list(Support))
HALF, POLAR = st.floats(0.1, 1.5), st.floats(-0.5, 0.5)


def potential(design: LegDesign, joint_pos: np.ndarray, support: Support) -> float:
    """Of all masses over the point that is held, from where they are [J]."""
    if support is Support.NONE:
        return 0.0
    l1, l2, _ = design.lengths
    c1, c2, c3 = (segment.com for segment in design.segments)
    heights = [
        leg_points(joint_pos, (c1, l2, 0.0))[1, 1],
        leg_points(joint_pos, (l1, c2, 0.0))[2, 1],
        leg_points(joint_pos, (l1, l2, c3))[3, 1],
        0.0,
    ]
    masses = [segment.mass for segment in design.segments] + [design.trunk_mass]
    if support is Support.FOOT:
        below = leg_points(joint_pos, design.lengths)[3, 1]
        heights = [height - below for height in heights]
    return GRAVITY * float(np.dot(masses, heights))


@BY_LAW
@given(half=HALF, polar=POLAR, support=SUPPORTS)
def test_gravity_torque_is_the_slope_of_the_potential(
    optimal: LegDesign, half: float, polar: float, support: Support
) -> None:
    joint_pos, step = np.array([polar - half, polar + half]), 1e-6
    slope = [
        (
            potential(optimal, joint_pos + step * side, support)
            - potential(optimal, joint_pos - step * side, support)
        )
        / (2.0 * step)
        for side in np.eye(2)
    ]
    assert np.allclose(gravity_load(optimal, support).torque(joint_pos), slope, atol=1e-8)


@BY_LAW
@given(half=st.floats(0.1, 1.4), polar=POLAR, support=SUPPORTS)
def test_the_motors_that_hold_a_posture_have_it_as_their_equilibrium(
    prototype: LegDesign, half: float, polar: float, support: Support
) -> None:
    joint_pos = np.array([polar - half, polar + half])
    motor_pos = motor_holding(prototype, joint_pos, support)
    moment = np.array(gravity_load(prototype, support).moment)
    stable = np.all(np.array(prototype.stiffness) + moment * np.cos(joint_pos) > 1e-3)
    if stable:
        found = equilibrium(prototype, motor_pos, support)
        assert np.allclose(found, joint_pos, atol=1e-8)
    assert motor_pos is not joint_pos


def test_nothing_to_carry_needs_no_torque(optimal: LegDesign) -> None:
    posture = np.array([[-0.4, 0.9], [0.2, 0.3]])
    assert np.array_equal(motor_holding(optimal, posture, Support.NONE), posture)
    assert np.allclose(equilibrium(optimal, posture, Support.NONE), posture)


def test_a_standing_leg_sags_and_a_hanging_one_stretches(optimal: LegDesign) -> None:
    motor_pos = np.array([-0.5, 0.5])
    standing = equilibrium(optimal, motor_pos, Support.FOOT)
    hanging = equilibrium(optimal, motor_pos, Support.TRUNK)
    assert standing[1] - standing[0] > 1.0 > hanging[1] - hanging[0]


def test_the_optimal_leg_sags_along_its_mode(optimal: LegDesign) -> None:
    """Gravity decouples: t1 + t3 = t2, to the rounding of the table."""
    first, second = gravity_load(optimal, Support.FOOT).moment
    assert first == pytest.approx(second, rel=2e-2)


def test_rows_are_single_postures(optimal: LegDesign) -> None:
    rng = np.random.default_rng(4)
    motor_pos = np.array([-0.6, 0.6]) + rng.uniform(-0.2, 0.2, (3, 5, 2))
    together = equilibrium(optimal, motor_pos, Support.FOOT)
    for index in np.ndindex(3, 5):
        alone = equilibrium(optimal, motor_pos[index], Support.FOOT)
        assert np.allclose(together[index], alone, atol=1e-12)


def test_springs_that_are_too_soft_are_told(optimal: LegDesign) -> None:
    soft = replace(optimal, stiffness=(0.05, 0.05))
    with pytest.raises(DesignError, match=r"no stable equilibrium .*\(0\.05, 0\.05\) N m/rad"):
        equilibrium(soft, np.array([-0.01, 0.01]), Support.FOOT)


def test_a_motor_position_that_is_no_number(optimal: LegDesign) -> None:
    with pytest.raises(DesignError, match="no stable equilibrium"):
        equilibrium(optimal, np.array([np.nan, 0.5]), Support.FOOT)
