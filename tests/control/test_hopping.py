"""Eight seconds of hopping with the default settings, both legs, against the task's bounds."""

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from legbench.control import JumpConfig
from legbench.control.jump_rules import JumpPhase
from legbench.design import LegDesign
from legbench.experiment import Experiment, record
from legbench.metrics import Summary, summarise
from legbench.metrics.analysis import Analysis
from legbench.mjcf import Linkage, LinkageKind
from legbench.recording.reader import load
from legbench.signals import SIGNALS


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
def test_every_push_is_on_the_ground_and_every_stance_has_one(
    hops: dict[str, Summary], name: str
) -> None:
    run = load(Path(hops[name].run))
    phase, contact = run["phase"], np.asarray(run["contact"], dtype=bool)
    pushes = np.flatnonzero((phase[1:] == JumpPhase.PUSH) & (phase[:-1] != JumpPhase.PUSH)) + 1
    assert np.all(contact[pushes])
    gait = Analysis(run).gait
    begun = [
        np.count_nonzero((first <= pushes) & (pushes < stop))
        for first, stop in zip(gait.stance.first, gait.stance.stop, strict=True)
    ]
    assert len(begun) >= 10
    assert set(begun) == {1}


@pytest.mark.parametrize("name", ["optimal", "prototype"])
def test_a_leg_without_truth_tells_the_same_jumps(hops: dict[str, Summary], name: str) -> None:
    """But for the first, from rest; in the limit cycle stances are the ground's to 20 ms."""
    run = load(Path(hops[name].run))
    truth = {c for s in SIGNALS if "simulation only" in s.doc for c in s.columns}
    columns = {key: column for key, column in run.columns.items() if key not in truth}
    seen, told = Analysis(run).gait, Analysis(replace(run, columns=MappingProxyType(columns))).gait
    assert len(told.jumps) == len(seen.jumps) - 1
    assert np.max(np.abs(told.stance.start[-10:] - seen.stance.start[-10:])) < 0.02
    assert np.max(np.abs(told.stance.end[-10:] - seen.stance.end[-10:])) < 0.02


@pytest.mark.long
def test_the_optimal_leg_goes_on_hopping(optimal: LegDesign, tmp_path: Path) -> None:
    """Past the time in which a hop that grows slowly would reach a straight leg."""
    reduced = Linkage(kind=LinkageKind.REDUCED)
    chosen = Experiment(design=optimal, controller=JumpConfig(), linkage=reduced, duration=20.0)
    finished = record(chosen, tmp_path)
    assert finished.outcome.status == "complete"
    run = load(finished.path)
    apexes = Analysis(run).gait.flight.apex_height[-10:]
    assert np.ptp(apexes) < 0.002
    assert np.min(run["joint_pos"] @ [-1.0, 1.0]) > 0.1


@pytest.mark.parametrize("name", ["optimal", "prototype"])
def test_loops_and_energy_hold_through_every_impact(hops: dict[str, Summary], name: str) -> None:
    assert 0.0 < hops[name].loop_gap_max < 2e-5
    assert hops[name].energy_residual < 1e-3


def test_the_folder_is_named_after_what_ran(hops: dict[str, Summary]) -> None:
    for name, summary in hops.items():
        assert Path(summary.run).name.endswith(f"_jump-{name}")
