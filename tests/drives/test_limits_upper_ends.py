"""Upper ends of limits by their numbers, waivers by their names, and counts of changed wishes."""

import math
import re

import pytest

from legbench.errors import ConfigError
from legbench.limits.knee import check_knee, knee_of, project
from legbench.limits.shortfall import Shortfall
from legbench.limits.upper_ends import (
    BUS_WAIVERS,
    LIMIT_ENDS,
    WIDEST_ANGLE,
    check_limit,
    check_number,
    check_waivers,
)

ENDS = {
    "command_speed": (200.0, 1000.0, "rad/s"),
    "command_step": (1.0, 6.3, "rad"),
    "spring_torque": (50.0, 1000.0, "N m"),
    "following_error": (0.5, 6.3, "rad"),
    "following_cycles": (50.0, 5000.0, "cycles"),
    "servo_bandwidth": (1000.0, 10_000.0, "Hz"),
    "joint_speed": (200.0, 1000.0, "rad/s"),
    "link_error": (0.1, 6.3, "rad"),
    "standing": (0.2, 6.3, "rad"),
    "sway": (0.5, 6.3, "rad"),
    "temperature": (120.0, 200.0, "deg C"),
    "overrun_cycles": (50.0, 5000.0, "cycles"),
    "lost_frames": (50.0, 5000.0, "cycles"),
}
"""Limit -> usual upper end, upper end where it is waived, unit; as hardware/ gives them."""


@pytest.mark.parametrize("name", list(ENDS))
def test_a_limit_is_refused_beyond_its_end_and_only_there(name: str) -> None:
    usual, waived, unit = ENDS[name]
    for end, waivers in ((usual, ()), (usual, ("other",)), (waived, ("other", name))):
        check_limit(name, end, waivers)
        check_limit(name, math.inf, waivers)
        beyond = math.nextafter(end, math.inf)
        way = f', or waive = ["{name}"] in the limits file, up to {waived:g}'
        told = f"{name} is {beyond:g} {unit}, the upper end is {end:g} {unit}: beyond it the limit "
        told += f"would not act in time; lower it{'' if name in waivers else way}"
        for value in (beyond, 1e9):
            with pytest.raises(ConfigError, match=re.escape(told) if value == beyond else name):
                check_limit(name, value, waivers)


def test_every_limit_has_an_end_and_angles_make_no_turn() -> None:
    assert LIMIT_ENDS.keys() == ENDS.keys()
    assert pytest.approx(math.radians(360.0), rel=1e-15) == WIDEST_ANGLE


WAIVERS = ("master watch", "drive heartbeat", "quick-stop ramp", "spring watch")


@pytest.mark.parametrize("given", [[], *([name] for name in WAIVERS), [*reversed(WAIVERS)]])
def test_a_waiver_that_is_known_is_taken_once(given: list[str]) -> None:
    check_waivers(given, BUS_WAIVERS, "bus")
    for name in given:
        with pytest.raises(ConfigError, match=f"names {name!r}; it takes each of these once: "):
            check_waivers([*given, name], BUS_WAIVERS, "bus")
    with pytest.raises(
        ConfigError,
        match=rf"waive in the bus file names 'sway'; .* once: {', '.join(WAIVERS)}$",
    ):
        check_waivers([*given, "sway"], BUS_WAIVERS, "bus")


@pytest.mark.parametrize("value", [1.0, 2.5, 4.0])
def test_a_number_may_lie_at_either_end(value: float) -> None:
    check_number("gain", value, 1.0, 4.0, "V")
    for beyond in (math.nextafter(1.0, 0.0), math.nextafter(4.0, 5.0), math.nan, -math.inf):
        with pytest.raises(ConfigError, match=r"^gain is .* V; it must be 1 to 4 V$"):
            check_number("gain", beyond, 1.0, 4.0, "V")
        with pytest.raises(ConfigError, match=r"^gain is [^ ]*; it must be 1 to 4$"):
            check_number("gain", beyond, 1.0, 4.0, "")


def test_changed_wishes_are_counted_by_their_cycle_their_motor_and_their_cause() -> None:
    counted = Shortfall(0.25)
    assert counted.told() is None
    for _ in range(2):
        counted.restart()
        assert counted.told() is None
        counted.cycles = 3
        counted.count((1.0, 2.0), (1.0, 1.5), (1.0, 1.5))
        counted.cycles = 5
        counted.count((1.0, 2.0), (1.0, 2.0), (0.75, 2.0))
        counted.cycles = 6
        counted.count((-4.0, 2.0), (-3.5, 2.0), (-3.0, 2.125))
        counted.cycles = 9
        assert counted.told() == {
            "cycles": 3,
            "of": 9,
            "first": 0.5,
            "clamped": [1, 1],
            "slewed": [2, 1],
            "worst": [1.0, 0.5],
        }


def test_the_first_command_of_all_may_be_changed() -> None:
    counted = Shortfall(0.25)
    counted.cycles = 1
    counted.count((1.0,), (0.5,), (0.5,))
    told = counted.told()
    assert told is not None
    assert (told["first"], told["cycles"], told["of"]) == (0.0, 1, 1)


def test_what_was_applied_to_another_number_of_motors_is_not_counted() -> None:
    for applied in ((0.5,), (0.5, 0.5, 0.5)):
        with pytest.raises(ValueError, match="zip"):
            Shortfall(0.25).count((1.0, 2.0), (1.0, 1.5), applied)


BOXES = ((-1.0, 0.5), (-0.5, 1.0))


@pytest.mark.parametrize(
    ("knee", "fits"),
    [
        *[((-1.0, 2.0), True), ((2.0, 3.0), True), ((-3.0, -1.0), True)],
        *[((2.25, 3.0), False), ((-3.0, -1.25), False)],
        *[((0.5, 0.5), False), ((0.75, 0.5), False)],
    ],
)
def test_a_knee_range_needs_one_pair_of_angles(knee: tuple[float, float], fits: bool) -> None:
    if fits:
        check_knee("knee", knee, BOXES)
        return
    with pytest.raises(ConfigError, match=r"^knee is \["):
        check_knee("knee", knee, BOXES)


@pytest.mark.parametrize(
    ("wanted", "knee", "found"),
    [
        # Both give way by the same amount, to either side.
        ((0.0, 0.0), (0.5, 1.0), (-0.25, 0.25)),
        ((-0.5, 1.0), (0.5, 1.0), (-0.25, 0.75)),
        # At the ends of the range nothing moves.
        ((0.0, 0.5), (0.5, 1.0), (0.0, 0.5)),
        ((0.0, 1.0), (0.5, 1.0), (0.0, 1.0)),
        # The first is at the end of its box, so that the second gives way for both.
        ((-1.0, -0.5), (1.0, 1.25), (-1.0, 0.0)),
        ((0.5, 1.0), (-1.0, 0.25), (0.5, 0.75)),
        # The second is, so that the first does.
        ((0.5, 1.0), (0.75, 1.5), (0.25, 1.0)),
        ((-1.0, -0.5), (-1.0, 0.25), (-0.75, -0.5)),
    ],
)
def test_who_is_at_the_end_of_its_box_gives_way_no_farther(
    wanted: tuple[float, float], knee: tuple[float, float], found: tuple[float, float]
) -> None:
    assert project(wanted, knee, BOXES) == found
    assert knee[0] <= knee_of(found) <= knee[1]
