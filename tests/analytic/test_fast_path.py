"""The compiled equations against the interpreted ones and against closed forms."""

import math
from pathlib import Path

import numpy as np
import pytest
from exact_leg import exact_design

from legbench.analytic import (
    Accuracy,
    HybridLeg,
    LegModel,
    LegState,
    Regime,
    flying,
    standing,
)
from legbench.design import load_design
from legbench.design.statics import GRAVITY
from legbench.errors import ConfigError, PlantFault

pytest.importorskip("heyoka")

from legbench.analytic.taylor import MAP_TOLERANCE, Levels, TaylorLeg, Watched

EXACT = LegModel.of(exact_design(), stops=False)
PROTOTYPE = LegModel.of(load_design(Path(__file__).parents[2] / "models" / "prototype.toml"))
MOTOR = (-0.4, 0.4)
FINE = Accuracy(rtol=1e-12, atol=1e-14)


@pytest.fixture(scope="module")
def fast() -> TaylorLeg:
    return TaylorLeg(EXACT, probe=(-math.sqrt(0.5), math.sqrt(0.5)))


@pytest.fixture(scope="module")
def stopped() -> TaylorLeg:
    return TaylorLeg(PROTOTYPE)


def test_ten_thousand_falls_touch_down_when_a_stone_does(fast: TaylorLeg) -> None:
    random = np.random.default_rng(31)
    worst = 0.0
    for _ in range(10_000):
        lean, half = random.uniform(-0.5, 0.5), random.uniform(0.2, 1.3)
        q = (lean - half, lean + half)
        drop, speed = random.exponential(0.1), random.uniform(-2.0, 2.0)
        trunk = (0.0, drop - EXACT.foot_from_hip(q)[1])
        state = flying(EXACT, q, (0.0, 0.0), trunk, (random.uniform(-1.0, 1.0), speed))
        height = trunk[1] + EXACT.foot_from_hip(q)[1]
        wanted = (speed + math.sqrt(speed**2 + 2.0 * GRAVITY * height)) / GRAVITY
        _, happened = fast.advance(state, wanted + 1e-4, q)
        assert [event.touchdown for event in happened] == [True]
        worst = max(worst, abs(happened[0].time - wanted))
    assert worst < 1e-9


def random_start(model: LegModel, random: np.random.Generator) -> LegState:
    half, lean = random.uniform(0.3, 1.2), random.uniform(-0.3, 0.3)
    q = (lean - half, lean + half)
    v = tuple(random.uniform(-8.0, 8.0, 2).tolist())
    if random.random() < 0.5:
        return standing(model, q, v)
    trunk = (0.0, random.exponential(0.03) - model.foot_from_hip(q)[1])
    return flying(model, q, v, trunk, tuple(random.uniform(-1.5, 1.5, 2).tolist()))


def same_story(slow: HybridLeg, fast: TaylorLeg, seed: int, count: int) -> int:
    """Both paths tell of the same events; how many there were."""
    random, events = np.random.default_rng(seed), 0
    for _ in range(count):
        start = random_start(slow.model, random)
        one, first = slow.advance(start, 0.15, MOTOR)
        other, second = fast.advance(start, 0.15, MOTOR)
        assert [event.touchdown for event in first] == [event.touchdown for event in second]
        times = [[event.time for event in happened] for happened in (first, second)]
        assert np.allclose(*times, rtol=0.0, atol=1e-9)
        assert np.allclose(one.q + one.v, other.q + other.v, rtol=1e-7, atol=1e-7)
        assert np.allclose(one.trunk_pos, other.trunk_pos, rtol=0.0, atol=1e-9)
        events += len(first)
    return events


def test_both_paths_tell_the_same_story(fast: TaylorLeg) -> None:
    assert same_story(HybridLeg(EXACT, FINE), fast, 32, 60) > 40


def test_both_paths_meet_the_same_stops(stopped: TaylorLeg) -> None:
    slow = HybridLeg(PROTOTYPE, FINE)
    start = flying(PROTOTYPE, (-0.4, 0.4), (20.0, -18.0), (0.0, 2.0), (0.0, 0.0))
    deepest = 1.0
    for tick in range(1, 61):
        until = 0.001 * tick
        one = slow.advance(start, until, MOTOR)[0]
        other = stopped.advance(start, until, MOTOR)[0]
        assert np.allclose(one.q + one.v, other.q + other.v, rtol=1e-7, atol=1e-7)
        deepest = min(deepest, one.q[1] - one.q[0])
    assert deepest < 0.30


