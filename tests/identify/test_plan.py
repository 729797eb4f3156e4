"""The next run that is proposed is the one that shrinks the intervals."""

from dataclasses import replace

import pytest
from twins import PROTOTYPE, experiments, task

from legbench.control import ChirpConfig, PositionJumpConfig
from legbench.control.chirp import ChirpCoordinate
from legbench.design.setup import SetupKind
from legbench.errors import ConfigError
from legbench.experiment import Experiment
from legbench.identify import identify, parse_free
from legbench.identify.plan import best_of, plan_lines, ranked
from legbench.identify.staged import IdentificationTask
from legbench.identify.trial import FitTrial
from legbench.imperfections import Imperfections
from legbench.limits.safety import SafetyLimits

STEP = PositionJumpConfig(z2=1.0, dz2=0.3)
CHIRP = ChirpConfig(coordinate=ChirpCoordinate.Q1)


def candidate(controller: PositionJumpConfig | ChirpConfig, duration: float = 3.0) -> Experiment:
    (made,) = experiments(kinds=(SetupKind.VFTS,), controller=controller, duration=duration)
    return replace(made, imperfections=Imperfections())


def nine(steps: tuple[FitTrial, ...]) -> IdentificationTask:
    return task(steps, PROTOTYPE, free=parse_free(["nine"]))


def test_a_chirp_shrinks_the_error_of_the_coupling_and_another_step_hardly_does(
    steps: tuple[FitTrial, ...],
) -> None:
    among = [("step", candidate(STEP)), ("chirp", candidate(CHIRP))]
    first, second = ranked(nine(steps), None, sharpen="B", among=among)
    assert (first.name, second.name) == ("chirp", "step")
    assert first.shrinks["B"] > 8.0
    assert second.shrinks["B"] < 3.0
    assert first.errors["B"] * first.shrinks["B"] == pytest.approx(
        second.errors["B"] * second.shrinks["B"], rel=1e-6
    )
    assert "chirp" in plan_lines([first, second])[1]


@pytest.mark.long
def test_predicted_errors_are_those_of_the_fit_after_the_run(
    steps: tuple[FitTrial, ...],
) -> None:
    """Planning a run like the third after the first two predicts the errors of all three."""
    three = identify(nine(steps))
    like = replace(experiments()[2], duration=0.6)
    two = task(steps[:2], PROTOTYPE, free=parse_free(["nine"]))
    (plan,) = ranked(two, three, among=[("ffs", like)])
    for each in three.estimates:
        # Before, all nine scale together; white errors of positive parameters are shares.
        assert plan.shrinks[each.name] == float("inf")
        error = each.white_error / each.value
        assert plan.errors[each.name] == pytest.approx(error, rel=0.15)


def test_a_run_beyond_the_safety_limits_is_passed_over(steps: tuple[FitTrial, ...]) -> None:
    short = ChirpConfig(coordinate=ChirpCoordinate.Q1, sweep=0.3, delay=0.05)
    calm = replace(short, amplitude=0.003)
    among = [("wild", candidate(short, 0.4)), ("calm", candidate(calm, 0.4))]
    plans = ranked(nine(steps), None, among=among)
    assert plans[0].name == "wild"
    said: list[str] = []
    assert best_of(plans, SafetyLimits(joint_speed=1.0), said.append).name == "calm"
    assert said == ["wild ends early: joint speed"]
    with pytest.raises(ConfigError, match=r"no candidate stays within the limits \(wild: "):
        best_of(plans, SafetyLimits(joint_speed=0.01))
