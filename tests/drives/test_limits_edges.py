"""Safety limits by their numbers: what they are when left out, and at both sides of each end."""

import math
from dataclasses import fields, replace
from typing import Any

import pytest

from legbench.errors import ConfigError
from legbench.limits.plausibility import HealthBounds
from legbench.limits.safety import SafetyLimits

INF = math.inf
TURN = 2.0 * math.pi
ENDLESS = (-INF, INF)
GIVEN: dict[str, Any] = {
    "command_speed": 20.0,
    "command_step": 0.5,
    "spring_torque": 10.0,
    "following_error": 0.25,
    "joint_speed": 60.0,
    "standing": 0.02,
    "sway": 0.05,
}
"""What real drives are not led without."""


def refusal(act: Any, *args: Any, **kwargs: Any) -> str | None:
    try:
        act(*args, **kwargs)
    except ConfigError as error:
        return str(error)
    return None


def test_a_limit_that_is_left_out_does_not_act_and_counts_have_their_numbers() -> None:
    usual = SafetyLimits()
    assert {field.name: getattr(usual, field.name) for field in fields(usual)} == {
        "motor_range": (ENDLESS, ENDLESS),
        "joint_range": (ENDLESS, ENDLESS),
        "motor_knee_range": ENDLESS,
        "joint_knee_range": ENDLESS,
        **dict.fromkeys(GIVEN, INF),
        "following_cycles": 5,
        "servo_bandwidth": 15.0,
        "link_error": None,
        "temperature": INF,
        "overrun_cycles": 3,
        "lost_frames": 3,
        "waive": (),
    }


@pytest.mark.parametrize("name", list(GIVEN))
def test_real_drives_are_led_with_all_seven_limits_and_not_without_any(name: str) -> None:
    assert refusal(SafetyLimits(**GIVEN).require_complete) is None
    fewer: dict[str, Any] = {**GIVEN, name: INF}
    told = refusal(SafetyLimits(**fewer).require_complete)
    assert told == (f"limits leave out {name}; real drives are not led without: give each a value")


@pytest.mark.parametrize("name", [*GIVEN, "link_error", "temperature", "servo_bandwidth"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan])
def test_a_limit_is_above_zero(name: str, value: float) -> None:
    told = refusal(SafetyLimits, **{name: value})
    assert told is not None
    assert told.startswith(f"{name} is {value:g} ")
    assert told.endswith("; it must be positive")


@pytest.mark.parametrize("name", ["following_cycles", "overrun_cycles", "lost_frames"])
def test_a_count_is_at_least_one(name: str) -> None:
    assert getattr(SafetyLimits(**{name: 1}), name) == 1  # pyrefly: ignore[bad-argument-type]
    assert refusal(SafetyLimits, **{name: 0}) == f"{name} is 0 cycles; it must be positive"


def test_the_slowest_loop_that_is_watched_has_5_hz() -> None:
    assert SafetyLimits(servo_bandwidth=5.0).servo_bandwidth == 5.0
    told = refusal(SafetyLimits, servo_bandwidth=4.99)
    assert told is not None
    assert told.startswith("servo_bandwidth is 4.99 Hz, the lower end is 5 Hz: ")


@pytest.mark.parametrize("name", ["motor_range", "joint_range"])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_range_has_a_low_end_below_its_high_one_and_neither_beyond_one_turn(
    name: str, axis: int
) -> None:
    def with_range(low: float, high: float) -> str | None:
        ranges = ((low, high), (-1.0, 1.0))
        return refusal(SafetyLimits, **{name: ranges if axis == 0 else ranges[::-1]})

    for low, high in ((-TURN, TURN), (-INF, TURN), (-TURN, INF), (0.0, 1e-6)):
        assert with_range(low, high) is None
    for low, high in ((-TURN - 0.01, 1.0), (-1.0, TURN + 0.01)):
        told = with_range(low, high)
        assert told is not None
        assert told.endswith("no end lies beyond 6.28 rad, one turn")
    for low, high in ((0.5, 0.5), (0.5, -0.5), (math.nan, 1.0), (0.0, math.nan)):
        told = with_range(low, high)
        assert told is not None
        assert told.startswith(f"{name} is [{low:g}, {high:g}] rad; ")


