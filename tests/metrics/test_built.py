"""The leg as it was built, behind readings that are wrong by what the run says."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from metrics_runs import PROTOTYPE

from legbench.imperfections import Imperfections
from legbench.metrics.built import Built, built_of

READINGS = {
    "motor_pos": np.array([[-0.5, 0.5], [-0.25, 0.75]]),
    "joint_pos": np.array([[-0.625, 0.5], [-0.375, 1.0]]),
    "joint_vel": np.array([[2.0, -4.0], [-1.0, 0.5]]),
    "trunk_vel": np.array([[0.5, -2.0], [-1.0, 1.0]]),
}


class Run:
    """A run of two rows with some imperfections."""

    def __init__(self, **found: Any) -> None:
        self.description = SimpleNamespace(design=PROTOTYPE, imperfections=Imperfections(**found))
        self.time = np.array([0.0, 0.001])

    def __getitem__(self, name: str) -> Any:
        return READINGS[name]


def built(**found: Any) -> Built:
    return built_of(cast(Any, Run(**found)))


def test_a_perfect_leg_is_what_it_shows() -> None:
    leg = built()
    assert leg.design == PROTOTYPE
    assert leg.shaft.tolist() == READINGS["motor_pos"].tolist()
    assert leg.joint.tolist() == READINGS["joint_pos"].tolist()
    assert leg.other_power.tolist() == [0.0, 0.0]
    assert leg.half_play.tolist() == [0.0, 0.0]


def test_zeros_of_encoders_are_taken_back_each_in_its_own_way() -> None:
    # A link encoder shows its zero at 0; a motor is at its zero where its encoder shows 0.
    leg = built(motor_zero=(0.125, -0.25), link_zero=(0.5, -0.125))
    assert leg.shaft.tolist() == [[-0.375, 0.25], [-0.125, 0.5]]
    assert leg.joint.tolist() == [[-1.125, 0.625], [-0.875, 1.125]]


@pytest.mark.parametrize("noise", ["motor_noise", "link_noise"])
def test_of_noisy_readings_no_position_is_known(noise: str) -> None:
    leg = built(**{noise: (1e-3, 1e-3)})
    assert np.isnan(leg.shaft).all()
    assert np.isnan(leg.joint).all()


def test_dry_friction_and_the_guide_take_power() -> None:
    assert built(coulomb_friction=(0.5, 0.25)).other_power.tolist() == [2.0, 0.625]
    assert built(guide_damping=(2.0, 0.5)).other_power.tolist() == [2.5, 2.5]
    both = built(coulomb_friction=(0.5, 0.25), guide_damping=(2.0, 0.5))
    assert both.other_power.tolist() == [4.5, 3.125]


def test_a_spring_is_stretched_by_what_goes_beyond_half_its_play() -> None:
    leg = built(backlash=(0.25, 0.5))
    assert leg.half_play.tolist() == [0.125, 0.25]
    for angle, stretch in (
        ((0.125, 0.25), (0.0, 0.0)),
        ((-0.125, -0.25), (0.0, 0.0)),
        ((0.25, 0.75), (0.125, 0.5)),
        ((-0.25, -0.75), (-0.125, -0.5)),
    ):
        shaft, joint = np.array(angle) + 1.0, np.ones(2)
        assert leg.stretch(shaft, joint).tolist() == list(stretch)
        energy = 0.5 * sum(k * s * s for k, s in zip(PROTOTYPE.stiffness, stretch, strict=True))
        assert leg.spring_energy(shaft, joint) == pytest.approx(energy, rel=1e-15)


def test_the_leg_has_the_springs_that_were_built() -> None:
    leg = built(stiffness_error=(0.25, -0.5))
    stiff, soft = PROTOTYPE.stiffness
    assert leg.design.stiffness == pytest.approx((1.25 * stiff, 0.5 * soft))
    assert leg.spring_energy(np.ones(2), np.zeros(2)) == pytest.approx(0.625 * stiff + 0.25 * soft)
