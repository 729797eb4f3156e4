import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.errors import ConfigError
from legbench.imperfections import MAX_DELAY_CYCLES
from legbench.servo import Servo, ServoConfig
from legbench.signals import Floats

PERIOD = 0.001
BY_LAW = settings(derandomize=True, max_examples=50, deadline=None)
POSITIONS = st.lists(st.floats(-2.0, 2.0), min_size=1, max_size=40)


def servo(start: Floats, **limits: Any) -> Servo:
    made = Servo(ServoConfig(**limits), PERIOD)
    made.reset(start)
    return made


def followed(made: Servo, commands: list[float]) -> Floats:
    return np.array([made.follow(np.full(2, command)) for command in commands])


@BY_LAW
@given(commands=POSITIONS)
def test_an_ideal_servo_is_where_it_is_told_to_be(commands: list[float]) -> None:
    motor = followed(servo(np.zeros(2)), commands)
    assert np.array_equal(motor, np.repeat(commands, 2).reshape(-1, 2))
    assert ServoConfig().ideal
    assert ServoConfig(encoder_counts=1024).ideal


@BY_LAW
@given(commands=POSITIONS, rate=st.floats(0.1, 100.0))
def test_a_slewing_servo_is_never_faster_and_never_stops_short(
    commands: list[float], rate: float
) -> None:
    made = servo(np.zeros(2), slew_rate=rate)
    path = np.vstack([np.zeros(2), followed(made, commands)])
    moves = np.diff(path, axis=0)
    reach = rate * PERIOD
    assert np.max(np.abs(moves)) <= reach * (1.0 + 1e-12)
    wanted = np.repeat(commands, 2).reshape(-1, 2) - path[:-1]
    near = np.abs(wanted) <= reach
    assert np.allclose(moves[near], wanted[near], atol=1e-15)
    assert np.allclose(np.abs(moves[~near]), reach)
    assert np.array_equal(np.sign(moves), np.sign(wanted))


@BY_LAW
@given(bandwidth=st.floats(0.5, 300.0), target=st.floats(-2.0, 2.0))
def test_bandwidth_is_the_exponential_of_a_first_order_lag(bandwidth: float, target: float) -> None:
    motor = followed(servo(np.zeros(2), bandwidth=bandwidth), [target] * 50)
    time = PERIOD * np.arange(1, 51)
    expected = target * (1.0 - np.exp(-2.0 * np.pi * bandwidth * time))
    assert np.allclose(motor[:, 0], expected, atol=1e-12)
    assert np.array_equal(motor[:, 0], motor[:, 1])


@BY_LAW
@given(commands=POSITIONS, delay=st.integers(0, 12))
def test_a_delay_is_exact_in_cycles(commands: list[float], delay: int) -> None:
    motor = followed(servo(np.full(2, 0.25), delay_cycles=delay), commands)[:, 0]
    expected = ([0.25] * delay + commands)[: len(commands)]
    assert motor.tolist() == pytest.approx(expected, abs=1e-15)


@BY_LAW
@given(angle=st.floats(-7.0, 7.0), counts=st.integers(64, 1 << 20))
def test_an_encoder_is_off_by_half_a_count_at_most(angle: float, counts: int) -> None:
    count = 2.0 * np.pi / counts
    shown = servo(np.zeros(2), encoder_counts=counts).encode(np.full(2, angle))
    assert np.max(np.abs(shown - angle)) <= 0.5 * count * (1.0 + 1e-9)
    assert np.allclose(shown / count, np.round(shown / count), atol=1e-6)


def test_all_limits_together_still_arrive() -> None:
    made = servo(np.zeros(2), slew_rate=5.0, bandwidth=50.0, delay_cycles=3)
    motor = followed(made, [0.5] * 400)
    assert np.all(motor[:3] == 0.0)
    assert np.all(np.diff(motor[:, 0]) >= 0.0)
    assert np.max(np.diff(motor[:, 0])) == pytest.approx(5.0 * PERIOD)
    assert motor[-1] == pytest.approx([0.5, 0.5])


def test_a_reset_forgets_what_was_on_the_way() -> None:
    made = servo(np.zeros(2), delay_cycles=4)
    followed(made, [1.0, 2.0])
    made.reset(np.full(2, 0.3))
    assert followed(made, [0.7] * 5)[:, 0].tolist() == pytest.approx([0.3] * 4 + [0.7])


def test_rows_of_a_batch_are_single_servos() -> None:
    rng = np.random.default_rng(2)
    commands = rng.normal(size=(60, 3, 2))
    limits = {"slew_rate": 20.0, "bandwidth": 80.0, "delay_cycles": 2}
    batch = servo(np.zeros((3, 2)), **limits)
    alone = [servo(np.zeros(2), **limits) for _ in range(3)]
    for command in commands:
        together = batch.follow(command)
        for row, one in enumerate(alone):
            assert np.array_equal(together[row], one.follow(command[row]))


def test_a_position_that_was_handed_out_stays_as_it_is() -> None:
    start, command = np.zeros(2), np.ones(2)
    made = servo(start, bandwidth=20.0, delay_cycles=1)
    first = made.follow(command)
    kept = first.copy()
    command[:] = 9.0
    made.follow(np.ones(2))
    assert np.array_equal(first, kept)
    assert np.array_equal(start, [0.0, 0.0])
    assert made.follow(np.ones(2))[0] < 1.0


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan])
def test_a_limit_that_is_no_limit(value: float) -> None:
    with pytest.raises(ConfigError, match=r"servo slew_rate is .* rad/s; it must be positive"):
        ServoConfig(slew_rate=value)
    with pytest.raises(ConfigError, match=r"servo bandwidth is .* Hz; it must be positive"):
        ServoConfig(bandwidth=value)
    with pytest.raises(ConfigError, match=r"servo encoder_counts is .* counts per revolution"):
        ServoConfig(encoder_counts=value)  # pyrefly: ignore[bad-argument-type]


@pytest.mark.parametrize("delay", [-1, MAX_DELAY_CYCLES + 1, 10**12])
def test_a_delay_out_of_this_world(delay: int) -> None:
    with pytest.raises(ConfigError, match=rf"delay_cycles is {delay}; it must be 0 to 1000"):
        ServoConfig(delay_cycles=delay)
