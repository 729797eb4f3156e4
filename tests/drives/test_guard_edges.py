"""The guard at both sides of each of its edges, on either axis, from wherever a step begins."""

import itertools
import math

import pytest
from guard_rig import PERIOD, REST, fault, pair, started

from legbench.limits.guard import Guard
from legbench.limits.safety import SafetyLimits

STEP = 0.125
LIMITS = SafetyLimits(
    motor_range=((-2.0, 1.0), (-1.0, 2.0)),
    joint_range=((-1.0, 1.0), (-0.5, 1.5)),
    motor_knee_range=(0.25, 3.0),
    joint_knee_range=(0.125, 2.5),
    command_speed=STEP / PERIOD,
    command_step=0.5,
    spring_torque=8.0,
    temperature=80.0,
)
FREE = SafetyLimits(command_speed=STEP / PERIOD)
"""Slewed, and nothing else."""


# --- commands --------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", [0, 1])
def test_a_wish_is_let_through_by_no_more_than_one_step_wherever_it_begins(axis: int) -> None:
    places = [-1.0, -0.625, -0.125, 0.0, 0.0625, 0.125, 0.75, 1.0]
    for start, wish in itertools.product(places, places):
        guard = started(FREE, pair(axis, start, 0.0))
        step = math.copysign(min(abs(wish - start), STEP), wish - start)
        assert guard.command(pair(axis, wish, 0.0)) == pair(axis, start + step, 0.0)
        slewed = abs(wish - start) > STEP
        told = guard.shortfall.told()
        assert (told is not None) is slewed
        if told is not None:
            assert told["clamped"] == [0, 0]
            assert told["slewed"] == [1 - axis, axis]
            assert told["worst"][axis] == abs(wish - start) - STEP
        # It gets there in the end, and stays.
        for _ in range(16):
            guard.command(pair(axis, wish, 0.0))
        assert guard.applied == pair(axis, wish, 0.0)


@pytest.mark.parametrize("axis", [0, 1])
def test_the_ends_of_a_range_are_within_it_and_clamp_what_is_beyond(axis: int) -> None:
    ranges = ((-1.0, 1.0), (-0.5, 1.5))
    limits = SafetyLimits(motor_range=ranges)
    low, high = ranges[axis]
    for wish, given in ((low, low), (high, high), (low - 0.1, low), (high + 0.1, high)):
        guard = started(limits, (0.0, 0.0))
        assert guard.command(pair(axis, wish, 0.0)) == pair(axis, given, 0.0)
        assert guard.reachable(pair(axis, wish, 0.0)) == pair(axis, given, 0.0)
        assert (guard.shortfall.told() is None) is (wish == given)
    # Both at a time, too.
    for both, given in (((-1.1, -0.6), (-1.0, -0.5)), ((1.1, 1.6), (1.0, 1.5))):
        assert started(limits, (0.0, 0.0)).command(both) == given


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_motor_outside_its_range_goes_no_farther_and_comes_back_as_wished(
    axis: int, side: float
) -> None:
    limits = SafetyLimits(motor_range=((-1.0, 1.0), (-1.0, 1.0)), command_speed=STEP / PERIOD)
    guard = started(limits, pair(axis, 1.5 * side, 0.0))
    assert guard.command(pair(axis, 1.75 * side, 0.0)) == pair(axis, 1.5 * side, 0.0)
    assert guard.command(pair(axis, 1.4375 * side, 0.0)) == pair(axis, 1.4375 * side, 0.0)
    # What has been won is not given up again.
    assert guard.command(pair(axis, 1.5 * side, 0.0)) == pair(axis, 1.4375 * side, 0.0)


