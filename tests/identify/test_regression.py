"""A regression finds all linear parameters about right, wherever it begins."""

from dataclasses import replace

import numpy as np
import pytest
from twins import PROTOTYPE

from legbench.identify.base import LegParameters, mended
from legbench.identify.fitting import fit
from legbench.identify.parameters import GROUPS, INDEX, Freedom
from legbench.identify.prediction import Guess, nothing_moved
from legbench.identify.problem import Problem
from legbench.identify.regression import regressed
from legbench.identify.staged import fits_from
from legbench.identify.trial import FitTrial

TRUTH = LegParameters.of(PROTOTYPE)
NINE = GROUPS["nine"]
PLACES = [INDEX[name] for name in NINE]


def far(steps: tuple[FitTrial, ...], seed: int) -> Guess:
    """Guess whose nine parameters are 0.4 to 3 times the truth, mended to be those of a leg."""
    values = TRUTH.values.copy()
    random = np.random.default_rng(seed)
    values[PLACES] *= np.exp(random.uniform(np.log(0.4), np.log(3.0), len(NINE)))
    return Guess(values=mended(values, TRUTH.reach), starts=nothing_moved(steps))


def test_nine_parameters_come_near_the_truth_from_any_start(steps: tuple[FitTrial, ...]) -> None:
    first, second = (
        regressed(steps, far(steps, seed), Freedom(names=NINE), TRUTH.reach) for seed in (1, 2)
    )
    assert first is not None
    assert second is not None
    assert first.values == pytest.approx(second.values, rel=1e-6)
    share = dict(zip(NINE, first.values[PLACES] / TRUTH.values[PLACES], strict=True))
    assert share.pop("B") == pytest.approx(1.0, abs=0.2)
    assert share == pytest.approx(dict.fromkeys(share, 1.0), abs=0.06)
    assert [share["k1"], share["k2"]] == pytest.approx([1.0, 1.0], abs=3e-3)


def test_what_is_not_free_stays_as_it_is(steps: tuple[FitTrial, ...]) -> None:
    start = far(steps, 1).at("J1", 2.0e-3)
    found = regressed(steps, start, Freedom(names=("d1", "f1", "delay")), TRUTH.reach)
    assert found is not None
    changed = np.flatnonzero(found.values != start.values).tolist()
    assert changed == [INDEX["d1"], INDEX["f1"]]


def test_no_regression_without_a_linear_parameter_or_with_short_runs(
    steps: tuple[FitTrial, ...],
) -> None:
    start = far(steps, 1)
    assert regressed(steps, start, Freedom(names=("delay",)), TRUTH.reach) is None
    short = [
        replace(
            each,
            time=each.time[:100],
            motor_pos=each.motor_pos[:100],
            joint_pos=each.joint_pos[:100],
        )
        for each in steps
    ]
    assert regressed(short, start, Freedom(names=NINE), TRUTH.reach) is None


def test_a_start_from_which_a_fit_is_lost_is_mended_by_the_next(
    steps: tuple[FitTrial, ...],
) -> None:
    problem, start = Problem(steps, TRUTH.reach, Freedom(names=NINE)), far(steps, 11)
    bottom = problem.misfit(Guess(values=TRUTH.values, starts=nothing_moved(steps))).cost
    assert fit(problem, start).misfit.cost > 1e3 * bottom
    assert fits_from(problem, start, 2)[1].misfit.cost <= bottom
