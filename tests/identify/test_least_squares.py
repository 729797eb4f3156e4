"""A leg that is known is found again, with intervals that say how well."""

from dataclasses import replace

import numpy as np
import pytest
from twins import OFF, PROTOTYPE, experiments, task, trials

from legbench.analytic.terms import Bars
from legbench.design.setup import SetupKind
from legbench.identify import identify, parse_free
from legbench.identify.base import LegParameters, can_be, mended
from legbench.identify.fitting import fit
from legbench.identify.parameters import GROUPS, INDEX, Freedom
from legbench.identify.prediction import Guess, nothing_moved
from legbench.identify.problem import Problem
from legbench.identify.trial import FitTrial
from legbench.mjcf.fitting import fitted_bar_density


def test_springs_and_dampers_that_are_thirty_percent_off_are_found(
    steps: tuple[FitTrial, ...],
) -> None:
    outcome = identify(task(steps))
    assert outcome.trusted, outcome.reasons
    truth = LegParameters.of(PROTOTYPE)
    for each in outcome.estimates:
        true = truth.values[INDEX[each.name]]
        assert each.low <= true <= each.high
        assert each.value == pytest.approx(true, rel=2e-4 if each.name[0] == "k" else 4e-3)


@pytest.mark.long
def test_nine_parameters_of_a_leg_that_was_built_otherwise_are_found() -> None:
    flaws = {
        "stiffness_error": (0.04, -0.03),
        "damping_error": (0.2, -0.1),
        "com_error": (0.003, 0.0, -0.002),
        "inertia_error": (0.05, -0.04, 0.02),
    }
    chosen = experiments(**flaws)
    built = chosen[0].imperfections.leg_of(PROTOTYPE)
    outcome = identify(task(trials(chosen), PROTOTYPE, free=parse_free(["nine"])))
    assert outcome.trusted, outcome.reasons
    truth = LegParameters.of(built)
    for each in outcome.estimates:
        true = truth.values[INDEX[each.name]]
        assert abs(each.value - true) < 4.0 * each.error
        assert each.error < 0.02 * true


@pytest.mark.long
def test_a_leg_with_bars_is_found_by_equations_with_bars(
    steps_of_bars: tuple[FitTrial, ...],
) -> None:
    bars = Bars(density=fitted_bar_density(PROTOTYPE))
    outcome = identify(task(steps_of_bars, bars=bars))
    assert outcome.trusted, outcome.reasons
    for each in outcome.estimates:
        true = LegParameters.of(PROTOTYPE).values[INDEX[each.name]]
        assert abs(each.value - true) < 4.0 * each.error


@pytest.mark.long
def test_a_run_that_begins_in_motion_is_fitted_from_its_first_row_on(
    steps: tuple[FitTrial, ...],
) -> None:
    cut = tuple(
        replace(
            each,
            time=each.time[120:],
            motor_pos=each.motor_pos[120:],
            joint_pos=each.joint_pos[120:],
            applied_pos=each.applied_pos[120:],
            moving=True,
        )
        for each in steps
    )
    outcome = identify(task(cut))
    assert outcome.trusted, outcome.reasons
    assert outcome.estimate("k1").value == pytest.approx(2.3, rel=5e-4)


@pytest.mark.parametrize("names", [("k1", "k2", "d1", "d2"), GROUPS["nine"]])
def test_fits_converge_from_far_away(steps: tuple[FitTrial, ...], names: tuple[str, ...]) -> None:
    """Starts of 0.4 to 3 times the truth, mixed, mended where no leg has such inertias."""
    random = np.random.default_rng(5)
    truth = LegParameters.of(PROTOTYPE)
    problem = Problem(steps, truth.reach, Freedom(names=names))
    bottom = problem.misfit(Guess(values=truth.values, starts=nothing_moved(steps))).cost
    for _ in range(3):
        values = truth.values.copy()
        values[[INDEX[name] for name in names]] *= np.exp(
            random.uniform(np.log(0.4), np.log(3.0), len(names))
        )
        values = mended(values, truth.reach)
        assert can_be(values, truth.reach)
        found = fit(problem, Guess(values=values, starts=nothing_moved(steps)))
        assert found.converged
        assert found.misfit.cost <= bottom


def test_predicted_errors_are_those_that_noise_makes(steps: tuple[FitTrial, ...]) -> None:
    """Estimates of many noises scatter as the Jacobian says, within the chance of 25 draws."""
    truth = LegParameters.of(PROTOTYPE)
    names = ("k1", "k2", "d1", "d2")
    guess = Guess(values=truth.values, starts=nothing_moved(steps))
    problem = Problem(steps, truth.reach, Freedom(names=names))
    misfit = problem.misfit(guess)
    matrix, _ = misfit.normal()
    clean = [
        trial.joint_pos - residual * trial.sigma
        for trial, residual in zip(steps, misfit.residuals, strict=True)
    ]
    random, found = np.random.default_rng(6), []
    for _ in range(25):
        runs = [
            trial.with_links(links + trial.sigma * random.standard_normal(links.shape))
            for trial, links in zip(steps, clean, strict=True)
        ]
        ended = fit(Problem(runs, truth.reach, Freedom(names=names)), guess, (None,)).misfit
        found.append(np.log(ended.guess.values[[INDEX[name] for name in names]]))
    ratio = np.std(found, axis=0, ddof=1) / np.sqrt(np.diag(np.linalg.inv(matrix)))[: len(names)]
    # One standard deviation of a standard deviation of 25 draws is 14 %.
    assert np.all(np.abs(ratio - 1.0) < 0.5)


@pytest.mark.long
def test_friction_is_found_where_there_is_some() -> None:
    chosen = experiments(kinds=(SetupKind.VFTS, SetupKind.FFS), coulomb_friction=(0.004, 0.003))
    outcome = identify(task(trials(chosen), free=parse_free(["springs", "dampers", "friction"])))
    assert outcome.estimate("f1").value == pytest.approx(0.004, rel=0.1)
    assert outcome.estimate("f2").value == pytest.approx(0.003, rel=0.1)
    assert OFF.stiffness != PROTOTYPE.stiffness
    assert outcome.estimate("k1").value == pytest.approx(2.3, rel=2e-3)