def hanging(q: tuple[float, float]) -> LegState:
    return LegState(
        time=0.0,
        regime=Regime.HANGING,
        q=q,
        v=(0.0, 0.0),
        trunk_pos=(0.0, 0.3),
        trunk_vel=(0.0, 0.0),
    )


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4])
def test_order_of_convergence(tolerance: float) -> None:
    leg = TaylorLeg(EXACT, tolerance=tolerance)
    start, seconds = hanging((-0.9, 0.3)), 0.16
    exact = HybridLeg(EXACT, Accuracy(rtol=1e-13, atol=1e-15, max_step=5e-4)).advance(
        start, seconds, MOTOR
    )[0]
    nominal = leg.order(Regime.HANGING)
    counts = (160, 240, 360)
    errors = []
    for count in counts:
        end = leg.fixed_steps(start, seconds / count, count, MOTOR)
        errors.append(np.max(np.abs(np.subtract(end.q + end.v, exact.q + exact.v))))
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert nominal >= 4
    assert abs(slope - nominal) < 0.2


def test_a_probe_stops_where_it_is_told(fast: TaylorLeg) -> None:
    start = standing(EXACT, (-0.9, 0.9), pinned=True)
    level = math.sqrt(2.0) * 0.8
    state, what = fast.watch(start, 1.0, MOTOR, Levels(lower=level))
    assert what is Watched.FALL
    assert math.isclose((state.q[1] - state.q[0]) / math.sqrt(2.0), level, abs_tol=1e-12)
    turned, what = fast.watch(state, 1.0, MOTOR, Levels(turns=True))
    assert what is Watched.TURN
    assert abs(turned.v[1] - turned.v[0]) < 1e-10
    assert turned.time > state.time
    risen, what = fast.watch(turned, 1.0, MOTOR, Levels(upper=level))
    assert what is Watched.RISE
    assert math.isclose(risen.time - turned.time, turned.time - state.time, rel_tol=1e-9)
    end, what = fast.watch(risen, risen.time + 1e-3, MOTOR, Levels())
    assert what is None
    assert end.time == risen.time + 1e-3


def test_a_go_ends_at_its_time_to_the_last_bit(fast: TaylorLeg) -> None:
    random = np.random.default_rng(34)
    for _ in range(200):
        began, until = random.uniform(0.0, 0.1), random.uniform(0.1, 0.2)
        start = standing(EXACT, (-0.6, 0.6), time=began, pinned=True)
        assert fast.watch(start, until, MOTOR, Levels())[0].time == until


def test_a_runaway_is_a_fault(fast: TaylorLeg) -> None:
    start = standing(EXACT, (-0.6, 0.6), (1e200, -1e200), pinned=True)
    with pytest.raises(PlantFault, match="integration failed at t ="):
        fast.advance(start, 1.0, MOTOR)


def test_a_tolerance_of_zero_is_refused() -> None:
    with pytest.raises(ConfigError, match="tolerance is 0; it must be positive"):
        TaylorLeg(EXACT, tolerance=0.0)


def test_the_tolerance_for_maps_costs_a_hop_no_more_than_it_says(fast: TaylorLeg) -> None:
    loose = TaylorLeg(EXACT, tolerance=MAP_TOLERANCE)
    assert loose.order(Regime.FLIGHT) < fast.order(Regime.FLIGHT)
    random, worst = np.random.default_rng(33), 0.0
    for _ in range(100):
        start = random_start(EXACT, random)
        one, other = (leg.advance(start, 0.3, MOTOR)[0] for leg in (fast, loose))
        worst = max(worst, float(np.max(np.abs(np.subtract(one.q + one.v, other.q + other.v)))))
    assert 0.0 < worst < 1e-7


def test_a_leg_that_was_sent_elsewhere_goes_on_from_its_state(fast: TaylorLeg) -> None:
    start = standing(EXACT, (-0.9, 0.9), pinned=True)
    half, _ = fast.watch(start, 0.1, MOTOR, Levels())
    wanted, _ = fast.watch(half, 0.2, MOTOR, Levels())
    half, _ = fast.watch(start, 0.1, MOTOR, Levels())
    fast.course.fly((-0.3, 0.3), (1.0, 2.0), (0.0, 1.0), (0.0, 0.0))
    fast.course.go(0.05)
    found, _ = fast.watch(half, 0.2, MOTOR, Levels())
    assert np.allclose(found.q + found.v, wanted.q + wanted.v, rtol=0.0, atol=1e-12)
