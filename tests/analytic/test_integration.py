"""Energy, invariance of the mode, and the order of every stepper."""

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
    RungeKutta,
    energy,
    flying,
    standing,
)
from legbench.design import load_design
from legbench.design.statics import Support, motor_holding
from legbench.errors import ConfigError, PlantFault

MODELS = Path(__file__).parents[2] / "models"
LEG = exact_design()
MODEL = LegModel.of(LEG, stops=False)
HELD = motor_holding(LEG, np.array([-0.6, 0.6]), Support.FOOT).tolist()
MOTOR = (HELD[0], HELD[1])


def drift(model: LegModel, accuracy: Accuracy, state: LegState, seconds: float) -> float:
    leg, first, worst = HybridLeg(model, accuracy), energy(model, state, MOTOR), 0.0
    for tick in range(1, round(10 * seconds) + 1):
        state, _ = leg.advance(state, 0.1 * tick, MOTOR)
        worst = max(worst, abs(energy(model, state, MOTOR) - first))
    return worst


@pytest.mark.parametrize("q", [(-0.8, 0.8), (-0.8, 0.6)], ids=["radial", "both"])
def test_undamped_stance_keeps_its_energy_for_ten_seconds(q: tuple[float, float]) -> None:
    assert drift(MODEL, Accuracy(), standing(MODEL, q, pinned=True), 10.0) < 1e-9


@pytest.mark.long
def test_undamped_flight_keeps_its_energy_for_ten_seconds() -> None:
    state = flying(MODEL, (-0.8, 0.7), (3.0, -5.0), (0.0, 500.3), (0.1, 2.0))
    assert drift(MODEL, Accuracy(rtol=1e-12, atol=1e-14), state, 10.0) < 1e-9
    # At the default tolerance of what is there: 4.9 kJ of height.
    assert drift(MODEL, Accuracy(), state, 10.0) / energy(MODEL, state, MOTOR) < 1e-9


def test_undamped_hanging_leg_keeps_its_energy() -> None:
    state = LegState(
        time=0.0,
        regime=Regime.HANGING,
        q=(-0.9, 0.7),
        v=(0.0, 0.0),
        trunk_pos=(0.0, 0.3),
        trunk_vel=(0.0, 0.0),
    )
    assert drift(MODEL, Accuracy(rtol=1e-12, atol=1e-14), state, 10.0) < 1e-9


@pytest.mark.parametrize("regime", [Regime.PINNED, Regime.HANGING])
def test_matched_leg_stays_on_the_radial_mode_for_twenty_periods(regime: Regime) -> None:
    motor = MOTOR if regime is Regime.PINNED else (-0.6, 0.6)
    state = standing(MODEL, (-0.9, 0.9), pinned=True)
    state = LegState(
        time=0.0,
        regime=regime,
        q=state.q,
        v=state.v,
        trunk_pos=state.trunk_pos,
        trunk_vel=state.trunk_vel,
    )
    leg, worst, crossings, last = HybridLeg(MODEL), 0.0, 0, -1.0
    while crossings < 40:
        state, _ = leg.advance(state, state.time + 0.002, motor)
        worst = max(worst, abs(state.q[0] + state.q[1]) / np.sqrt(2.0))
        crossings += state.v[1] * last < 0.0
        last = state.v[1]
        assert state.time < 30.0
    assert worst < 1e-9


def test_rounded_leg_leaves_the_mode() -> None:
    leg = load_design(MODELS / "table2.toml")
    model = LegModel.of(leg, stops=False, undamped=True)
    state, _ = HybridLeg(model).advance(standing(model, (-0.9, 0.9), pinned=True), 2.0, MOTOR)
    assert abs(state.q[0] + state.q[1]) > 1e-6