@pytest.mark.parametrize("name", ["motor_range", "joint_range"])
@pytest.mark.parametrize("pairs", [0, 1, 3])
def test_a_leg_has_two_axes(name: str, pairs: int) -> None:
    told = refusal(SafetyLimits, **{name: ((-1.0, 1.0),) * pairs})
    assert told == f"{name} has {pairs} pairs; a leg has 2 axes"


@pytest.mark.parametrize("which", ["motor", "joint"])
def test_a_knee_range_fits_the_ranges_of_its_own_two_angles(which: str) -> None:
    other = "joint" if which == "motor" else "motor"
    boxes = ((-1.0, 0.0), (0.5, 1.0))
    given: dict[str, Any] = {f"{which}_range": boxes, f"{other}_range": ((-6.0, 6.0),) * 2}
    # They allow q2 - q1 from 0.5 to 2; one posture in common is enough.
    for knee, fits in (((2.0, 3.0), True), ((0.0, 0.5), True), ((2.1, 3.0), False)):
        told = refusal(SafetyLimits, **given, **{f"{which}_knee_range": knee})
        assert (told is None) is fits
        assert refusal(SafetyLimits, **given, **{f"{other}_knee_range": knee}) is None


OWN: dict[str, Any] = {
    "motor_range": ((-1.0, 0.5), (-0.5, 1.0)),
    "joint_range": ((-1.5, 0.75), (-0.75, 1.5)),
    "motor_knee_range": (0.25, 1.5),
    "joint_knee_range": (0.125, 2.0),
}


def test_limits_may_be_as_wide_as_a_design_and_no_end_wider() -> None:
    limits = SafetyLimits(**OWN)
    design = list(OWN.values())
    assert refusal(limits.check_within, *design) is None
    assert refusal(SafetyLimits().check_within, (ENDLESS,) * 2, (ENDLESS,) * 2) is None
    named = {
        (0, 0): "motor_range of axis 1",
        (0, 1): "motor_range of axis 2",
        (1, 0): "joint_range of axis 1",
        (1, 1): "joint_range of axis 2",
        (2, None): "motor_knee_range",
        (3, None): "joint_knee_range",
    }
    for (place, axis), name in named.items():
        for end in (0, 1):
            tighter = [list(value) for value in design]
            pair = list(design[place] if axis is None else design[place][axis])
            pair[end] += 0.01 if end == 0 else -0.01
            if axis is None:
                tighter[place] = pair
            else:
                tighter[place][axis] = pair
            told = refusal(limits.check_within, *tighter)
            assert told is not None
            assert told.startswith(f"{name} is [")
            assert "looser than the design's" in told


def test_bounds_are_the_limits_of_motion_and_the_period() -> None:
    limits = replace(SafetyLimits(**GIVEN), following_cycles=7, servo_bandwidth=25.0)
    assert limits.bounds(0.002) == HealthBounds(
        period=0.002,
        following_error=0.25,
        following_cycles=7,
        servo_bandwidth=25.0,
        joint_speed=60.0,
        standing=0.02,
        sway=0.05,
    )


def test_a_limit_beyond_its_upper_end_is_refused_unless_it_is_waived_by_its_name() -> None:
    assert str(refusal(SafetyLimits, lost_frames=51)).startswith("lost_frames is 51 cycles, the ")
    assert SafetyLimits(lost_frames=51, waive=("lost_frames",)).lost_frames == 51
    told = refusal(SafetyLimits, waive=("lost frames",))
    assert str(told).startswith("waive in the limits file names 'lost frames'; it takes each of")


def test_a_design_with_another_number_of_angles_is_refused() -> None:
    for angles in ([ENDLESS], [ENDLESS] * 3):
        with pytest.raises(ValueError, match="zip"):
            SafetyLimits().check_within(angles, [ENDLESS] * 2)
        with pytest.raises(ValueError, match="zip"):
            SafetyLimits().check_within([ENDLESS] * 2, angles)
