import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.control import (
    BangBang,
    BangBangConfig,
    Jump,
    JumpConfig,
    LegTargets,
    PositionJump,
    PositionJumpConfig,
    SetpointMeaning,
)
from legbench.design import LegDesign
from legbench.design.statics import Support, equilibrium, gravity_load
from legbench.errors import ConfigError
from legbench.kinematics import ModalConvention, joint_to_modal

SUPPORTS = st.sampled_from(list(Support))
CONVENTIONS = st.sampled_from(list(ModalConvention))


@settings(derandomize=True, max_examples=50, deadline=None)
@given(half=st.floats(0.2, 1.4), support=SUPPORTS, convention=CONVENTIONS)
def test_a_link_set_point_is_where_gravity_and_springs_balance(
    optimal: LegDesign, half: float, support: Support, convention: ModalConvention
) -> None:
    targets = LegTargets(designs=optimal, support=support, convention=convention)
    z2 = 2.0 * half * convention.scale
    motor_pos = targets.motor_at(z2, "z2")
    link = targets.link_at_rest(motor_pos)
    assert np.allclose(joint_to_modal(link, convention), [0.0, z2], atol=1e-9)
    torque = np.array(optimal.stiffness) * (motor_pos - link)
    assert np.allclose(torque, gravity_load(optimal, support).torque(link), atol=1e-9)


@settings(derandomize=True, max_examples=50, deadline=None)
@given(half=st.floats(0.2, 0.7), support=SUPPORTS)
def test_a_motor_set_point_is_the_motors_and_the_leg_sags_from_it(
    optimal: LegDesign, half: float, support: Support
) -> None:
    targets = LegTargets(designs=optimal, support=support, meaning=SetpointMeaning.MOTOR)
    z2 = math.sqrt(2.0) * half
    motor_pos = targets.motor_at(z2, "z2")
    assert np.allclose(joint_to_modal(motor_pos), [0.0, z2])
    sag = joint_to_modal(equilibrium(optimal, motor_pos, support) - motor_pos)[1]
    if support is Support.FOOT:
        assert sag > 0.0
    elif support is Support.TRUNK:
        assert sag < 0.0
    else:
        assert sag == 0.0


@pytest.mark.parametrize(
    ("z2", "joint", "value", "limits"),
    [
        (0.1, "knee", "0.141", "0.3 to 2.9"),
        (2.1, "knee", "2.970", "0.3 to 2.9"),
        (-0.5, "knee", "-0.707", "0.3 to 2.9"),
    ],
)
def test_a_set_point_beyond_the_stops_is_refused_with_the_stops(
    optimal: LegDesign, z2: float, joint: str, value: str, limits: str
) -> None:
    targets = LegTargets(designs=optimal, support=Support.NONE)
    message = (
        rf"set point z2 = {re.escape(f'{z2:g}')} rad \(link\) puts the {joint} at "
        rf"{re.escape(value)} rad; design 'optimal' allows {re.escape(limits)} rad"
    )
    with pytest.raises(ConfigError, match=message):
        targets.motor_at(z2, "z2")


def test_the_hip_has_stops_too(optimal: LegDesign) -> None:
    narrow = replace(optimal, limits=replace(optimal.limits, hip=(-0.5, 0.5)))
    with pytest.raises(ConfigError, match=r"puts the hip at -0\.707 rad.*allows -0\.5 to 0\.5 rad"):
        LegTargets(designs=narrow, support=Support.NONE).motor_at(1.0, "z2")


def test_springs_that_do_not_hold_the_leg_are_told(optimal: LegDesign) -> None:
    soft = replace(optimal, stiffness=(0.3, 0.3))
    for meaning, why in (
        (SetpointMeaning.LINK, r"stiffness \(0\.3, 0\.3\) N m/rad does not hold the leg up"),
        (SetpointMeaning.MOTOR, r"stiffness|puts the knee at"),
    ):
        targets = LegTargets(designs=soft, support=Support.FOOT, meaning=meaning)
        with pytest.raises(ConfigError, match=rf"set point z2 = 0\.5 rad .*({why})"):
            targets.motor_at(0.5, "z2")


@pytest.mark.parametrize("meaning", SetpointMeaning)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_set_point_that_is_no_number(
    optimal: LegDesign, value: float, meaning: SetpointMeaning
) -> None:
    targets = LegTargets(designs=optimal, support=Support.FOOT, meaning=meaning)
    with pytest.raises(ConfigError, match=r"set point z2 is .* rad; it must be a finite number"):
        targets.motor_at(value, "z2")


@settings(derandomize=True, max_examples=20, deadline=None)
@given(z2=st.floats(0.45, 1.6), factor=st.floats(0.9, 1.1))
def test_a_batch_has_the_set_points_of_its_legs(
    optimal: LegDesign, prototype: LegDesign, z2: float, factor: float
) -> None:
    third = replace(optimal, stiffness=(3.0 * factor, 3.0))
    legs = [optimal, prototype, third]
    batch = LegTargets(designs=legs, support=Support.FOOT)
    motor_pos = batch.motor_at(z2, "z2")
    link = batch.link_at_rest(motor_pos)
    for row, design in enumerate(legs):
        alone = LegTargets(designs=design, support=Support.FOOT)
        assert np.array_equal(motor_pos[row], alone.motor_at(z2, "z2"))
        assert np.array_equal(link[row], alone.link_at_rest(motor_pos[row]))
        assert batch.modal_stiffness()[row] == alone.modal_stiffness()
    assert np.array_equal(batch.radial(link), joint_to_modal(link)[:, 1])


@pytest.mark.parametrize("delay", [-0.1, math.nan, math.inf])
def test_a_delay_that_never_ends_is_refused(optimal: LegDesign, delay: float) -> None:
    targets = LegTargets(designs=optimal, support=Support.FOOT)
    message = r"delay is .* s; it must be zero or more, and finite"
    with pytest.raises(ConfigError, match=message):
        Jump(JumpConfig(delay=delay), targets)
    with pytest.raises(ConfigError, match=message):
        BangBang(BangBangConfig(delay=delay), targets)
    with pytest.raises(ConfigError, match=message):
        PositionJump(PositionJumpConfig(delay=delay), targets)
