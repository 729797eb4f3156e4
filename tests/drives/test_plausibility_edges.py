"""What motors and links may show, at both sides of each bound, against closed forms."""

import math
import random
from collections import deque
from dataclasses import replace

import pytest
from guard_rig import BOUNDS, REST, pair, see_links, see_motor

from legbench.limits.plausibility import Doubt, LinkWatch, MotorWatch

PERIOD = BOUNDS.period
FORGET = 1e-3
"""Share of a lasting sway that its reference takes up in one cycle, for a memory of 1 s."""
FADE = 1.0 - 2e-4
"""What remains of a sway that has been from one cycle to the next, for a memory of 5 s."""


def turned(axis: int, angle: float) -> tuple[float, float]:
    """The leg at rest with one link turned."""
    return pair(axis, REST[axis] + angle, REST[1 - axis])


class Links:
    """Links that are watched cycle by cycle, the motors at rest unless a test says otherwise."""

    def __init__(self) -> None:
        self.watch = LinkWatch(BOUNDS)
        self.cycle = 0

    def see(
        self,
        links: tuple[float, float],
        motors: tuple[float, float] = REST,
        commands: tuple[float, float] = REST,
        *,
        fresh: tuple[bool, bool] = (True, True),
        elapsed: int = 1,
    ) -> str | None:
        self.cycle += 1
        doubt = see_links(self.watch, links, motors, commands, fresh, elapsed)
        return None if doubt is None else f"{doubt.cause}: {doubt.message}"

    def rest(self, cycles: int) -> "Links":
        for _ in range(cycles):
            assert self.see(REST) is None
        return self


# --- motors ----------------------------------------------------------------------------------


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_motor_may_be_so_far_from_a_command_that_rests_and_no_farther(side: float) -> None:
    for away, found in ((0.0299, False), (0.0301, True)):
        watch = MotorWatch(BOUNDS)
        watch.start_at(0.25)
        doubts = [see_motor(watch, 2, 0.25 + side * away, 0.25) for _ in range(8)]
        # It may last five cycles; it is suspected from the first one on.
        assert [doubt is not None for doubt in doubts] == [False] * 5 + [found] * 3
        assert (watch.suspicion is not None) is found
        if found:
            assert {doubt.cause for doubt in doubts if doubt} == {"following error"}
            assert "motor 2 shows" in str(doubts[5])
            assert "for 6 cycles" in str(doubts[5])
        # One cycle in its place, and all is forgotten.
        assert see_motor(watch, 2, 0.25, 0.25) is None
        assert watch.suspicion is None
        assert [see_motor(watch, 2, 0.25 + side * away, 0.25) for _ in range(5)] == [None] * 5


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_motor_is_between_an_ideal_loop_and_the_slowest_one(side: float) -> None:
    # After a step of 0.2 rad: from where a loop of 15 Hz is, to the command itself.
    for cycle in (1, 5, 20, 60):
        slowest = 0.2 * (1.0 - math.exp(-2.0 * math.pi * 15.0 * PERIOD * cycle))
        for shown, found in (
            (slowest - 0.0299, False),
            (slowest - 0.0301, True),
            (0.2 + 0.0299, False),
            (0.2 + 0.0301, True),
        ):
            watch = MotorWatch(BOUNDS)
            watch.start_at(1.0)
            for _ in range(cycle):
                see_motor(watch, 1, 1.0 + side * shown, 1.0 + side * 0.2)
            assert (watch.suspicion is not None) is found


def test_a_new_start_closes_the_bounds_and_forgets_how_long_it_lasted() -> None:
    watch = MotorWatch(BOUNDS)
    watch.start_at(0.0)
    for _ in range(5):
        assert see_motor(watch, 1, 1.0, 0.0) is None
    watch.start_at(1.0)
    doubts = [see_motor(watch, 1, 0.9, 1.0) for _ in range(6)]
    assert doubts[:5] == [None] * 5
    assert isinstance(doubts[5], Doubt)


def test_a_watch_that_was_never_started_begins_at_zero_with_all_its_cycles() -> None:
    watch = MotorWatch(BOUNDS)
    assert [see_motor(watch, 1, 0.1, 0.0) for _ in range(5)] == [None] * 5
    assert see_motor(watch, 1, 0.1, 0.0) is not None


# --- speed of links --------------------------------------------------------------------------


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("cycles", [1, 2, 4])
def test_a_link_turns_by_60_mrad_a_cycle_that_has_passed_and_no_further(
    axis: int, side: float, cycles: int
) -> None:
    for way in ("elapsed", "not fresh"):
        for turn, found in ((0.0599 * cycles, False), (0.0601 * cycles, True)):
            it = Links().rest(3)
            if way == "elapsed":
                told = it.see(turned(axis, side * turn), elapsed=cycles)
            else:
                for _ in range(cycles - 1):
                    assert it.see(REST, fresh=(axis != 0, axis != 1)) is None
                told = it.see(turned(axis, side * turn))
            assert (told is not None) is found
            if found:
                assert str(told).startswith(f"joint speed: joint {axis + 1} moved by {turn:.3f}")
                assert f"in {cycles} cycles, 60 rad/s" in str(told)
    # What is not new is not looked at.
    it = Links().rest(3)
    assert it.see(turned(axis, side), fresh=(axis != 0, axis != 1)) is None


