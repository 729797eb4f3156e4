"""The watch over a leg's momentum at both sides of each bound, to the cycle; numbers are exact."""

from dataclasses import replace

import pytest
from test_momentum import SPIN, springs

from legbench.limits.momentum import MomentumReading
from legbench.limits.momentum_watch import MomentumWatch

PERIOD = 1.0 / 384.0
"""Averages then are boxes of 4, 2 and 1 cycles, 18 ms together: eighths, exact in binary [s]."""
FILLED = 9
"""Readings until they are filled: two before the first second difference, and 7."""
LIMIT = 0.125
"""A link that is wrong by 1/32 rad at a spring of 4 N m/rad [N m]."""
LEARNED = 384 + FILLED
"""Readings until springs are known: a second [-]."""
FLIGHT, CONTACT = 4, 8
"""10 ms and 20 ms in cycles."""
LEG = replace(
    springs(replace(SPIN, moment=(2.5, 2.5)), SPIN),
    hip_range=(-1.0, 1.0),
    knee_range=(-1.0, 1.0),
)
"""A leg of which 1 N m on the knee, a fifth of its moments, rules a support out."""


def rest(
    polar: float, knee: float = 0.0, joint: tuple[float, float] = (0.0, 0.0)
) -> MomentumReading:
    """A leg at rest with torques along q1 + q2 and on the knee that its springs do not explain."""
    first, second = joint[0] + (knee - polar) / 8.0, joint[1] - (knee + polar) / 8.0
    return MomentumReading(PERIOD, (first, second), joint)


def watching() -> MomentumWatch:
    return MomentumWatch(LEG, 1.0 / 32.0, PERIOD)


def shown(watch: MomentumWatch, reading: MomentumReading, cycles: int) -> float | None:
    """Residual after some cycles, in which nothing is doubted."""
    for _ in range(cycles):
        assert watch.see(reading) is None
    return watch.residual


def doubted(watch: MomentumWatch, reading: MomentumReading, **how: bool) -> int | None:
    """Cycles of a reading until it is doubted."""
    return next((n for n in range(1, 100) if watch.see(reading, **how) is not None), None)


@pytest.mark.parametrize(
    "gap",
    [
        rest(0.0)._replace(interval=0.5 * PERIOD),
        rest(0.0)._replace(interval=1.5 * PERIOD),
        rest(0.0, joint=(0.99, 0.99)),
        rest(0.0, joint=(-0.99, -0.99)),
    ],
    ids=["too early", "too late", "hip at a stop", "hip at the other stop"],
)
def test_the_watch_has_an_answer_once_its_averages_are_filled(gap: MomentumReading) -> None:
    watch = watching()
    for _ in range(2):
        assert shown(watch, rest(0.5), FILLED - 1) is None
        assert shown(watch, rest(0.5), 1) == 0.5
        assert shown(watch, gap, 1) is None


@pytest.mark.parametrize("interval", [0.51 * PERIOD, 1.49 * PERIOD])
@pytest.mark.parametrize("joint", [0.985, -0.985])
def test_a_reading_that_is_hardly_regular_and_near_a_stop_counts(
    interval: float, joint: float
) -> None:
    at = rest(0.5, joint=(joint, joint))._replace(interval=interval)
    assert shown(watching(), at, FILLED) is not None


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_torque_within_the_limit_is_no_doubt_however_long_and_beyond_it_in_10_ms(
    sign: float,
) -> None:
    watch = watching()
    shown(watch, rest(sign * LIMIT), LEARNED)
    assert doubted(watch, rest(sign * LIMIT), stands=True) is None
    # A step of an eighth of 8 N m is seen in the cycle after it, as a second difference is.
    assert doubted(watch, rest(sign * 8.0)) == 1 + FLIGHT + 1
    watch = watching()
    shown(watch, rest(0.0), LEARNED)
    # From 0.125 N m on it is too much only when the averages are full, four cycles later.
    assert doubted(watch, rest(sign * 0.126)) == 1 + 4 + FLIGHT + 1


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("other", [-1.0, 1.0])
@pytest.mark.parametrize("well", [60, 61])
def test_evidence_that_was_explained_away_makes_no_later_doubt_earlier(
    sign: float, other: float, well: int
) -> None:
    watch = watching()
    shown(watch, rest(0.0), LEARNED)
    # One cycle is spread over five, of which three leave a quarter of it.
    shown(watch, rest(other * 0.9), 1)
    shown(watch, rest(0.0), well)
    assert doubted(watch, rest(sign * 8.0)) == 1 + FLIGHT + 1


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_knee_rules_a_support_out_beyond_a_fifth_of_the_weight(sign: float) -> None:
    for over, finite in ((0.0, True), (2.0**-20, False)):
        residual = shown(watching(), rest(0.25, sign * (1.0 + over)), FILLED)
        assert residual == (0.25 if finite else float("inf"))
    # Where a stop may push at the knee it rules nothing out, and 15 mrad from one it cannot.
    for angle, finite in ((0.99, True), (0.985, False)):
        for end in (-angle, angle):
            at = rest(0.25, sign * 4.0, joint=(0.0, end))
            residual = shown(watching(), at, FILLED)
            assert residual is not None
            assert (residual < float("inf")) is finite


def test_a_leg_of_which_no_support_is_left_is_doubted_after_both_averages_and_a_contact() -> None:
    found = []
    for how in ({}, {"stands": False}, {"stands": True}):
        watch = watching()
        shown(watch, rest(0.0), LEARNED)
        found.append(doubted(watch, rest(0.0, 2.0), **how))
    # Seen a cycle late, and 2 N m are more than 1 N m once five eighths of the weights know them.
    late = 1 + 2
    assert found == [late + CONTACT + 14 + 1, late + CONTACT + 14 + 1, late + FLIGHT + 1]


def test_nothing_is_learned_of_springs_while_no_support_is_left() -> None:
    watch = watching()
    shown(watch, rest(0.1, 2.0), LEARNED - FILLED)
    assert shown(watch, rest(0.0, 1.0), FILLED) == pytest.approx(0.0, abs=1e-12)