@pytest.mark.parametrize(
    ("method", "nominal", "counts"),
    [(RungeKutta.RK45, 5.0, (320, 640, 1280)), (RungeKutta.DOP853, 8.0, (80, 100, 120))],
)
@pytest.mark.parametrize("regime", [Regime.PINNED, Regime.FLIGHT])
def test_order_of_convergence(
    method: RungeKutta, nominal: float, counts: tuple[int, ...], regime: Regime
) -> None:
    if regime is Regime.PINNED:
        folded = -1.1 if method is RungeKutta.RK45 else -0.9
        start, seconds, motor = standing(MODEL, (folded, 0.7), pinned=True), 0.64, MOTOR
    else:
        start = flying(MODEL, (-0.7, 0.65), (1.0, 2.0), (0.0, 9.0), (0.0, 0.0))
        seconds, motor = 0.32, (-0.6, 0.6)
    fine = Accuracy(rtol=1e-13, atol=1e-15, max_step=5e-4)
    exact = HybridLeg(MODEL, fine).advance(start, seconds, motor)[0]
    errors = []
    for count in counts:
        step = seconds / count * (1.0 + 1e-12)
        accuracy = Accuracy(method=method, fixed_step=step, max_step=1.0)
        end = HybridLeg(MODEL, accuracy).advance(start, seconds, motor)[0]
        errors.append(np.max(np.abs(np.subtract(end.q + end.v, exact.q + exact.v))))
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert abs(slope - nominal) < 0.2


def test_stops_hold_the_knee_and_take_its_energy() -> None:
    leg = load_design(MODELS / "prototype.toml")
    model = LegModel.of(leg, undamped=True)
    start = flying(model, (-0.4, 0.4), (5.0, -5.0), (0.0, 2.0), (0.0, 0.0))
    hybrid, state, deepest = HybridLeg(model), start, 1.0
    left = [energy(model, start, (-0.2, 0.2))]
    for tick in range(1, 61):
        state, _ = hybrid.advance(state, 0.001 * tick, (-0.2, 0.2))
        deepest = min(deepest, state.q[1] - state.q[0])
        left.append(energy(model, state, (-0.2, 0.2)))
    assert 0.05 < deepest < leg.limits.knee[0]
    assert np.max(np.diff(left)) < 1e-9
    assert left[-1] < left[0] - 0.03


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_a_stopped_joint_comes_back_at_the_acceleration_that_the_law_gives(angle: float) -> None:
    """`(1 - d) a0 + d (b dp/dt + k p)`, and never a pull."""
    leg = load_design(MODELS / "prototype.toml")
    model, free = LegModel.of(leg), LegModel.of(leg, stops=False)
    rng = np.random.default_rng(9)
    acting = 0
    for _ in range(200):
        half = 0.5 * (leg.limits.knee[0] - rng.uniform(0.0, 0.2))
        q, v = (angle - half, angle + half), tuple(rng.uniform(-5.0, 5.0, 2).tolist())
        motor = tuple(rng.uniform(-1.0, 1.0, 2).tolist())
        depth, speed = leg.limits.knee[0] - 2.0 * half, v[0] - v[1]
        a1, a2 = model.hanging_acceleration(motor, q, v)
        b1, b2 = free.hanging_acceleration(motor, q, v)
        wanted = 0.05 * (b2 - b1) + 2.0 * speed / 0.01 + depth / 0.01**2
        assert a2 - a1 == pytest.approx(max(wanted, b2 - b1), rel=1e-9)
        acting += wanted > b2 - b1
    assert 50 < acting < 190


def test_a_runaway_is_a_fault_and_not_a_traceback() -> None:
    start = standing(MODEL, (-0.6, 0.6), (1e200, -1e200), pinned=True)
    with pytest.raises(PlantFault, match="integration failed at t ="):
        HybridLeg(MODEL).advance(start, 1.0, MOTOR)


def test_accuracy_refuses_a_tolerance_of_zero() -> None:
    with pytest.raises(ConfigError, match="rtol is 0; it must be positive"):
        Accuracy(rtol=0.0)
