"""Paths of legs whose motors move, against the batch of held legs and finite differences."""

from dataclasses import replace

import numpy as np
import pytest

from legbench.analytic import LegModel
from legbench.analytic.compiled import parameters_of, sensitive_seeds
from legbench.analytic.leg_batch import LegBatch
from legbench.analytic.parameters import FRICTION, MOTOR, SHARPNESS, SMOOTH
from legbench.analytic.sensitivity import STATES, SensitiveLegs, Track
from legbench.analytic.state import Regime
from legbench.design import LegDesign
from legbench.errors import PlantFault
from legbench.signals import Floats

TIMES = np.arange(0.0, 0.3005, 1e-3)


def track(design: LegDesign, regime: Regime = Regime.PINNED, lift: float = 0.2) -> Track:
    """Motors stand, run for fifty cycles, and stand again."""
    parameters = np.zeros(SHARPNESS + 1)
    parameters[:SMOOTH] = parameters_of(LegModel.of(design), regime, (0.0, 0.0))[:SMOOTH]
    parameters[FRICTION : FRICTION + 2], parameters[SHARPNESS] = (0.002, 0.003), 20.0
    share = np.clip((TIMES[:-1] - 0.1) / 0.05, 0.0, 1.0)
    motors = np.array([-0.7, 0.7]) + lift * np.stack([share, -0.5 * share], axis=1)
    start = np.array([-0.75, 0.8, 0.1, -0.2])
    return Track(times=TIMES, motors=motors, start=start, parameters=parameters)


@pytest.mark.parametrize("regime", [Regime.PINNED, Regime.HANGING])
def test_paths_are_those_of_legs_that_are_held_side_by_side(
    prototype: LegDesign, regime: Regime
) -> None:
    mine = track(prototype, regime)
    path = SensitiveLegs(friction=False).follow([mine])[0]
    lanes = LegBatch([LegModel.of(prototype)], regime)
    lanes.start(mine.start[np.newaxis])
    for row, motors in enumerate(mine.motors, start=1):
        states = lanes.go(float(TIMES[row]), motors[np.newaxis])
        assert path.states[row] == pytest.approx(states[0], abs=1e-8)


@pytest.mark.parametrize("friction", [False, True])
def test_slopes_are_those_of_finite_differences(prototype: LegDesign, friction: bool) -> None:
    mine = track(prototype)
    legs = SensitiveLegs(friction=friction)
    slopes = legs.follow([mine])[0].slopes
    assert slopes.shape == (len(TIMES), 2, STATES + len(sensitive_seeds(friction=friction)))
    for seed in range(slopes.shape[-1]):
        both = []
        for sign in (1.0, -1.0):
            both.append(moved(mine, seed, sign * 1e-6))
        plus, minus = legs.follow(both)
        found = (plus.states - minus.states)[:, :2] / 2e-6
        size = np.abs(found).max()
        assert slopes[:, :, seed] == pytest.approx(found, abs=2e-4 * size, rel=2e-4)


def test_restarts_change_no_slope_and_tell_those_since_them(prototype: LegDesign) -> None:
    mine = track(prototype)
    legs = SensitiveLegs(friction=False)
    (plain,) = legs.follow([mine])
    path, shorter = legs.follow(
        [
            replace(mine, restarts=(120, 250)),
            replace(mine, times=TIMES[:200], motors=mine.motors[:199]),
        ]
    )
    assert path.restarts == (120, 250)
    assert shorter.restarts == (120,)  # those of a leg beside it
    for each in (path, shorter):
        rows = len(each.states)
        assert each.states == pytest.approx(plain.states[:rows], abs=1e-9)
        assert each.slopes == pytest.approx(plain.slopes[:rows], abs=1e-6)
    (late,) = legs.follow(
        [replace(mine, times=TIMES[120:251], motors=mine.motors[120:250], start=path.states[120])]
    )
    assert path.pieces[121:251] == pytest.approx(late.pieces[1:], abs=1e-6)


def moved(mine: Track, seed: int, amount: float) -> Track:
    """Track with one state, parameter or motor moved by an amount."""
    start, parameters, motors = mine.start.copy(), mine.parameters.copy(), mine.motors.copy()
    place = seed - STATES
    if place < 0:
        start[seed] += amount
    elif place in (MOTOR, MOTOR + 1):
        motors[:, place - MOTOR] += amount
    else:
        parameters[place] += amount
    return replace(mine, start=start, parameters=parameters, motors=motors)


def test_tracks_of_several_lengths_in_several_batches_are_as_alone(prototype: LegDesign) -> None:
    whole = track(prototype)
    tracks = [
        replace(whole, times=TIMES[:rows], motors=whole.motors[: rows - 1])
        for rows in (301, 20, 150, 301, 77)
    ]
    legs = SensitiveLegs(friction=False)
    together = legs.follow(tracks)
    for one, found in zip(tracks, together, strict=True):
        alone = SensitiveLegs(friction=False).follow([one])[0]
        assert len(found.states) == len(one.times)
        assert found.states == pytest.approx(alone.states, abs=1e-9)
        scale = np.abs(alone.slopes).max(axis=(0, 1))
        assert np.all(np.abs(found.slopes - alone.slopes) <= 1e-6 * scale)


def test_a_leg_that_runs_away_is_refused(prototype: LegDesign) -> None:
    mine = track(prototype)
    wild: Floats = mine.parameters.copy()
    wild[7:9] = -10.0  # dampers that push
    with pytest.raises(PlantFault, match=r"integration failed after t = .*: a leg runs away"):
        SensitiveLegs(friction=False).follow([replace(mine, parameters=wild)])
