import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from metrics_runs import PERIOD, clock, manifest, recording

from legbench.control.jump_rules import JumpPhase
from legbench.control.position_jump import PositionJumpPhase
from legbench.kinematics import modal_to_joint
from legbench.metrics.analysis import Analysis
from legbench.metrics.periods import turning_points
from legbench.recording.reader import Recording

REST_ROWS = 137


def released(
    omega: float, decay: float, deflection: float, kind: str = "position-jump"
) -> Recording:
    """z2 of a damped oscillator that is let go at rest, after some rows of waiting."""
    rows = np.arange(8000)
    time = clock(8000)
    since = np.maximum(time - PERIOD * REST_ROWS, 0.0)
    damped = np.sqrt(omega**2 - decay**2)
    envelope = deflection * np.exp(-decay * since)
    z2 = envelope * (np.cos(damped * since) + decay / damped * np.sin(damped * since))
    rate = -envelope * omega**2 / damped * np.sin(damped * since)
    still = np.zeros_like(z2)
    phase = np.where(rows < REST_ROWS, JumpPhase.REST, PositionJumpPhase.STEPPED)
    entries = manifest(
        setup={"kind": "ffs"}, controller={"kind": kind, "z2": 1.0, "dz2": abs(deflection)}
    )
    return recording(
        time,
        entries,
        phase=phase,
        joint_pos=modal_to_joint(np.stack([still, 1.0 + z2], axis=-1)),
        joint_vel=modal_to_joint(np.stack([still, rate], axis=-1)),
    )


@settings(derandomize=True, max_examples=40)
@given(st.floats(15.0, 50.0), st.floats(0.2, 3.0), st.floats(0.05, 0.4), st.sampled_from([-1, 1]))
def test_periods_of_a_damped_oscillation_come_out_in_closed_form(
    omega: float, decay: float, size: float, sign: int
) -> None:
    seen = Analysis(released(omega, decay, sign * size)).periods
    period = 2.0 * np.pi / np.sqrt(omega**2 - decay**2)
    index = np.arange(len(seen))
    np.testing.assert_allclose(seen.start, PERIOD * REST_ROWS + index * period, atol=1e-5)
    np.testing.assert_allclose(seen.end, seen.start + period, atol=2e-5)
    shrink = np.exp(-decay * period)
    first = 0.5 * size * (1.0 + np.sqrt(shrink))
    np.testing.assert_allclose(seen.amplitude, first * shrink**index, rtol=2e-3)
    fits = int((8.0 - PERIOD * (REST_ROWS + 1)) / period)
    counted = int(np.ceil(np.log(0.1 * size / first) / np.log(shrink)))
    assert abs(len(seen) - min(fits, counted)) <= 1
    assert np.all(seen.amplitude > 0.1 * size)


def test_periods_follow_each_other_and_own_the_rows_inside() -> None:
    run = released(30.0, 0.5, 0.2)
    seen = Analysis(run).periods
    assert seen.first[0] == REST_ROWS
    np.testing.assert_array_equal(seen.first[1:], seen.stop[:-1])
    np.testing.assert_array_equal(seen.start[1:], seen.end[:-1])
    assert np.all(run.time[seen.first] >= seen.start - 1e-12)
    assert np.all(run.time[seen.stop - 1] < seen.end)


def test_amplitude_of_a_growing_oscillation_is_half_its_range_within_the_period() -> None:
    omega, growth, size = 30.0, 0.5, 0.05
    seen = Analysis(released(omega, -growth, size, "other")).periods
    period = 2.0 * np.pi / np.sqrt(omega**2 - growth**2)
    halves = size * np.exp(growth * period * (np.arange(len(seen))[:, None] + [0.5, 1.0]))
    np.testing.assert_allclose(seen.amplitude, 0.5 * halves.sum(axis=-1), rtol=2e-3)


def test_a_chirp_turns_where_its_phase_says() -> None:
    time = clock(6000)
    start, growth = 12.0, 4.0
    points = turning_points(time, 3.0 * np.sin(start * time + 0.5 * growth * time**2))
    turns = 2.0 * np.pi * np.arange(len(points))
    expected = (np.sqrt(start**2 + 2.0 * growth * turns) - start) / growth
    np.testing.assert_allclose(points, expected, atol=1e-5)
    assert turns[-1] + 2.0 * np.pi > start * time[-1] + 0.5 * growth * time[-1] ** 2


@settings(derandomize=True, max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_noise_makes_no_turning_points(seed: int) -> None:
    time = clock(2000)
    rate = 5.0 * np.sin(25.0 * time)
    noise = np.random.default_rng(seed).uniform(-0.09, 0.09, len(time))
    points = turning_points(time, rate + noise)
    np.testing.assert_allclose(points, 2.0 * np.pi / 25.0 * np.arange(len(points)), atol=0.002)
    assert len(points) == 8


def test_a_leg_already_moving_begins_at_its_first_turn() -> None:
    time = clock(1000)
    points = turning_points(time, np.cos(20.0 * time))
    expected = (1.5 + 2.0 * np.arange(3)) * np.pi / 20.0
    np.testing.assert_allclose(points, expected[expected < 1.0], atol=1e-5)


def test_bang_bang_counts_twenty_periods_and_others_all() -> None:
    assert len(Analysis(released(40.0, 0.0, 0.1, "bang-bang")).periods) == 20
    assert len(Analysis(released(40.0, 0.0, 0.1, "other")).periods) == int(
        (7.999 - 0.137) / (np.pi / 20)
    )


@pytest.mark.parametrize("rows", [0, 1, 5])
def test_a_leg_at_rest_has_no_periods(rows: int) -> None:
    run = recording(clock(rows), manifest(setup={"kind": "hfts"}))
    assert Analysis(run).first_action == rows
    assert len(Analysis(run).periods) == 0
    stepped = recording(clock(rows), manifest(setup={"kind": "hfts"}), phase=np.ones(rows))
    assert len(Analysis(stepped).periods) == 0
