from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from metrics_runs import PROTOTYPE

from legbench.design.statics import Support, equilibrium, gravity_load, motor_holding
from legbench.kinematics import modal_to_joint
from legbench.metrics.rating import alignment, deflection, link_equilibrium, rate
from legbench.metrics.source import Reference

SUPPORTED = (Support.FOOT, Support.TRUNK)


def mixed(polar_share: float, count: int = 1000) -> np.ndarray:
    radial = np.sin(np.linspace(0.1, 20.0, count))
    return modal_to_joint(np.stack([polar_share * radial, radial], axis=-1))


@pytest.mark.parametrize(
    ("modal", "expected"),
    [([0.0, 0.3], 1.0), ([0.3, 0.0], 0.0), ([0.2, 0.2], np.sqrt(0.5)), ([-0.2, 0.2], np.sqrt(0.5))],
)
def test_one_direction_rates_its_cosine(modal: list[float], expected: float) -> None:
    swing = np.cos(np.linspace(0.0, 9.0, 400))[:, None]
    assert rate(swing * modal_to_joint(np.array(modal))) == pytest.approx(expected, abs=1e-14)


@settings(derandomize=True)
@given(st.floats(-3.0, 3.0))
def test_in_phase_modes_rate_the_cosine_of_their_angle(share: float) -> None:
    assert rate(mixed(share)) == pytest.approx(np.cos(np.arctan(share)), abs=1e-12)


def test_circular_motion_rates_the_mean_of_a_rectified_cosine() -> None:
    angle = (np.arange(1000) + 0.5) * 2.0 * np.pi / 1000
    circle = modal_to_joint(0.1 * np.stack([np.sin(angle), np.cos(angle)], axis=-1))
    assert rate(circle) == pytest.approx(2.0 / np.pi, abs=1e-5)


@settings(derandomize=True)
@given(st.floats(1e-4, 1e4), st.integers(1, 5), st.sampled_from([-1.0, 1.0]))
def test_rating_ignores_scale_sign_and_repetition(scale: float, times: int, sign: float) -> None:
    rows = np.random.default_rng(3).normal(size=(50, 2))
    assert rate(np.repeat(sign * scale * rows, times, axis=0)) == pytest.approx(rate(rows))


def test_rating_converges_with_sampling() -> None:
    def sampled(count: int) -> float:
        time = (np.arange(count) + 0.5) / count
        modes = [0.3 * np.sin(14.0 * time), np.cos(11.0 * time)]
        return rate(modal_to_joint(np.stack(modes, axis=-1)))

    assert sampled(500) == pytest.approx(sampled(50_000), abs=1e-4)


def test_mirrored_leg_rates_the_same() -> None:
    rows = np.random.default_rng(4).normal(size=(200, 2))
    np.testing.assert_allclose(alignment(-rows[:, ::-1]), alignment(rows), rtol=1e-12)


def test_rows_without_deflection_do_not_count() -> None:
    rows = mixed(1.0)
    at_rest = np.zeros((500, 2))
    assert rate(np.concatenate([at_rest, rows])) == pytest.approx(rate(rows), abs=1e-14)
    assert np.isnan(rate(at_rest))
    assert np.isnan(rate(np.zeros((0, 2))))


@pytest.mark.parametrize("support", SUPPORTED)
def test_link_equilibrium_inverts_motor_holding(support: Support) -> None:
    joint_pos = np.random.default_rng(5).uniform([-1.4, 0.1], [-0.1, 1.4], (3000, 2))
    motor_pos = motor_holding(PROTOTYPE, joint_pos, support)
    found = link_equilibrium(PROTOTYPE, motor_pos, support)
    np.testing.assert_allclose(found, joint_pos, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("support", list(Support))
def test_link_equilibrium_agrees_with_the_batched_solver(support: Support) -> None:
    motor_pos = np.random.default_rng(6).uniform(-1.4, 1.4, (500, 2))
    found = link_equilibrium(PROTOTYPE, motor_pos, support)
    np.testing.assert_allclose(found, equilibrium(PROTOTYPE, motor_pos, support), atol=1e-12)


def test_rows_without_a_stable_equilibrium_are_nan_and_the_others_are_not() -> None:
    moment = gravity_load(PROTOTYPE, Support.FOOT).moment
    stiffness = (0.7 * abs(moment[0]), 0.7 * abs(moment[1]))
    soft = replace(PROTOTYPE, stiffness=stiffness)
    held = np.array([[-0.9, 0.9], [-0.5, 0.7]])
    found = link_equilibrium(soft, np.array([held[0], [0.0, 0.0], held[1]]), Support.FOOT)
    np.testing.assert_allclose(found[[0, 2]], equilibrium(soft, held, Support.FOOT), atol=1e-12)
    assert np.isnan(found[1]).all()
    assert rate(found) == pytest.approx(rate(found[[0, 2]]), abs=1e-15)


def test_motion_around_the_equilibrium_is_pure_only_in_that_reference() -> None:
    rest = np.array([-0.6, 0.6])
    motor = np.broadcast_to(motor_holding(PROTOTYPE, rest, Support.FOOT), (300, 2))
    swing = 0.1 * np.sin(np.linspace(0.3, 9.0, 300))[:, None] * np.array([1.0, 1.0])

    def rated(reference: Reference) -> float:
        return rate(deflection(PROTOTYPE, rest + swing, motor, Support.FOOT, reference))

    assert rated(Reference.EQUILIBRIUM) == pytest.approx(0.0, abs=1e-9)
    assert rated(Reference.MOTOR) > 0.9