# --- sway ------------------------------------------------------------------------------------


def sways(it: Links, links: tuple[float, float], commands: tuple[float, float] = REST) -> bool:
    """Whether a sway is found after four cycles; not before."""
    told = [it.see(links, links, commands, elapsed=1000) for _ in range(4)]
    assert told[:3] == [None] * 3
    assert told[3] is None or told[3].startswith("sway: the links sway by")
    return told[3] is not None


def test_commands_that_rest_anywhere_widen_nothing() -> None:
    for sway, found in ((0.0500, False), (0.0504, True)):
        it = Links()
        for _ in range(300):
            assert it.see(REST, commands=(1.0, 0.5)) is None
        assert sways(it, turned(0, sway), (1.0, 0.5)) is found


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_sway_above_its_bound_is_found_after_four_cycles(axis: int, side: float) -> None:
    for sway, found in ((0.0500, False), (0.0504, True)):
        assert sways(Links().rest(300), turned(axis, side * sway)) is found
    # Three cycles are process data that repeat.
    it = Links().rest(300)
    for _ in range(3):
        for _ in range(3):
            links = turned(axis, side * 0.1)
            assert it.see(links, links, elapsed=1000) is None
        assert it.see(REST, elapsed=1000) is None
    # Links that turn against each other, the radial mode, do not sway.
    links = (REST[0] - 0.3, REST[1] + 0.3)
    assert not sways(Links().rest(300), links)


@pytest.mark.parametrize("waited", [100, 240, 260, 700])
def test_what_a_leg_did_before_a_quarter_of_a_second_it_may_do_by_half_more(waited: int) -> None:
    first = 0.04
    # The reference follows a lasting offset; what is old enough widens the bound.
    left = first * (1.0 - FORGET) ** (waited + 4)
    swayed = first * (1.0 - FORGET) * FADE ** (waited + 3 - 250) if waited > 249 else 0.0
    edge = (0.05 + 1.5 * swayed - left) / (1.0 - FORGET) ** 4
    for more, found in ((edge - 0.0005, False), (edge + 0.0005, True)):
        it = Links().rest(300)
        for _ in range(waited):
            assert it.see(turned(0, first), turned(0, first), elapsed=1000) is None
        assert sways(it, turned(0, first + more)) is found


@pytest.mark.parametrize("rested", [0, 500])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_command_along_the_polar_mode_allows_ten_times_as_much_and_is_forgotten(
    rested: int, side: float
) -> None:
    led = (REST[0] + side * 0.01, REST[1])
    edge = 0.05 + 10.0 * 0.01 * (1.0 - FORGET) ** (rested + 4)
    for sway, found in ((edge - 0.0005, False), (edge + 0.0015, True)):
        it = Links().rest(300)
        for _ in range(rested):
            assert it.see(REST, REST, led) is None
        assert sways(it, turned(1, sway), led) is found


# --- links that stand ------------------------------------------------------------------------


def moved(
    axis: int, slope: float, cycles: int, *, drift: float = 0.0, carried: bool = False
) -> int:
    """Cycle in which the other link is said to stand, while one moves evenly; 0 for none."""
    it = Links()
    for cycle in range(cycles):
        links = pair(axis, REST[axis] + slope * cycle, REST[1 - axis] + drift * cycle)
        told = it.see(links, links if carried else REST)
        if told is not None:
            assert told.startswith(f"joint encoder: joint {2 - axis} stands at")
            return it.cycle
    return 0


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_link_that_stands_for_20_cycles_while_the_other_one_moves_is_dead(
    axis: int, side: float
) -> None:
    edge = side * 0.02 / 19
    assert moved(axis, 0.99 * edge, 30) == 0
    assert moved(axis, 1.01 * edge, 30) == 20
    # It stands as long as it stays within 2 mrad.
    for drift, cycle in ((0.00195 / 19, 20), (0.00205 / 19, 0)):
        assert moved(axis, 1.1 * edge, 22, drift=-side * drift) == cycle
    # Where its motor carries a link along, no spring works.
    assert moved(axis, 1.1 * edge, 30, carried=True) == 0


def test_a_link_that_left_and_came_back_does_not_stand() -> None:
    for excursion, found in ((0.0015, True), (0.0025, False)):
        it, seen = Links(), []
        for cycle in range(20):
            here = excursion if cycle == 10 else 0.0
            seen.append(it.see((REST[0] + here, REST[1] + 0.0012 * cycle)))
        assert (seen[-1] is not None) is found


