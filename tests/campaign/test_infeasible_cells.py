"""Cells that the leg cannot do: found before anything runs, with the nearest that it could."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from campaigns import BASE, MODELS, planned

from legbench.campaign import load_campaign, plan_campaign
from legbench.campaign.feasible import nearest_feasible
from legbench.design import load_design
from legbench.errors import CampaignError

STEEP = BASE + "[grid]\n'controller.settings.z2' = [1.0, 1.8]\n'controller.settings.dz2' = [0.3]\n"
KNEE = load_design(MODELS / "prototype.toml").limits.knee
"""Range of the knee q2 - q1, which is sqrt(2) z2 on the radial mode [rad]."""


def test_the_knee_past_its_stop_is_refused_with_the_nearest_feasible(tmp_path: Path) -> None:
    with pytest.raises(CampaignError) as refused:
        planned(tmp_path, STEEP)
    message = str(refused.value)
    assert message.startswith("1 cells cannot be done: cells: set point z2 + dz2 = 2.1 rad")
    assert "puts the knee at 2.970 rad; design 'prototype' allows 0.3 to 2.9 rad" in message
    assert 'change them, exclude them, or say infeasible = "skip"' in message
    largest = KNEE[1] / math.sqrt(2.0)
    told = math.floor(1e4 * (largest - 1.8)) * 1e-4, math.floor(1e4 * (largest - 0.3)) * 1e-4
    assert f"controller.settings.dz2 = {told[0]:g} or controller.settings.z2 = {told[1]:g}" in (
        message
    )


def test_what_is_told_as_nearest_can_be_run_and_a_little_more_cannot(tmp_path: Path) -> None:
    plan = planned(tmp_path, 'infeasible = "skip"\n' + STEEP)
    assert len(plan.planned) == 1
    (left_out,) = plan.infeasible
    for key, value in left_out.nearest.items():
        told = dict(left_out.settings) | {key: value}
        for change, fits in ((0.0, True), (2e-4, False)):
            text = STEEP.replace("[1.0, 1.8]", f"[{told['controller.settings.z2'] + change}]")
            text = text.replace("[0.3]", f"[{told['controller.settings.dz2']}]")
            if fits:
                assert len(planned(tmp_path, text).planned) == 1
            else:
                with pytest.raises(CampaignError, match="cannot be done"):
                    planned(tmp_path, text)


def test_the_sign_of_the_deflection_counts(tmp_path: Path) -> None:
    plan = planned(tmp_path, STEEP.replace("[0.3]", "[-0.3]"))
    assert len(plan.planned) == 2


def test_what_the_controller_itself_refuses_is_found_too(tmp_path: Path) -> None:
    text = STEEP.replace('"position-jump"', '"bang-bang"').replace("[0.3]", "[0.02]")
    with pytest.raises(CampaignError) as refused:
        planned(tmp_path, text)
    assert "must be positive and stay below k dz2 = 0.046 N m" in str(refused.value)
    # k dz2 must exceed the threshold of 0.05 N m: dz2 = 0.05 / 2.3.
    assert f"dz2 = {math.ceil(1e4 * 0.05 / 2.3) * 1e-4:g}" in str(refused.value)


def test_nothing_left_is_refused(tmp_path: Path) -> None:
    text = 'infeasible = "skip"\n' + STEEP.replace("[1.0, 1.8]", "[1.8]")
    with pytest.raises(CampaignError, match="nothing is left to run"):
        planned(tmp_path, text)


@pytest.mark.parametrize("border", [-3.0, 0.99, 1.00005, 1.5, 7.0])
def test_the_nearest_value_lies_at_the_border(border: float) -> None:
    above = border > 1.0
    found = nearest_feasible(1.0, lambda value: value >= border if above else value <= border)
    assert found is not None
    assert abs(found - border) < 1e-4
    assert found >= border if above else found <= border


def test_nothing_near_is_feasible() -> None:
    assert nearest_feasible(1.0, lambda value: False) is None


def test_the_paper_can_be_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every cell of the paper begins; over 280 runs; the settings that its text names are there."""
    monkeypatch.chdir(tmp_path)
    campaign = load_campaign("models/campaigns/paper.toml")
    plan = plan_campaign(campaign)
    assert len(plan.planned) == 294
    assert plan.infeasible == ()
    told = {
        (each.experiment.controller.kind, each.experiment.setup.kind.value): set()
        for each in plan.planned
    }
    for each in plan.planned:
        settings = plan.settings[each.hash]
        pair = settings["controller.settings.z2"], settings["controller.settings.dz2"]
        told[each.experiment.controller.kind, each.experiment.setup.kind.value].add(pair)
    assert {(1.4, 0.3), (1.0, -0.3)} <= told["position-jump", "ffs"]
    assert (1.24, 0.077) in told["bang-bang", "ffs"]
    assert told["jump", "jump"] == {(0.8, 0.28)}
    for setup in ("hfts", "vfts", "ffs"):
        for kind in ("position-jump", "bang-bang"):
            assert {z2 for z2, _ in told[kind, setup]} >= {1.0, 1.8}
    trials = [each.trial for each in plan.planned if each.block == "step, fixed trunk"]
    assert max(trials) == 9
    beyond = replace(campaign, blocks=campaign.blocks[1:2], excluded=())
    with pytest.raises(CampaignError, match=r"puts the knee at 2\.970 rad"):
        plan_campaign(beyond)