def test_both_motors_give_way_to_the_knee_within_their_step() -> None:
    limits = SafetyLimits(motor_knee_range=(0.25, 3.0), command_speed=STEP / PERIOD)
    for wish, end in (((0.5, -0.5), (-0.125, 0.125)), ((-2.0, 2.0), (-1.5, 1.5))):
        guard = started(limits)
        path = [guard.command(wish) for _ in range(12)]
        for (first, second), (before, after) in itertools.pairwise(path):
            assert 0.25 <= second - first <= 3.0
            assert max(abs(before - first), abs(after - second)) <= STEP
        assert path[0] != end
        assert path[-1] == end == guard.reachable(wish)
    # Each motor by its own step, even where one is nearly there and the other one is not.
    guard = started(limits, (0.0, 1.0))
    assert guard.command((0.5, 1.0625)) == (STEP, 1.0625)
    # The ends of the knee's range are let through as they are.
    for wish in ((0.0, 0.25), (-1.5, 1.5)):
        assert started(limits, wish).command(wish) == wish
    for edge, beyond_it in (((-0.125, 0.125), (-0.0625, 0.0625)), ((-1.5, 1.5), (-1.5625, 1.5625))):
        assert started(limits, edge).command(beyond_it) == edge
    guard = started(limits, (0.0, 0.25))
    assert guard.command((1.0, 1.25)) == (STEP, 0.25 + STEP)
    assert guard.command((0.25, 0.25)) == pytest.approx((0.125, 0.375))


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_wish_may_jump_by_its_limit_and_no_further(axis: int, side: float) -> None:
    limits = SafetyLimits(command_step=0.5)
    guard = started(limits, (0.0, 0.0))
    # Twice, as the second jump is measured from the first wish.
    guard.command(pair(axis, 0.5 * side, 0.0))
    guard.command(pair(axis, 1.0 * side, 0.0))
    applied = guard.applied
    told = fault(guard.command, pair(axis, 1.5625 * side, 0.0))
    assert told is not None
    assert told.startswith(f"command step: the command of motor {axis + 1} jumps by 0.562 rad")
    assert guard.applied == applied
    for nothing in (math.nan, math.inf, -math.inf):
        told = fault(guard.command, pair(axis, nothing, 0.0))
        assert told is not None
        assert told.startswith(f"command not finite: the command of motor {axis + 1} is {nothing}")


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_jump_to_the_other_side_is_as_long_as_it_is(axis: int, side: float) -> None:
    guard = started(SafetyLimits(command_step=0.5), pair(axis, -0.5 * side, 0.0))
    told = fault(guard.command, pair(axis, 0.5 * side, 0.0))
    assert told is not None
    assert told.startswith(f"command step: the command of motor {axis + 1} jumps by 1.000 rad")


def test_a_motor_that_jumps_by_its_limit_is_not_named_for_one_that_jumps_farther() -> None:
    for side in (-1.0, 1.0):
        guard = started(SafetyLimits(command_step=0.5), (0.0, 0.0))
        told = fault(guard.command, (0.5 * side, 0.5625 * side))
        assert str(told).startswith("command step: the command of motor 2 jumps by 0.562 rad")


def test_a_jump_is_measured_from_the_last_wish_until_that_is_forgotten() -> None:
    limits = SafetyLimits(command_speed=STEP / PERIOD, command_step=0.5)
    for forgets in (False, True):
        guard = started(limits, (0.0, 0.0))
        assert guard.command((0.5, 0.0)) == (STEP, 0.0)
        if forgets:
            guard.restart_from_applied()
        # From the wish it is 0.25, from what was applied 0.625.
        assert (fault(guard.command, (0.75, 0.0)) is None) is not forgets
        guard.start_at((-1.0, 0.0))
        assert guard.applied == (-1.0, 0.0)
        assert fault(guard.command, (-0.75, 0.0)) is None
        assert fault(guard.command, (0.75, 0.0)) is not None


def test_a_command_for_another_number_of_motors_is_refused() -> None:
    for wish in ((0.0,), (0.0, 0.25, 0.5)):
        guard = started(LIMITS)
        with pytest.raises(ValueError, match="values to unpack"):
            guard.command(wish)
        with pytest.raises(ValueError, match="zip"):
            guard.reachable(wish)
        with pytest.raises(ValueError, match="zip"):
            guard.check_start(wish)
        assert (guard.applied, guard.shortfall.cycles) == (REST, 0)
    alone = Guard(FREE, PERIOD)
    alone.start_at((0.0,))
    for wish in (0.0, 1.0):
        with pytest.raises(ValueError, match="values to unpack"):
            alone.command((wish,))
