"""Eight seconds of hopping with the default settings, both legs, against the task's bounds."""

from pathlib import Path

import pytest

from legbench.control import JumpConfig
from legbench.design import LegDesign
from legbench.experiment import Experiment, record
from legbench.metrics import Summary, summarise
from legbench.recording.reader import load


@pytest.fixture(scope="session")
def hops(
    tmp_path_factory: pytest.TempPathFactory, optimal: LegDesign, prototype: LegDesign
) -> dict[str, Summary]:
    out = tmp_path_factory.mktemp("hops")
    found: dict[str, Summary] = {}
    for design in (optimal, prototype):
        finished = record(Experiment(design=design, controller=JumpConfig()), out)
        assert finished.outcome.status == "complete"
        found[design.name] = summarise(load(finished.path))
    return found


def test_the_optimal_leg_keeps_to_its_mode_in_the_limit_cycle(hops: dict[str, Summary]) -> None:
    summary = hops["optimal"]
    assert summary.duration == pytest.approx(7.999)
    assert summary.jumps >= 10
    assert min(summary.rating_stance) > 0.99
    assert min(summary.rating_flight) > 0.99
    assert summary.polar_max < 0.01


def test_the_prototype_hops_as_the_paper_reports(hops: dict[str, Summary]) -> None:
    summary = hops["prototype"]
    assert summary.jumps >= 10
    assert min(summary.rating_stance) > 0.99
    assert min(summary.rating_flight) > 0.97
    assert 0.03 < summary.foot_clearance < 0.06
    assert 0.07 < summary.trunk_excursion < 0.12


@pytest.mark.parametrize("name", ["optimal", "prototype"])
def test_loops_and_energy_hold_through_every_impact(hops: dict[str, Summary], name: str) -> None:
    assert 0.0 < hops[name].loop_gap_max < 2e-5
    assert hops[name].energy_residual < 1e-3


def test_the_folder_is_named_after_what_ran(hops: dict[str, Summary]) -> None:
    for name, summary in hops.items():
        assert Path(summary.run).name.endswith(f"_jump-{name}")
