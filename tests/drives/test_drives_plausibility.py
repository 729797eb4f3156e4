"""What the watch over motors and encoders takes for healthy, and what it does not."""

import math

import pytest
from guard_rig import BOUNDS, see_links, see_motor
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.limits.plausibility import (
    SWAY_CYCLES,
    Doubt,
    LinkWatch,
    MotorWatch,
)

PERIOD = BOUNDS.period
BOTH: tuple[bool, bool] = (True, True)


def servo_gain(bandwidth: float) -> float:
    return 1.0 - math.exp(-2.0 * math.pi * bandwidth * PERIOD)


@settings(derandomize=True, max_examples=50)
@given(
    st.floats(15.0, 1e4),
    st.lists(st.tuples(st.floats(-1.0, 1.0), st.integers(1, 60)), max_size=12),
    st.sampled_from([0.0, 2.0 * math.pi / 4096]),
)
def test_no_position_loop_that_is_fast_enough_is_ever_doubted(
    bandwidth: float, path: list[tuple[float, int]], count: float
) -> None:
    watch, position, gain = MotorWatch(BOUNDS), 0.0, servo_gain(bandwidth)
    watch.start_at(position)
    for command, cycles in path:
        for _ in range(cycles):
            position += gain * (command - position)
            shown = round(position / count) * count if count else position
            assert see_motor(watch, 1, shown, command) is None


def first_doubt(shown: list[float], commands: list[float]) -> int | None:
    watch = MotorWatch(BOUNDS)
    watch.start_at(0.0)
    for cycle, (position, command) in enumerate(zip(shown, commands, strict=True)):
        if see_motor(watch, 1, position, command) is not None:
            return cycle
    return None


@pytest.mark.parametrize("stroke", [0.08, -0.14, 0.5])
def test_a_motor_that_stands_is_found_soon_after_its_command_moves(stroke: float) -> None:
    moves = [0.0] * 100 + [stroke] * 100
    found = first_doubt([0.0] * 200, moves)
    assert found is not None
    # The slowest loop is 0.03 rad away at 1 - exp(-t / 10.6 ms) = 0.03 / stroke; then 5 cycles.
    slowest = -math.log(1.0 - 0.03 / abs(stroke)) / (2.0 * math.pi * 15.0)
    assert found == 100 + math.ceil(slowest / PERIOD) - 1 + 5


def test_a_loop_that_is_too_slow_is_found() -> None:
    position, shown = 0.0, []
    for _ in range(200):
        position += servo_gain(5.0) * (0.3 - position)
        shown.append(position)
    assert first_doubt(shown, [0.3] * 200) is not None


def test_a_motor_encoder_that_drifts_is_found_at_the_limit() -> None:
    assert first_doubt([1e-3 * cycle for cycle in range(200)], [0.0] * 200) == 30 + 1 + 5


def test_not_a_number_is_found() -> None:
    assert first_doubt([math.nan] * 10, [0.0] * 10) == 5


# --- links -----------------------------------------------------------------------------------


def swing(cycle: int, amplitude: float = 0.3) -> tuple[float, float]:
    """Both links on the radial mode, at 3 Hz."""
    angle = 0.5 + amplitude * math.sin(2.0 * math.pi * 3.0 * cycle * PERIOD)
    return -angle, angle


def watched(
    readings: list[tuple[float, float]],
    motors: list[tuple[float, float]] | None = None,
    fresh: list[tuple[bool, bool]] | None = None,
) -> tuple[int, Doubt] | None:
    watch = LinkWatch(BOUNDS)
    for cycle, shown in enumerate(readings):
        led = motors[cycle] if motors else (-0.5, 0.5)
        doubt = see_links(watch, shown, led, led, fresh[cycle] if fresh else BOTH)
        if doubt is not None:
            return cycle, doubt
    return None


@pytest.mark.parametrize("amplitude", [0.0, 0.02, 0.4])
def test_a_leg_on_its_radial_mode_is_never_doubted(amplitude: float) -> None:
    assert watched([swing(cycle, amplitude) for cycle in range(3000)]) is None


@pytest.mark.parametrize("dead", [0, 1])
@pytest.mark.parametrize("amplitude", [0.08, 0.3])
@pytest.mark.parametrize("onset", range(1000, 1333, 37))
def test_a_link_encoder_that_freezes_is_found(dead: int, amplitude: float, onset: int) -> None:
    readings = [swing(cycle, amplitude) for cycle in range(onset + 600)]
    for cycle in range(onset, len(readings)):
        pair = list(readings[cycle])
        pair[dead] = readings[onset][dead]
        readings[cycle] = (pair[0], pair[1])
    found = watched(readings)
    assert found is not None
    cycle, doubt = found
    assert doubt.cause in ("joint encoder", "sway")
    contradicted = next(
        place
        for place in range(onset, len(readings))
        if abs(swing(place, amplitude)[dead] - readings[onset][dead]) > 0.03
    )
    assert onset < cycle <= contradicted + 50


@pytest.mark.parametrize("dead", [0, 1])
def test_a_step_of_a_link_encoder_is_found_at_once(dead: int) -> None:
    readings = [swing(cycle) for cycle in range(300)]
    for cycle in range(200, 300):
        pair = list(readings[cycle])
        pair[dead] += 0.1
        readings[cycle] = (pair[0], pair[1])
    found = watched(readings)
    assert found is not None
    assert (found[0], found[1].cause) == (200, "joint speed")
    assert f"joint {dead + 1} moved by" in found[1].message


def test_a_reading_that_comes_after_two_lost_cycles_is_no_step() -> None:
    readings = [swing(cycle, 1.4) for cycle in range(300)]  # up to 26 rad/s
    fresh: list[tuple[bool, bool]] = [BOTH] * 300
    for cycle in (201, 202):
        readings[cycle], fresh[cycle] = readings[200], (False, False)
    assert max(abs(readings[203][0] - readings[202][0]), 0.0) > 0.06
    assert watched(readings, fresh=fresh) is None


@pytest.mark.parametrize("dead", [0, 1])
def test_a_drift_of_a_link_encoder_is_found_within_its_bound(dead: int) -> None:
    readings = [swing(cycle) for cycle in range(600)]
    for cycle in range(300, 600):
        pair = list(readings[cycle])
        pair[dead] -= 1e-3 * (cycle - 300)
        readings[cycle] = (pair[0], pair[1])
    found = watched(readings)
    assert found is not None
    assert 350 <= found[0] <= 350 + 5 + SWAY_CYCLES
    assert found[1].cause == "sway"


def test_a_jog_of_one_motor_is_no_sway_and_no_dead_encoder() -> None:
    motors = [(-0.5, 0.5 + 1e-3 * min(cycle, 300)) for cycle in range(600)]
    lag = [(motor[0], motors[max(0, cycle - 30)][1]) for cycle, motor in enumerate(motors)]
    assert watched(lag, motors) is None


def test_a_sway_that_grows_from_hop_to_hop_is_the_leg_and_a_sudden_one_is_not() -> None:
    def swaying(cycle: int, amplitude: float) -> tuple[float, float]:
        first, second = swing(cycle)
        sway = amplitude * math.sin(2.0 * math.pi * 2.5 * cycle * PERIOD)
        return first + 0.5 * sway, second + 0.5 * sway

    slow = [swaying(cycle, 0.01 * math.exp(cycle / 13_000)) for cycle in range(40_000)]
    assert watched(slow) is None
    sudden = [swaying(cycle, 0.01 if cycle < 2000 else 0.2) for cycle in range(2400)]
    found = watched(sudden)
    assert found is not None
    assert found[1].cause == "sway"
