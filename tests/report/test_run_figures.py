import math
from pathlib import Path

import pytest
from small_campaign import IDEAL, JUMP, campaign

from legbench.campaign import read_table
from legbench.campaign.again import experiment_of
from legbench.campaign.curves import rows_of
from legbench.experiment.run import run
from legbench.metrics import Analysis, summarise
from legbench.recording.reader import Recording
from legbench.report import figures, kpis
from legbench.viz.print.stills import stills_of

STEP = """
[[cells]]
name = "step"
set."controller.kind" = "position-jump"
set."setup.kind" = "hfts"
set.duration = 2.0
list = [{ "controller.settings.z2" = 1.0, "controller.settings.dz2" = -0.3 }]
"""


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a campaign of one step and one jump that kept no recordings."""
    return campaign(IDEAL + STEP + JUMP, tmp_path_factory.mktemp("two"))


def recorded(folder: Path, controller: str) -> Recording:
    rows = rows_of(read_table(folder), "run")
    row = next(row for row in rows if row["controller.kind"] == controller)
    return run(experiment_of(folder, row))


@pytest.fixture(scope="module")
def hop(two: Path) -> Recording:
    return recorded(two, "jump")


@pytest.fixture(scope="module")
def step(two: Path) -> Recording:
    return recorded(two, "position-jump")


def test_kpis_are_the_figures_of_the_summary_with_units(hop: Recording) -> None:
    found, summary = kpis(hop), summarise(hop)
    assert found["foot_clearance"].value == summary.foot_clearance
    assert found["foot_clearance"].unit == "m"
    assert found["hop_freq"].unit == "Hz"
    assert found["rating_flight_motor_1"].value == summary.rating_flight_motor[0]
    assert found["rating_flight_lowest"].value == min(summary.rating_flight)
    assert "period_1" not in found
    assert {each.unit for each in found.values()} <= {"1", "m", "s", "rad", "Hz", "J"}
    assert all(isinstance(each.value, float) for each in found.values())


def test_kpis_of_a_fixed_setup_have_its_periods(step: Recording) -> None:
    found, summary = kpis(step), summarise(step)
    assert found["period_1"].value == summary.periods[0]
    assert found["rating_periods_equilibrium_1"].value == summary.rating_periods_equilibrium[0]
    assert math.isnan(found["foot_clearance"].value)


def test_figures_are_named_and_stills_need_a_jump(hop: Recording, step: Recording) -> None:
    assert [*figures(hop)] == ["phase", "stills"]
    assert [*figures(step)] == ["phase"]


def test_stills_show_one_jump_from_lower_apex_to_lower_apex(hop: Recording) -> None:
    stills, run_ = stills_of(hop), Analysis(hop)
    jumps = run_.gait.jumps
    assert stills[0].time == 0.0
    assert stills[-1].time == pytest.approx(float(jumps.end[-1] - jumps.start[-1]))
    hips = [float(still.points[0, 1]) for still in stills]
    assert hips.index(max(hips)) in (3, 4)
    assert min(hips[1:-1]) > max(hips[0], hips[-1]) - 1e-3
    assert [still.stance for still in stills] == [True, *[s.stance for s in stills[1:-1]], True]
    assert not all(still.stance for still in stills)
    for still in stills:
        # A foot in stance is on the ground, one in flight above it.
        assert (abs(float(still.points[3, 1])) < 2e-3) == still.stance
