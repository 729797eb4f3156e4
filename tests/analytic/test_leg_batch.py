"""Legs side by side against legs one by one, differences, and the interpreted plant."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from legbench.analytic import HybridLeg, LegModel, LegState, Regime, standing
from legbench.analytic.smooth import Accuracy
from legbench.design import LegDesign, load_design
from legbench.errors import ConfigError, PlantFault

pytest.importorskip("heyoka")

from legbench.analytic.leg_batch import Friction, LegBatch
from legbench.analytic.losses import Losses
from legbench.analytic.many import ManyLegs, motion
from legbench.analytic.parameters import COUPLING, DAMPING, INERTIA, MOMENT, STIFFNESS

PROTOTYPE = load_design(Path(__file__).parents[2] / "models" / "prototype.toml")
FINE = Accuracy(rtol=1e-12, atol=1e-14)
COUNT = 11
"""More than a block, and no multiple of any block."""


def some_legs(*, gravity: float = 9.81) -> list[LegModel]:
    random = np.random.default_rng(5)

    def scaled(design: LegDesign) -> LegDesign:
        k1, k2, more = (float(x) for x in random.uniform(0.97, 1.03, 3))
        stiffness = (k1 * design.stiffness[0], k2 * design.stiffness[1])
        return replace(design, stiffness=stiffness, trunk_mass=more * design.trunk_mass)

    return [LegModel.of(scaled(PROTOTYPE), gravity=gravity) for _ in range(COUNT)]


def some_motors() -> np.ndarray:
    random = np.random.default_rng(6)
    return np.array([-0.6, 0.6]) + random.uniform(-0.05, 0.05, (COUNT, 2))


STARTS = np.tile([-0.75, 0.7, 0.0, 0.0], (COUNT, 1))


def hanging(q: tuple[float, float]) -> LegState:
    still = (0.0, 0.0)
    return LegState(0.0, Regime.HANGING, q, still, (0.0, 0.3), still)


@pytest.mark.parametrize("regime", [Regime.PINNED, Regime.HANGING])
def test_each_leg_moves_as_if_it_were_alone(regime: Regime) -> None:
    models, motors = some_legs(), some_motors()
    lanes = LegBatch(models, regime)
    lanes.start(STARTS)
    found = STARTS
    for tick in range(1, 301):
        commands = motors + 0.05 * np.sin(0.05 * tick)
        found = lanes.go(0.001 * tick, commands)
    for index in (0, 7, 10):
        leg, q = HybridLeg(models[index], FINE), (-0.75, 0.7)
        state = standing(models[index], q, pinned=True) if regime.stands else hanging(q)
        for tick in range(1, 301):
            motor = motors[index] + 0.05 * np.sin(0.05 * tick)
            state, _ = leg.advance(state, 0.001 * tick, (float(motor[0]), float(motor[1])))
        assert np.allclose(found[index], state.q + state.v, rtol=0.0, atol=1e-9)
    assert not lanes.outside.any()


def test_a_path_is_what_its_ends_are() -> None:
    models, motors = some_legs(gravity=0.0), some_motors()
    lanes, times = LegBatch(models, Regime.HANGING, workers=2), np.linspace(0.0, 0.5, 6)
    lanes.start(STARTS)
    path = lanes.path(times, motors)
    assert path.shape == (COUNT, 6, 4)
    assert np.allclose(path[:, 0], STARTS, rtol=0.0, atol=1e-15)
    lanes.start(STARTS)
    for index, time in enumerate(times[1:], start=1):
        assert np.allclose(lanes.go(float(time), motors), path[:, index], rtol=0.0, atol=1e-12)


def changed(model: LegModel, place: int, size: float) -> LegModel:
    """A standing leg one of whose nine parameters is larger."""
    if place >= DAMPING:
        first, second = model.damping
        damping = (first + size, second) if place == DAMPING else (first, second + size)
        return replace(model, damping=damping)
    if place >= STIFFNESS:
        first, second = model.stiffness
        stiffness = (first + size, second) if place == STIFFNESS else (first, second + size)
        return replace(model, stiffness=stiffness)
    terms = model.stance
    if place == COUPLING:
        return replace(model, stance=replace(terms, coupling=terms.coupling + size))
    name, begin = ("moment", MOMENT) if place >= MOMENT else ("inertia", INERTIA)
    one = [*getattr(terms, name)]
    one[place - begin] += size
    more: dict[str, Any] = {name: tuple(one)}
    return replace(model, stance=replace(terms, **more))


@pytest.mark.parametrize("rubbing", [False, True])
def test_derivatives_by_the_parameters_are_differences(rubbing: bool) -> None:
    model, motors = LegModel.of(PROTOTYPE), np.array([[-0.7, 0.65]])
    friction = [Friction(torque=(0.02, 0.01))] if rubbing else None

    def end(leg: LegModel, rub: list[Friction] | None) -> np.ndarray:
        lanes = LegBatch([leg], Regime.PINNED, friction=rub)
        lanes.start(STARTS[:1])
        return lanes.go(0.4, motors)[0]

    lanes = LegBatch([model], Regime.PINNED, friction=friction, derivatives=True)
    lanes.start(STARTS[:1])
    assert np.allclose(lanes.go(0.4, motors)[0], end(model, friction), rtol=0.0, atol=1e-12)
    slopes = lanes.slopes[0]
    assert slopes.shape == (4, 11 if rubbing else 9)
    for place in range(9):
        size = 1e-6 if place >= MOMENT else 1e-8
        ends = [end(changed(model, place, sign * size), friction) for sign in (1.0, -1.0)]
        wanted = (ends[0] - ends[1]) / (2.0 * size)
        assert np.allclose(slopes[:, place], wanted, rtol=1e-5, atol=1e-5 * np.max(np.abs(wanted)))
    for joint in range(2 * rubbing):
        ends = []
        for sign in (1.0, -1.0):
            torque = [0.02, 0.01]
            torque[joint] += sign * 1e-7
            ends.append(end(model, [Friction(torque=(torque[0], torque[1]))]))
        wanted = (ends[0] - ends[1]) / 2e-7
        assert np.allclose(slopes[:, 9 + joint], wanted, rtol=1e-5, atol=1e-5)


def test_friction_takes_energy() -> None:
    models = [LegModel.of(PROTOTYPE, undamped=True)] * 2
    none, some = Friction(torque=(0.0, 0.0)), Friction(torque=(0.05, 0.05))
    lanes = LegBatch(models, Regime.PINNED, friction=[none, some])
    lanes.start(STARTS[:2])
    path = lanes.path(np.linspace(0.0, 1.0, 101), np.array([[-0.7, 0.7]] * 2))
    assert np.ptp(path[1, 50:, 1]) < 0.8 * np.ptp(path[0, 50:, 1])


def test_a_guide_and_play_act_as_on_the_leg_alone() -> None:
    losses = Losses(guide=(0.3, 0.8))
    models = [LegModel.of(PROTOTYPE), LegModel.of(PROTOTYPE, losses=losses)]
    motor, q, count = (-0.42, 0.4), (-0.95, 0.9), 300
    state = standing(models[1], q, pinned=True)
    alone, _ = HybridLeg(models[1], FINE).advance(state, 0.001 * count, motor)
    lanes = LegBatch(models, Regime.PINNED, guide=[(0.0, 0.0), losses.guide])
    lanes.start(np.array([(*q, 0.0, 0.0)] * 2))
    found = lanes.go(0.001 * count, np.array([motor] * 2))
    assert np.allclose(found[1], alone.q + alone.v, rtol=0.0, atol=1e-9)
    assert np.abs(found[0] - found[1]).max() > 0.01

    slack = replace(losses, slack=(0.02, 0.01), friction=(0.003, 0.001))
    model = LegModel.of(PROTOTYPE, losses=slack)
    many = ManyLegs.of([models[0], model], standing=True, step=0.0005)
    *_, last = motion(many, np.array([q] * 2), np.array([motor] * 2), 0.0005, 2 * count)
    alone, _ = HybridLeg(model, FINE).advance(standing(model, q, pinned=True), 0.3, motor)
    assert np.allclose(last[0][1], alone.q, rtol=0.0, atol=2e-5)
    bare, _ = HybridLeg(models[0], FINE).advance(standing(models[0], q, pinned=True), 0.3, motor)
    assert np.allclose(last[0][0], bare.q, rtol=0.0, atol=1e-7)


def test_a_leg_beyond_its_joints_is_named() -> None:
    models = some_legs()
    lanes = LegBatch(models, Regime.HANGING)
    starts = STARTS.copy()
    starts[3, 1] = -0.5
    lanes.start(starts)
    lanes.go(0.001, some_motors())
    assert np.flatnonzero(lanes.outside).tolist() == [3]


def test_bad_lanes_are_refused() -> None:
    with pytest.raises(ConfigError, match="no leg to follow"):
        LegBatch([], Regime.PINNED)
    with pytest.raises(ConfigError, match="cannot be in 'stance', which ends by an event"):
        LegBatch(some_legs(), Regime.STANCE)
    with pytest.raises(ConfigError, match="friction torque is"):
        Friction(torque=(-1.0, 0.0))
    with pytest.raises(ConfigError, match="width is 0 rad/s"):
        Friction(torque=(0.0, 0.0), width=0.0)


def test_a_runaway_is_a_fault() -> None:
    lanes = LegBatch(some_legs(), Regime.PINNED)
    lanes.start(np.tile([-0.8, 0.8, 1e200, -1e200], (COUNT, 1)))
    with pytest.raises(PlantFault, match="a leg runs away"):
        lanes.go(1.0, some_motors())
