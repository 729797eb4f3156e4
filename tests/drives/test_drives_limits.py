import math
from typing import Any

import pytest
from guard_rig import see_encoders
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.errors import ConfigError, PlantFault
from legbench.limits.guard import Guard
from legbench.limits.safety import SafetyLimits

PERIOD = 1e-3
RANGES = ((-1.0, 1.0), (0.0, 2.0))
LIMITS = SafetyLimits(
    motor_range=RANGES,
    joint_range=((-1.5, 1.5), (-0.5, 2.5)),
    command_speed=10.0,
    command_step=0.5,
    spring_torque=8.0,
    following_error=0.1,
    following_cycles=3,
    joint_speed=100.0,
    standing=0.05,
    sway=0.1,
    temperature=80.0,
)
ANYTHING = st.floats(allow_nan=True, allow_infinity=True)


@settings(derandomize=True, max_examples=50)
@given(
    st.tuples(st.floats(-1, 1), st.floats(0, 2)),
    st.lists(st.tuples(ANYTHING, ANYTHING) | st.tuples(st.floats(-3, 3), st.floats(-3, 3))),
)
def test_whatever_is_wished_what_is_applied_is_within_range_and_speed(
    start: tuple[float, float], wishes: list[tuple[float, float]]
) -> None:
    guard = Guard(LIMITS, PERIOD)
    guard.start_at(start)
    previous = start
    for wish in wishes:
        try:
            applied = guard.command(wish)
        except PlantFault:
            assert guard.applied == previous
            return
        for new, old, (low, high) in zip(applied, previous, RANGES, strict=True):
            assert low <= new <= high
            assert abs(new - old) <= 10.0 * PERIOD + 1e-12
        previous = applied


def test_a_wish_within_all_limits_is_applied_to_the_last_bit() -> None:
    guard = Guard(SafetyLimits(), PERIOD)
    guard.start_at((0.0, 0.0))
    for wish in ((0.1, -0.1), (1.0 / 3.0, math.pi), (-7.0, 1e-300)):
        assert guard.command(wish) == wish


def test_from_outside_the_range_the_way_leads_back_slowly() -> None:
    guard = Guard(LIMITS, PERIOD)
    guard.start_at((1.5, 1.0))
    guard.command((1.2, 1.0))
    path = [guard.command((0.9, 1.0))[0] for _ in range(100)]
    assert path[0] == pytest.approx(1.48)
    assert path == sorted(path, reverse=True)
    assert path[-1] == 0.9


def test_from_outside_the_range_a_slow_wish_stays_slow() -> None:
    guard = Guard(LIMITS, PERIOD)
    guard.start_at((1.5, 1.0))
    wish = 1.5
    for _ in range(400):
        wish -= 0.0002
        assert guard.command((wish, 1.0))[0] == wish
    assert guard.command((1.6, 1.0))[0] == pytest.approx(wish)
    with pytest.raises(PlantFault, match=r"motor 1 stands at 1\.500 rad, .* move it back by hand"):
        guard.check_start((1.5, 1.0))
    guard.check_start((1.0005, 1.0))


@pytest.mark.parametrize("first", [(), (0.4, 0.0)])
def test_no_wish_may_jump_not_even_the_first(first: tuple[float, ...]) -> None:
    guard = Guard(LIMITS, PERIOD)
    guard.start_at((0.0, 0.0))
    if first:
        guard.command(first)
    with pytest.raises(PlantFault, match=r"motor 2 jumps by 0\.600 rad .*limit is 0\.5 rad"):
        guard.command((0.4, 0.6))


def test_limits_that_real_drives_need_are_named_when_they_are_missing() -> None:
    LIMITS.require_complete()
    words = (
        "limits leave out command_step, spring_torque, joint_speed, standing, sway; real drives "
        "are not led without"
    )
    with pytest.raises(ConfigError, match=words):
        SafetyLimits(command_speed=1.0, following_error=0.1).require_complete()


GOOD: dict[str, Any] = {"joint_pos": (0.0, 1.0), "spring_torque": (0.0, 0.0)}


@pytest.mark.parametrize(
    ("change", "cause", "words"),
    [
        ({"joint_pos": (1.6, 1.0)}, "joint range", r"joint 1 is at 1\.600 rad"),
        ({"joint_pos": (0.0, math.nan)}, "joint range", "joint 2 is at nan rad"),
        ({"spring_torque": (0.0, -8.1)}, "spring torque", r"spring 2 carries -8\.100 N m"),
        ({"spring_torque": (math.nan, 0.0)}, "spring torque", "spring 1 carries nan"),
        ({"temperature": [25.0, 81.0]}, "temperature", r"drive 2 is at 81\.0 deg C"),
    ],
)
def test_every_limit_has_its_cause(change: dict[str, Any], cause: str, words: str) -> None:
    guard = Guard(LIMITS, PERIOD)
    guard.check(**GOOD)
    with pytest.raises(PlantFault, match=words) as caught:
        guard.check(**{**GOOD, **change})
    assert caught.value.cause == cause


def test_a_following_error_may_last_its_cycles() -> None:
    guard = Guard(LIMITS, PERIOD)
    guard.start_at((0.0, 1.0))
    led: dict[str, Any] = {"commands": (0.0, 1.0), "joint_pos": (0.0, 1.0)}
    for _ in range(3):
        see_encoders(guard, motor_pos=(0.2, 1.0), **led)
    see_encoders(guard, motor_pos=(0.0, 1.0), **led)
    for _ in range(3):
        see_encoders(guard, motor_pos=(0.2, 1.0), **led)
    words = r"motor 1 shows 0\.200 rad and is 0\.200 rad away .* for 4 cycles"
    with pytest.raises(PlantFault, match=words) as caught:
        see_encoders(guard, motor_pos=(0.2, 1.0), **led)
    assert caught.value.cause == "following error"


def test_a_wish_that_is_changed_is_counted() -> None:
    guard = Guard(LIMITS, PERIOD)
    guard.start_at((0.0, 1.0))
    guard.command((0.0, 1.0))
    assert guard.shortfall.told() is None
    guard.command((0.05, 1.0))  # slewed: 0.01 rad a cycle
    guard.command((0.02, 1.4))
    for _ in range(100):
        guard.command((0.02, 1.9))
    guard.command((0.02, 2.3))
    assert guard.shortfall.told() == {
        "cycles": 91,
        "of": 104,
        "first": pytest.approx(1 * PERIOD),
        "clamped": [0, 1],
        "slewed": [1, 90],
        "worst": [pytest.approx(0.04), pytest.approx(0.88)],
    }
    guard.start_at((0.0, 1.0))
    assert guard.shortfall.told() is None
