import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.kinematics import (
    MODE_RADIAL,
    ModalConvention,
    direction,
    half_angle,
    joint_to_modal,
    joint_to_polar,
    joint_to_polar_rate,
    leg_points,
    modal_to_joint,
)

LENGTHS = (0.064, 0.133, 0.069)
ANGLE = st.floats(-3.0, 3.0)
CONVENTIONS = pytest.mark.parametrize("convention", ModalConvention)
BY_LAW = settings(derandomize=True, max_examples=80, deadline=None)


@BY_LAW
@given(q1=ANGLE, q2=ANGLE)
def test_the_foot_is_at_its_polar_coordinates(q1: float, q2: float) -> None:
    """Only because l2 = l1 + l3; by way of the joint positions instead of eq. (2)."""
    joint_pos = np.array([q1, q2])
    hip, knee, ankle, tip = leg_points(joint_pos, LENGTHS)
    angle, length = joint_to_polar(joint_pos, LENGTHS[1])
    assert np.allclose(tip - hip, length * direction(np.asarray(angle)), atol=1e-15)
    for (one, other), bone in zip(((hip, knee), (knee, ankle), (ankle, tip)), LENGTHS, strict=True):
        assert math.dist(one, other) == pytest.approx(bone)
    assert np.allclose((tip - ankle) / LENGTHS[2], (knee - hip) / LENGTHS[0], atol=1e-12)


@BY_LAW
@given(q1=ANGLE, q2=ANGLE, v1=ANGLE, v2=ANGLE)
def test_polar_rates_are_the_derivatives(q1: float, q2: float, v1: float, v2: float) -> None:
    joint_pos, joint_vel, step = np.array([q1, q2]), np.array([v1, v2]), 1e-6
    ahead = joint_to_polar(joint_pos + step * joint_vel, LENGTHS[1])
    behind = joint_to_polar(joint_pos - step * joint_vel, LENGTHS[1])
    rate = joint_to_polar_rate(joint_pos, joint_vel, LENGTHS[1])
    assert np.allclose(rate, (ahead - behind) / (2.0 * step), atol=1e-8)


@CONVENTIONS
@BY_LAW
@given(q1=ANGLE, q2=ANGLE)
def test_modal_coordinates_go_there_and_back(
    convention: ModalConvention, q1: float, q2: float
) -> None:
    joint_pos = np.array([q1, q2])
    modal = joint_to_modal(joint_pos, convention)
    assert np.allclose(modal_to_joint(modal, convention), joint_pos, atol=1e-14)
    assert modal[1] == pytest.approx(2.0 * convention.scale * half_angle(joint_pos))


def test_the_orthonormal_reading_is_a_rotation_and_the_literal_one_halves() -> None:
    unit = np.eye(2)
    matrix = joint_to_modal(unit).T
    assert np.allclose(matrix @ matrix.T, unit)
    assert joint_to_modal(np.array([-0.4, 0.4]), ModalConvention.LITERAL)[1] == pytest.approx(0.4)
    assert joint_to_modal(np.array([-0.4, 0.4]))[1] == pytest.approx(0.4 * math.sqrt(2.0))


@CONVENTIONS
def test_the_radial_mode_has_no_polar_part(convention: ModalConvention) -> None:
    along = joint_to_modal(MODE_RADIAL, convention)
    assert along[0] == 0.0
    assert along[1] > 0.0
    moved = joint_to_polar(np.array([-0.5, 0.5]) + 0.1 * MODE_RADIAL, LENGTHS[1])
    assert moved[0] == 0.0


def test_directions_are_from_straight_down_forward() -> None:
    assert np.allclose(direction(np.array(0.0)), [0.0, -1.0])
    assert np.allclose(direction(np.array(0.5 * np.pi)), [1.0, 0.0])
    stretched = leg_points(np.zeros(2), LENGTHS)
    assert np.allclose(stretched[:, 0], 0.0)
    assert stretched[3, 1] == pytest.approx(-2.0 * LENGTHS[1])


@pytest.mark.parametrize("shape", [(), (7,), (3, 4)])
def test_leading_axes_change_nothing(shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(1)
    many, rates = rng.normal(size=(2, *shape, 2))
    points = leg_points(many, LENGTHS)
    assert points.shape == (*shape, 4, 2)
    for index in np.ndindex(shape):
        one, rate = many[index], rates[index]
        assert np.array_equal(points[index], leg_points(one, LENGTHS))
        assert np.array_equal(joint_to_polar(many, 0.1)[index], joint_to_polar(one, 0.1))
        together = joint_to_polar_rate(many, rates, 0.1)[index]
        assert np.array_equal(together, joint_to_polar_rate(one, rate, 0.1))
        assert np.array_equal(joint_to_modal(many)[index], joint_to_modal(one))
        assert np.array_equal(modal_to_joint(many)[index], modal_to_joint(one))