@pytest.mark.parametrize("seed", range(4))
def test_a_link_stands_as_the_ranges_of_its_last_readings_say(seed: int) -> None:
    # Legs that rest, creep and swing in turns, in steps around both bounds.
    dice, watch, last = (
        random.Random(seed),
        LinkWatch(BOUNDS),
        deque[tuple[float, float]](maxlen=20),
    )
    links, speeds, stood = list(REST), [0.0, 0.0], 0
    for cycle in range(1500):
        if cycle % 25 == 0:
            speeds = [dice.choice((0.0, 0.0, 5e-5, 1e-4, 5e-4, 1.2e-3)) for _ in REST]
            speeds = [speed * dice.choice((-1, 1)) for speed in speeds]
        links = [link + speed for link, speed in zip(links, speeds, strict=True)]
        last.append((links[0], links[1]))
        see_links(watch, links)
        ranges = [max(each) - min(each) for each in zip(*last, strict=True)]
        stands = min(ranges) <= 0.002 and max(ranges) > BOUNDS.standing
        assert watch.stands is (stands and len(last) == 20), cycle
        stood += watch.stands
    assert 20 < stood < 1000


def test_readings_that_are_not_new_are_no_standing() -> None:
    it = Links()
    for cycle in range(30):
        links = (REST[0], REST[1] + 0.0011 * cycle)
        assert it.see(links, fresh=(cycle % 2 == 0, True)) is None


def test_a_new_start_forgets_what_the_links_did() -> None:
    it = Links()
    for cycle in range(19):
        assert it.see((REST[0], REST[1] + 0.0015 * cycle)) is None
    it.watch.start()
    assert it.see((REST[0], REST[1] + 0.5)) is None
    it.rest(0)
    for _ in range(5):
        assert it.see((REST[0], REST[1] + 0.5)) is None


def test_the_bounds_themselves_are_allowed() -> None:
    # In binary numbers, so that a reading is exactly at its bound.
    exact = replace(BOUNDS, period=1.0 / 1024.0, joint_speed=64.0)
    for turn, found in ((0.0625, False), (math.nextafter(0.0625, 1.0), True)):
        watch = LinkWatch(exact)
        assert see_links(watch, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)) is None
        told = see_links(watch, (turn, -turn), (0.0, 0.0), (0.0, 0.0))
        assert (told is not None) is found
    near = replace(BOUNDS, following_error=0.03125)
    for off, found in ((0.03125, False), (math.nextafter(0.03125, 1.0), True)):
        for side in (-1.0, 1.0):
            motor = MotorWatch(near)
            see_motor(motor, 1, side * off, 0.0)
            assert (motor.suspicion is not None) is found
    for band, found in ((0.002, True), (math.nextafter(0.002, 1.0), False)):
        it, seen = Links(), []
        for cycle in range(20):
            seen.append(it.see((band if cycle == 10 else 0.0, 0.0012 * cycle), (0.0, 0.0)))
        assert (seen[-1] is not None) is found


def test_a_leg_hides_a_drift_once_it_may_sway_by_more_than_a_tenth() -> None:
    for sway, hides in ((0.1, False), (math.nextafter(0.1, 1.0), True)):
        watch = LinkWatch(replace(BOUNDS, sway=sway))
        assert (watch.stands, watch.hides_drift) == (False, False)
        watch.expect(REST)
        assert watch.hides_drift is hides
        watch.start()
        assert (watch.stands, watch.hides_drift) == (False, False)


def test_commands_along_the_polar_mode_alone_let_a_leg_sway() -> None:
    for moved, hides in (((-0.9, 0.9), False), ((-0.4, 0.6), True)):
        watch = LinkWatch(BOUNDS)
        for _ in range(20):
            assert see_links(watch, REST) is None
        watch.expect(moved)
        assert watch.hides_drift is hides


def test_a_sway_at_its_limit_is_allowed() -> None:
    # Its reference takes up 1/1024 of what lasts in each cycle, so that all numbers are exact.
    fourth = 0.0625 * (1023 / 1024) ** 4
    for limit, found in ((fourth, False), (math.nextafter(fourth, 0.0), True)):
        watch = LinkWatch(
            replace(BOUNDS, period=1 / 1024, sway=limit, joint_speed=math.inf, standing=math.inf)
        )
        see_links(watch, (0.0, 0.0))
        told = [see_links(watch, (0.03125, 0.03125)) for _ in range(4)]
        assert told[:3] == [None] * 3
        assert (told[3] is not None) is found


def test_a_motor_that_was_never_started_is_taken_to_stand_at_zero() -> None:
    for shown, found in ((0.0299, False), (0.5, True), (-0.5, True)):
        watch = MotorWatch(BOUNDS)
        see_motor(watch, 1, shown, 0.0)
        assert (watch.suspicion is not None) is found
