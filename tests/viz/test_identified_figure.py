import numpy as np
import pytest

from legbench.design import LegDesign
from legbench.design.setup import SetupKind
from legbench.identify.adequacy import ROWS, residuals_of
from legbench.identify.base import LegParameters
from legbench.identify.candidates import PERIOD
from legbench.identify.noise import Precision
from legbench.identify.outcome import Estimate, Identification
from legbench.identify.parameters import Freedom
from legbench.identify.prediction import Guess, nothing_moved
from legbench.identify.problem import Problem
from legbench.identify.staged import IdentificationTask
from legbench.identify.trial import FitTrial

pytest.importorskip("matplotlib")
from legbench.viz.print.identified import identified_figure


def test_intervals_and_residuals_are_drawn_as_they_are(prototype: LegDesign) -> None:
    rows = 10 * ROWS
    motors = np.tile([-0.7, 0.7], (rows, 1))
    fine = Precision(sigma=1e-3, count=0.0)
    shown = motors + 1e-3 * np.random.default_rng(0).standard_normal(motors.shape)
    trial = FitTrial(
        name="run",
        setup=SetupKind.HFTS,
        time=PERIOD * np.arange(rows, dtype=np.float64),
        motor_pos=motors,
        joint_pos=shown,
        applied_pos=motors,
        period=PERIOD,
        links=(fine, fine),
        motors=(fine, fine),
    )
    leg = LegParameters.of(prototype)
    problem = Problem([trial], leg.reach, Freedom(names=("k1",)))
    misfit = problem.misfit(Guess(values=leg.values, starts=nothing_moved([trial])))
    k1 = Estimate(
        name="k1", unit="", value=2.4, before=2.0, error=0.1, white_error=0.1, low=2.2, high=2.6
    )
    outcome = Identification(
        runs=("run",),
        findings=(),
        estimates=(k1,),
        values=leg.values,
        misfit=misfit,
        residuals=tuple(residuals_of(misfit, [trial])),
    )
    figure = identified_figure(IdentificationTask(design=prototype, trials=(trial,)), outcome)
    intervals, left = figure.axes
    assert [text.get_text() for text in intervals.get_xticklabels()] == ["k1"]
    assert intervals.lines[0].get_ydata() == pytest.approx([10.0, 30.0])
    assert intervals.lines[1].get_ydata() == pytest.approx([20.0])
    means = 1e6 * (shown - motors)[:, 0].reshape(10, ROWS).mean(axis=1)
    assert left.lines[0].get_ydata() == pytest.approx(means, abs=1.0)
    assert figure.get_suptitle() == "prototype: trusted"
