"""What a leg's momentum is judged by, part by part: averages, springs, contact, and their order."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from test_momentum import SPIN, springs

from legbench.limits.ground_contact import GroundContact
from legbench.limits.momentum import (
    LegMotion,
    MomentumReading,
    SupportPoint,
    left_over,
    motion_of,
)
from legbench.limits.spring_mismatch import SpringMismatch
from legbench.limits.support_watch import MovingAverage, SupportWatch

PERIOD = 1e-3
TORQUE = 0.12
"""Torque that a link which is wrong by 0.03 rad makes at a spring of 4 N m/rad [N m]."""

# --- averages --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("cycles", "lengths"), [(18, (9, 6, 3)), (6, (3, 2, 1)), (40, (20, 13, 7))]
)
def test_an_average_is_three_boxes_of_half_a_third_and_the_rest(
    cycles: int, lengths: tuple[int, int, int]
) -> None:
    boxes = [np.ones(length) / length for length in lengths]
    weights = np.convolve(np.convolve(boxes[0], boxes[1]), boxes[2])
    assert len(weights) == cycles - 2
    average = MovingAverage(cycles)
    shown = [average.after(value) for value in [1.0] + [0.0] * (cycles + 4)]
    assert shown[: cycles - 2] == pytest.approx(weights)
    assert shown[cycles - 2 :] == pytest.approx([0.0] * 7, abs=1e-12)
    # What lasts is shown in full once it has filled them, and not a cycle before.
    average = MovingAverage(cycles)
    held = [average.after(3.0) for _ in range(cycles)]
    assert held[cycles - 3 :] == pytest.approx([3.0] * 3)
    assert held[cycles - 4] < 2.999


@pytest.mark.parametrize(
    ("step", "period", "cycles"),
    [
        # 18 ms in cycles of 1 ms and of 2 ms; never fewer than 6 cycles.
        (0.0, 1e-3, 18),
        (0.0, 2e-3, 9),
        (0.0, 4e-3, 6),
        # 12.3 (0.05 + 0.01) kg m^2 1 mrad / (1 ms)^2 / 0.05 N m = 14 760; to the power 0.4: 46.5.
        (1e-3, 1e-3, 47),
        # At 2 ms a quarter of that: 26.7.
        (1e-3, 2e-3, 27),
    ],
)
def test_averages_reach_so_many_cycles(step: float, period: float, cycles: int) -> None:
    for inertia in ((0.05, 0.02), (0.02, 0.05)):
        for coupling in (0.01, -0.01):
            support = SupportPoint(inertia=inertia, coupling=coupling, moment=(0.0, 0.0))
            assert support.average_cycles(step, 0.05, period) == cycles


# --- torques of a motion ---------------------------------------------------------------------


def turning(polar: float, radial: float) -> list[MomentumReading]:
    """Three readings 1 ms and 2 ms apart of links that turn together, and against each other.

    Args:
        polar: angles of q1 = q2 at the third reading, from the second one [rad].
        radial: angles of q2 = -q1 there [rad].
    """
    found = []
    for interval, share in ((7.0, -0.5), (1e-3, 0.0), (2e-3, 1.0)):
        joint = (0.3 + share * (polar - radial), 0.3 + share * (polar + radial))
        found.append(MomentumReading(interval, (0.4, 0.6), joint))
    return found


def test_a_motion_at_constant_speeds_is_springs_damping_and_what_the_coupling_turns() -> None:
    leg = replace(springs(SPIN), stiffness=(2.0, 4.0), damping=(0.125, 0.25))
    motion = motion_of(leg, turning(polar=0.02, radial=0.0))
    # 10 rad/s on both joints: nothing speeds up, and q1 - q2 rests at 0.
    assert motion[:4] == pytest.approx((0.0, 0.0, 0.0, 0.0), abs=1e-9)
    assert motion[4:6] == pytest.approx((math.sin(0.3), math.sin(0.3)))
    springs_wound = 2.0 * 0.1, 4.0 * 0.3
    assert motion[6:8] == pytest.approx((springs_wound[0] - 1.25, springs_wound[1] - 2.5))
    assert motion.wound == pytest.approx(springs_wound[1] - springs_wound[0])
    motion = motion_of(leg, turning(polar=0.0, radial=0.02))
    # -10 and 10 rad/s: cos(q1 - q2) is even about the middle, but its time is not: it is
    # cos(0.02) on average over the first millisecond and cos(0.04) over the two after it.
    c_back, c_on = math.cos(0.01), math.cos(0.02)
    assert motion.accel_1 == pytest.approx(0.0, abs=1e-9)
    assert motion.coupled_polar == pytest.approx(0.0, abs=1e-9)
    assert motion.coupled_knee == pytest.approx(20.0 * (c_on - c_back) / 1.5e-3)
    assert motion.torque_1 == pytest.approx(2.0 * 0.1 + 1.25)
    assert motion.torque_2 == pytest.approx(4.0 * 0.3 - 2.5)


def test_what_is_left_over_is_each_term_with_its_sign() -> None:
    support = SupportPoint(inertia=(2.0, 3.0), coupling=0.5, moment=(7.0, 11.0))
    none = LegMotion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for name, polar, knee in (
        ("accel_1", 2.0, -2.0),
        ("accel_2", 3.0, 3.0),
        ("coupled_polar", 0.5, 0.0),
        ("coupled_knee", 0.0, -0.5),
        ("sine_1", 7.0, -7.0),
        ("sine_2", 11.0, 11.0),
        ("torque_1", -1.0, 1.0),
        ("torque_2", -1.0, -1.0),
        ("wound", 0.0, 0.0),
    ):
        assert left_over(support, none._replace(**{name: 1.0})) == (polar, knee)


# --- springs ---------------------------------------------------------------------------------


def learned(pairs: Sequence[tuple[float, float]]) -> SpringMismatch:
    mismatch = SpringMismatch(TORQUE, PERIOD)
    for polar, by in pairs:
        mismatch.learn(polar, by)
    return mismatch


def test_springs_are_known_after_a_second_and_not_a_cycle_before() -> None:
    for count, known in ((0, False), (999, False), (1000, True), (1500, True)):
        assert learned([(0.0, 1.0)] * count).known is known


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_mismatch_is_the_share_of_the_torque_by_which_springs_are_wound(sign: float) -> None:
    # Least squares, in which 0.12 N m squared stand for springs that are hardly wound.
    assert learned([(sign * 0.03, 1.0)] * 5).share == pytest.approx(sign * 0.03 / 1.0144)
    assert learned([(sign * 0.06, -2.0)] * 5).share == pytest.approx(-sign * 0.12 / 4.0144)
    # The first cycles count alike: of torques 0.03 and 0.01 it is the mean.
    two = learned([(sign * 0.03, 1.0), (sign * 0.01, 1.0)])
    assert two.share == pytest.approx(sign * 0.02 / 1.0144)
    assert learned([]).share == 0.0


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_no_spring_differs_by_more_than_6_percent_and_more_torque_is_none_of_theirs(
    sign: float,
) -> None:
    assert learned([(sign * 0.1, 1.0)]).share == sign * 0.06
    # Up to 0.12 N m and 6 % of what they are wound by, to either side.
    for by in (1.0, -1.0):
        assert learned([(sign * 0.1799, by)]).share == sign * by * 0.06
        assert learned([(sign * 0.1801, by)]).share == 0.0
    # What cannot be theirs counts as time alone: the mean of one in two.
    mean = pytest.approx(0.015 / 0.5144)
    assert learned([(math.inf, 0.0), (0.03, 1.0)]).share == mean
    assert learned([(0.03, 1.0), (TORQUE, 0.0)]).share == mean
    assert learned([(0.03, 1.0), (1.001 * TORQUE, 0.0)]).share == pytest.approx(0.03 / 1.0144)


def test_springs_are_forgotten_within_a_second() -> None:
    mismatch = learned([(0.05, 1.0)] * 1000)
    for _ in range(1000):
        mismatch.learn(0.0, 1.0)
    assert mismatch.share == pytest.approx(0.05 * (1.0 - 1e-3) ** 1000 / 1.0144)


# --- contact ---------------------------------------------------------------------------------


def contact(loads: Sequence[float]) -> list[str]:
    """What is certain after each load on the knee, 5 cycles a stance.

    Args:
        loads: relative to the one up to which a leg may be in flight [-].
    """
    judge = GroundContact(2.0, 5, PERIOD)
    found = []
    for load in loads:
        judge.after(2.0 * load)
        found.append(f"{'f' * judge.in_flight}{'s' * judge.in_stance}")
    return found


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_flight_is_certain_after_6_ms_and_a_stance_once_averages_are_filled(sign: float) -> None:
    assert contact([sign * 1.0] * 8) == [""] * 6 + ["f"] * 2
    assert contact([sign * 3.01] * 7) == [""] * 5 + ["s"] * 2
    # Between both nothing is known, and it all begins anew.
    assert contact([sign * 1.01] * 9) == contact([sign * 3.0] * 9) == [""] * 9
    for load in (1.01, 3.0, 3.01):
        shown = contact([1.0] * 7 + [sign * load] + [1.0] * 7)
        assert shown == [""] * 6 + ["f"] + [""] * 7 + ["f"]
    for load in (3.0, 0.0):
        shown = contact([4.0] * 6 + [sign * load] + [4.0] * 6)
        assert shown == [""] * 5 + ["s"] + [""] * 6 + ["s"]


def test_what_is_forgotten_of_a_contact_takes_as_long_again() -> None:
    for load, cycles in ((0.0, 7), (4.0, 6)):
        judge = GroundContact(1.0, 5, PERIOD)
        for _ in range(2):
            assert (judge.in_flight, judge.in_stance) == (False, False)
            for _ in range(cycles - 1):
                judge.after(load)
            assert (judge.in_flight, judge.in_stance) == (False, False)
            judge.after(load)
            assert (judge.in_flight, judge.in_stance) == (load < 1.0, load > 1.0)
            judge.forget()


# --- one support -----------------------------------------------------------------------------

HEAVY = replace(SPIN, moment=(1.0, 1.0))
RESTING = LegMotion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.5, -0.25, 0.25)
"""A leg without weight whose springs leave 0.75 N m along q1 + q2, and -0.25 N m on the knee."""


@pytest.mark.parametrize(
    ("step", "period", "ground", "flight"),
    [
        # 20 ms on the ground and 10 ms in flight, of which averages over 18 ms are less than half.
        (0.0, 1e-3, (18, 20), (18, 10)),
        (0.0, 0.5e-3, (36, 40), (36, 20)),
        # Averages that reach over 41 cycles: 12.3 0.03 kg m^2 1 mrad / (1 ms)^2 / (0.6 0.06 N m).
        (1e-3, 1e-3, (41, 20), (41, 20)),
    ],
)
def test_a_support_waits_for_contact_or_for_half_of_its_averages(
    step: float, period: float, ground: tuple[int, int], flight: tuple[int, int]
) -> None:
    leg = replace(springs(HEAVY, SPIN), link_step=step)
    found = [SupportWatch(leg, support, 0.06, period) for support in leg.supports]
    assert [(one.reach, one.patience) for one in found] == [ground, flight]
    # A leg with one support alone is never doubted later than one in flight.
    alone = SupportWatch(replace(leg, supports=leg.supports[:1]), leg.supports[0], 0.06, period)
    assert (alone.reach, alone.patience) == flight


def test_a_support_shows_both_averages_and_how_long_a_stop_may_push() -> None:
    leg = springs(HEAVY, SPIN)
    watch = SupportWatch(leg, leg.supports[1], 0.06, PERIOD)
    for _ in range(2):
        assert watch.pushed is False
        shown = [watch.after(RESTING, free=True) for _ in range(18)]
        assert shown[-1] == pytest.approx((0.75, -0.25))
        assert shown[0] == pytest.approx((0.75 / 162.0, -0.25 / 162.0))
        assert watch.pushed is False
        watch.after(RESTING, free=False)
        # 18 cycles of averages, and a cycle on each side that second differences reach to.
        pushed = []
        for _ in range(22):
            pushed.append(watch.pushed)
            watch.after(RESTING, free=True)
        assert pushed == [True] * 20 + [False] * 2
        watch.after(RESTING, free=False)
        watch.restart()
