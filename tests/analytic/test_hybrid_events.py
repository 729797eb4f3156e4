"""Touchdown and lift-off against closed forms, and none missed or doubled."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from exact_leg import exact_design
from scipy.integrate import quad
from scipy.optimize import root_scalar

from legbench.analytic import (
    Accuracy,
    HybridLeg,
    LegModel,
    LegState,
    Regime,
    Transition,
    energy,
    flying,
    standing,
)
from legbench.analytic.contact import hold
from legbench.design import load_design
from legbench.design.statics import GRAVITY
from legbench.errors import ConfigError

MODELS = Path(__file__).parents[2] / "models"
EXACT = LegModel.of(exact_design(), stops=False)
PROTOTYPE = LegModel.of(load_design(MODELS / "prototype.toml"))
BENT = (-0.6, 0.6)
MOTOR = (-0.55, 0.55)


def height(model: LegModel, state: LegState) -> float:
    return state.trunk_pos[1] + model.foot_from_hip(state.q)[1]


@pytest.mark.parametrize("seed", range(4))
def test_touchdown_of_the_resting_leg_is_that_of_a_stone(seed: int) -> None:
    random = np.random.default_rng(seed)
    leg = HybridLeg(EXACT)
    for _ in range(50):
        q = tuple(random.uniform(-0.5, 0.5) + np.array([-1.0, 1.0]) * random.uniform(0.2, 1.3))
        drop, speed = random.exponential(0.1), random.uniform(-2.0, 2.0)
        trunk = (0.0, drop - EXACT.foot_from_hip(q)[1])
        state = flying(EXACT, q, (0.0, 0.0), trunk, (random.uniform(-1.0, 1.0), speed))
        wanted = (speed + math.sqrt(speed**2 + 2.0 * GRAVITY * height(EXACT, state))) / GRAVITY
        _, happened = leg.advance(state, wanted + 1e-4, q)
        assert happened[0].touchdown
        assert abs(happened[0].time - wanted) < 1e-9


def radial_quadrature(model: LegModel, start: float, motor: float) -> tuple[float, float]:
    """Lift-off time and half angle of a leg on x1 = 0 released at rest, from energy alone."""
    i1, i2 = model.stance.inertia
    h = sum(model.floating.above_foot)
    k, mass, g = sum(model.stiffness), model.floating.mass, model.floating.gravity

    def inertia(a: float) -> float:
        return i1 + i2 - 2.0 * model.stance.coupling * math.cos(2.0 * a)

    def fallen(below: float) -> float:  # potential(start) - potential(start - below), no cancelling
        elastic = 0.5 * k * below * (2.0 * (start - motor) - below)
        return elastic + 2.0 * g * h * math.sin(start - 0.5 * below) * math.sin(0.5 * below)

    def rate_squared(a: float, below: float | None = None) -> float:
        return 2.0 * fallen(start - a if below is None else below) / inertia(a)

    def force(a: float) -> float:
        slope_v = k * (a - motor) + g * h * math.sin(a)
        slope_m = 4.0 * model.stance.coupling * math.sin(2.0 * a)
        acceleration = -(slope_v + 0.5 * slope_m * rate_squared(a)) / inertia(a)
        lift = h * (math.sin(a) * acceleration + math.cos(a) * rate_squared(a))
        return mass * g + lift

    angles = np.linspace(start - 1e-6, 0.05, 4000)
    forces = [force(a) for a in angles]
    last = int(np.flatnonzero(np.array(forces) < 0.0)[0])
    bracket = (angles[last - 1], angles[last])
    angle = float(root_scalar(force, bracket=bracket, xtol=1e-15).root)

    def integrand(s: float) -> float:  # a = start - s^2 takes the singularity away
        return 2.0 * s / math.sqrt(rate_squared(start - s * s, s * s)) if s > 0.0 else 0.0

    time, _ = quad(integrand, 0.0, math.sqrt(start - angle), epsabs=1e-13, epsrel=1e-13)
    return time, angle


@pytest.mark.parametrize("start", [0.75, 0.9, 1.05])
def test_liftoff_on_the_radial_mode_is_a_quadrature(start: float) -> None:
    time, angle = radial_quadrature(EXACT, start, 0.2)
    state = standing(EXACT, (-start, start))
    _, happened = HybridLeg(EXACT).advance(state, time + 0.01, (-0.2, 0.2))
    assert not happened[0].touchdown
    assert abs(happened[0].time - time) < 1e-9
    assert abs(happened[0].before.q[1] - angle) < 1e-8


def random_start(model: LegModel, random: np.random.Generator) -> LegState:
    half, lean = random.uniform(0.3, 1.2), random.uniform(-0.3, 0.3)
    q = (lean - half, lean + half)
    v = tuple(random.uniform(-8.0, 8.0, 2).tolist())
    if random.random() < 0.5:
        return standing(model, q, v)
    trunk = (0.0, random.exponential(0.03) - model.foot_from_hip(q)[1])
    return flying(model, q, v, trunk, tuple(random.uniform(-1.5, 1.5, 2).tolist()))


def check_run(model: LegModel, start: LegState, motor: tuple[float, float], time: float) -> int:
    """Sample a run densely: nothing under the ground, nothing pulled, nothing twice."""
    leg, state, events = HybridLeg(model), start, list[Transition]()
    for tick in range(1, round(time / 0.001) + 1):
        state, happened = leg.advance(state, 0.001 * tick, motor)
        events += happened
        if state.time - state.since <= leg.accuracy.min_phase:
            continue
        if state.regime is Regime.FLIGHT:
            vertical = state.trunk_vel[1] + model.foot_vel_from_hip(state.q, state.v)[1]
            assert height(model, state) > -1e-9 or vertical >= 0.0
        else:
            assert hold(model, motor, state.q, state.v) > -1e-6
    kinds = [start.regime is Regime.FLIGHT, *(not event.touchdown for event in events)]
    assert all(a != b for a, b in itertools.pairwise(kinds))
    for first, second in itertools.pairwise(events):
        assert second.time - first.time >= 0.999 * leg.accuracy.min_phase
        assert (
            abs(height(model, second.before)) < 1e-9
            or not second.touchdown
            or (second.time - first.time < 1.001 * leg.accuracy.min_phase)
        )
    return len(events)


@pytest.mark.parametrize(
    "model", [pytest.param(EXACT, marks=pytest.mark.long), PROTOTYPE], ids=["exact", "prototype"]
)
def test_random_starts_miss_no_event_and_repeat_none(model: LegModel) -> None:
    random = np.random.default_rng(11)
    events = sum(check_run(model, random_start(model, random), MOTOR, 0.3) for _ in range(15))
    assert events > 15


@pytest.mark.long
def test_a_long_step_misses_no_event_that_short_ones_find() -> None:
    random = np.random.default_rng(12)
    coarse, fine = HybridLeg(EXACT), HybridLeg(EXACT, Accuracy(rtol=1e-12, max_step=2e-4))
    for _ in range(20):
        start = random_start(EXACT, random)
        first = coarse.advance(start, 0.15, MOTOR)[1]
        second = fine.advance(start, 0.15, MOTOR)[1]
        assert [event.touchdown for event in first] == [event.touchdown for event in second]
        assert np.allclose([e.time for e in first], [e.time for e in second], rtol=0, atol=1e-7)


def test_a_foot_on_the_ground_and_falling_lands_at_once() -> None:
    trunk = (0.0, -EXACT.foot_from_hip(BENT)[1])
    state = flying(EXACT, BENT, (0.0, 0.0), trunk, (0.0, -1.0))
    _, happened = HybridLeg(EXACT).advance(state, 0.01, BENT)
    assert happened[0].touchdown
    assert happened[0].time == 0.0


@pytest.mark.parametrize("model", [EXACT, PROTOTYPE], ids=["exact", "prototype"])
def test_impact_never_adds_energy_along_a_run(model: LegModel) -> None:
    random = np.random.default_rng(13)
    landed = 0
    for _ in range(30):
        start = random_start(model, random)
        for event in HybridLeg(model).advance(start, 0.3, MOTOR)[1]:
            before, after = (energy(model, state, MOTOR) for state in (event.before, event.after))
            if event.touchdown:
                landed += 1
                assert after <= before + 1e-9
            else:
                assert math.isclose(after, before, abs_tol=1e-9)
    assert landed > 15


def test_a_start_under_the_ground_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"mm below the ground; raise the trunk from 0.1 m to"):
        flying(EXACT, BENT, (0.0, 0.0), (0.0, 0.1), (0.0, 0.0))


def test_a_pinned_foot_never_lifts() -> None:
    state = standing(EXACT, (-1.0, 1.0), pinned=True)
    state, happened = HybridLeg(EXACT).advance(state, 0.5, (-0.5, 0.5))
    assert happened == []
    assert state.regime is Regime.PINNED
