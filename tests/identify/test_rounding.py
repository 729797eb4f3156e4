"""A motor stands beside what its encoder counts, and a fit finds by how much."""

from dataclasses import replace

import numpy as np
import pytest
from twins import OFF, PROTOTYPE, task

from legbench.identify import identify
from legbench.identify.base import LegParameters
from legbench.identify.noise import Precision
from legbench.identify.outcome import Identification
from legbench.identify.parameters import INDEX, Freedom
from legbench.identify.prediction import Guess, nothing_moved
from legbench.identify.problem import Problem
from legbench.identify.rounding import MOST_STANDS, stretches_of
from legbench.identify.trial import FitTrial
from legbench.signals import Floats

COUNT = 2.0 * np.pi / 2048


def coarse(trial: FitTrial) -> FitTrial:
    """Run whose motors are shown in coarse counts."""
    precision = Precision(sigma=COUNT / np.sqrt(12.0), count=COUNT)
    return replace(
        trial,
        motor_pos=np.round(trial.motor_pos / COUNT) * COUNT,
        motors=(precision, precision),
    )


def standing(trial: FitTrial, motors: Floats) -> FitTrial:
    """Run of as many rows as its motor positions (n, 2), whose links stand still."""
    rows = np.arange(len(motors), dtype=np.float64)
    return replace(
        trial, time=1e-3 * rows, motor_pos=motors, joint_pos=0.0 * motors, applied_pos=motors
    )


@pytest.fixture(scope="module")
def outcome(steps: tuple[FitTrial, ...]) -> Identification:
    """What is learned from steps whose motors are shown in coarse counts."""
    return identify(task([coarse(each) for each in steps]))


def test_stiffness_does_not_suffer_from_coarse_counts_of_the_motors(
    outcome: Identification,
) -> None:
    assert outcome.trusted, outcome.reasons
    truth = LegParameters.of(PROTOTYPE)
    for name in ("k1", "k2"):
        estimate, true = outcome.estimate(name), truth.values[INDEX[name]]
        assert estimate.low <= true <= estimate.high
        assert estimate.value == pytest.approx(true, rel=3e-4)


def test_hidden_angles_that_are_found_are_those_that_rounding_hid(
    steps: tuple[FitTrial, ...], outcome: Identification
) -> None:
    assert outcome.misfit is not None
    found, place = outcome.misfit.guess.hidden, 0
    for trial in steps:
        for each in stretches_of(coarse(trial)):
            motors = trial.motor_pos[each.rows, each.joint]
            hid = motors - np.round(motors / COUNT) * COUNT
            if np.sum(each.rows) > 300:  # long enough to be seen through the noise
                assert each.sigma * found[place] == pytest.approx(hid[0], abs=0.1 * COUNT)
            place += 1
    assert place == len(found) == 12


@pytest.mark.parametrize("delay", [0.0, 2e-3])
def test_derivatives_by_hidden_angles_are_those_of_finite_differences(
    steps: tuple[FitTrial, ...], delay: float
) -> None:
    problem = Problem(
        [coarse(each) for each in steps], LegParameters.of(OFF).reach, Freedom(names=("k1",))
    )
    guess = Guess(values=LegParameters.of(OFF).values, starts=nothing_moved(steps)).at(
        "delay", delay
    )
    misfit = problem.misfit(guess)
    _, slopes = misfit.whole()
    for column in range(len(problem.names), slopes.shape[1]):
        step = np.zeros(slopes.shape[1])
        step[column] = 1.0
        up, down = (
            problem.misfit(problem.stepped(guess, sign * step)).whole()[0] for sign in (1.0, -1.0)
        )
        assert slopes[:, column] == pytest.approx(-(up - down) / 2.0, abs=1e-4)
        assert np.abs(slopes[: -len(misfit.prior), column]).max() > 0.5


def test_each_stand_has_an_angle_of_its_own_and_motion_has_one(
    steps: tuple[FitTrial, ...],
) -> None:
    ramp = np.linspace(0.0, 0.99, 100)
    motors = np.concatenate([np.zeros(60), ramp, np.full(70, 1.0), ramp, np.full(20, 2.0)])
    first, second, rest = stretches_of(
        standing(coarse(steps[0]), np.stack([motors, 0.0 * motors], axis=1))
    )[:3]
    # The ramp's own first row stands, too.
    assert np.flatnonzero(first.rows).tolist() == list(range(61))
    assert np.flatnonzero(second.rows).tolist() == list(range(160, 230))
    assert first.edges == (60,)
    assert second.edges == (159, 229)
    assert np.array_equal(rest.rows, ~(first.rows | second.rows))
    many = np.repeat(np.arange(3 * MOST_STANDS).astype(np.float64), 60)
    both = stretches_of(standing(coarse(steps[0]), np.stack([many, many], axis=1)))
    assert len(both) == 2 * (MOST_STANDS + 1)


def test_a_motor_without_counts_hides_nothing(steps: tuple[FitTrial, ...]) -> None:
    fine = replace(steps[0], motors=(Precision(sigma=1e-4, count=0.0),) * 2)
    assert stretches_of(fine) == ()
