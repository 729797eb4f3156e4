"""Data and assumptions that are wrong are named, or the estimates are marked; none passes."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from twins import OFF, PROTOTYPE, experiments, frozen, late, stretched, task, trials

from legbench.analytic.terms import Bars
from legbench.control import ChirpConfig
from legbench.design.setup import SetupKind
from legbench.identify import identify
from legbench.identify.alternatives import named
from legbench.identify.checks import check_data
from legbench.identify.trial import FitTrial
from legbench.mjcf.fitting import fitted_bar_density

Harm = Callable[[FitTrial], FitTrial]


@pytest.mark.parametrize(
    ("harm", "what", "words"),
    [
        (lambda t: t.with_links(t.joint_pos[:, ::-1]), "swapped", "link encoders swapped"),
        (
            lambda t: t.with_links(t.joint_pos * [-1.0, 1.0]),
            "sign",
            "link encoder 1 with the wrong sign",
        ),
        (
            lambda t: replace(t, motor_pos=t.motor_pos * [1.0, -1.0]),
            "sign",
            "motor encoder 2 with the wrong sign",
        ),
        (lambda t: frozen(t, 0, 300), "frozen", "link encoder 1 stands still from 0.300 to 0.599"),
    ],
)
def test_encoders_that_are_wired_wrongly_or_stand_still_are_named_before_any_fit(
    steps: tuple[FitTrial, ...], harm: Harm, what: str, words: str
) -> None:
    outcome = identify(task([*steps[:2], harm(steps[2])]))
    assert not outcome.trusted
    assert outcome.estimates == ()
    assert any(what in each.what and words in each.text for each in outcome.findings)
    assert {each.run for each in outcome.findings} == {"ffs"}


@pytest.mark.parametrize(
    ("harm", "name", "value"),
    [
        (lambda t: late(t, 3), "delay", 3e-3),
        pytest.param(lambda t: stretched(t, 1.01), "time_base", 1.01, marks=pytest.mark.long),
    ],
)
def test_a_delay_and_a_stretched_time_are_told_apart(
    steps: tuple[FitTrial, ...], harm: Harm, name: str, value: float
) -> None:
    outcome = identify(task([harm(each) for each in steps[1:]]))
    assert not outcome.trusted
    best = outcome.alternatives[0]
    assert best.name == name
    assert best.value == pytest.approx(value, rel=0.05 if name == "delay" else 2e-3)
    assert best in named(outcome.alternatives)
    assert any(f"something that was held is wrong: {name}" in each for each in outcome.reasons)


@pytest.mark.long
@pytest.mark.parametrize(("segment", "name"), [("thigh", "J1"), ("shank", "J2")])
def test_a_fixed_inertia_that_is_five_percent_wrong_is_named(
    steps: tuple[FitTrial, ...], segment: str, name: str
) -> None:
    right = getattr(OFF, segment)
    wrong = replace(OFF, **{segment: replace(right, inertia=1.05 * right.inertia)})
    outcome = identify(task(steps, wrong))
    assert not outcome.trusted
    assert name in [each.name for each in named(outcome.alternatives)]


def test_bars_that_were_left_out_are_not_accepted(steps_of_bars: tuple[FitTrial, ...]) -> None:
    outcome = identify(task(steps_of_bars))
    assert not outcome.trusted
    assert any("residuals hang together" in each for each in outcome.reasons)
    best = outcome.alternatives[0]
    assert best.name == "bars"
    assert best.value == fitted_bar_density(PROTOTYPE)
    assert best.share > 0.9
    assert any(f"wrong: bars of {best.value:.3g} kg/m explain" in each for each in outcome.reasons)


def test_bars_that_are_not_there_are_named(steps: tuple[FitTrial, ...]) -> None:
    outcome = identify(task(steps[1:], bars=Bars(density=fitted_bar_density(PROTOTYPE))))
    assert outcome.alternatives[0].text.startswith("bars without mass explain ")
    assert outcome.alternatives[0].share > 0.9


@pytest.mark.long
def test_a_held_out_run_judges_the_fit(steps: tuple[FitTrial, ...]) -> None:
    chirp = trials(
        experiments(
            kinds=(SetupKind.FFS,), controller=ChirpConfig(delay=0.05, sweep=0.4), duration=0.5
        )
    )
    good = identify(task(steps, held_out=chirp))
    assert good.trusted, good.reasons
    wrong = tuple(late(each, 5) for each in chirp)
    bad = identify(task(steps, held_out=wrong))
    assert [each for each in bad.reasons if "held-out run is not predicted" in each]


def test_time_that_is_stretched_in_the_rows_or_has_gaps_is_named(
    steps: tuple[FitTrial, ...],
) -> None:
    slow = replace(steps[0], time=1.01 * steps[0].time)
    (found,) = check_data(slow, OFF.limits)
    assert found.what == "time_base"
    assert "time is stretched by +1 %" in found.text
    kept = np.delete(np.arange(len(steps[0].time)), slice(400, 410))
    gap = replace(
        steps[0],
        time=steps[0].time[kept],
        motor_pos=steps[0].motor_pos[kept],
        joint_pos=steps[0].joint_pos[kept],
        applied_pos=steps[0].applied_pos[kept],
    )
    (found,) = check_data(gap, OFF.limits)
    assert (found.what, found.hopeless) == ("gap", False)
    assert "1 gaps of up to 11 ms, the first at 0.399 s" in found.text


def test_a_joint_at_its_stop_and_a_motor_that_does_not_follow_are_named(
    steps: tuple[FitTrial, ...],
) -> None:
    limits = replace(OFF.limits, knee=(0.3, 1.7))
    (found,) = check_data(steps[0], limits)
    assert found.what == "stop"
    assert "the knee touches its stop" in found.text
    still = replace(
        steps[0],
        motor_pos=np.tile(steps[0].motor_pos[0], (len(steps[0].time), 1)),
        applied_pos=steps[0].applied_pos + 0.05 * np.sin(20.0 * steps[0].time)[:, np.newaxis],
    )
    found = check_data(still, OFF.limits)
    assert [each.what for each in found] == ["frozen", "frozen"]
    assert "motor encoder 1 stands still" in found[0].text


@pytest.mark.parametrize("setup", [0, 2])
def test_clean_data_raise_no_finding(steps: tuple[FitTrial, ...], setup: int) -> None:
    assert check_data(steps[setup], OFF.limits) == []
