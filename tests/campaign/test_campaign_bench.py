"""Campaigns on the bench, that is on emulated drives: in order, with looks, until a fault."""

from dataclasses import replace
from pathlib import Path

import pytest
from campaigns import MODELS, planned, ran, written

from legbench.campaign import bench, load_campaign, plan_campaign, read_table
from legbench.campaign.bench import run_on_bench
from legbench.campaign.plan import CampaignPlan
from legbench.drives.emulated.faults import NodeFault, NodeFaultKind
from legbench.errors import CampaignError, ConfigError
from legbench.interrupts import StopFlag
from legbench.plants import CanChoice
from legbench.recording.reader import load

HARDWARE = MODELS.parent / "hardware"
TEXT = f"""
name = "bench"
[base]
design = "{MODELS / "prototype.toml"}"
duration = 0.05
setup.kind = "hfts"
linkage.kind = "reduced"
controller.kind = "position-jump"
controller.settings.delay = 0.01
controller.settings.dz2 = 0.05
[base.plant]
kind = "can"
settings.bus = "{HARDWARE / "leg.toml"}"
settings.interface = "legbench"
settings.end = "stop"
[grid]
"controller.settings.z2" = [0.9, 1.0, 0.95]
"""


MS = 1_000_000
IN_MID_RUN, AT_THE_START = 450 * MS, 350 * MS
"""Virtual times after 25 of the 50 cycles, and on the way to the start posture [ns]."""


def faulty(plan: CampaignPlan, number: int, time_ns: int) -> CampaignPlan:
    """The plan with a drive that is unplugged in one of its runs."""
    planned = list(plan.planned)
    experiment = planned[number].experiment
    assert isinstance(experiment.plant, CanChoice)
    fault = NodeFault(kind=NodeFaultKind.SILENT, node_id=2, start_ns=time_ns)
    plant = replace(experiment.plant, faults=(fault,))
    planned[number] = replace(planned[number], experiment=replace(experiment, plant=plant))
    return replace(plan, planned=tuple(planned))


def test_all_cells_are_run_in_order_and_the_first_fault_ends_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan, out, looks = planned(tmp_path, TEXT), tmp_path / "out", []
    good = bench.drive_troubles
    monkeypatch.setattr(
        bench, "drive_troubles", lambda session: looks.append(session) or good(session)
    )
    monkeypatch.setattr(bench, "moves_drives", lambda experiment: True)
    pauses: list[float] = []
    stopped = run_on_bench(
        faulty(plan, 1, IN_MID_RUN),
        out,
        pause=7.0,
        wait=lambda seconds, stop: pauses.append(seconds),
    )
    assert stopped.done == 1
    (failure,) = stopped.failures
    assert failure.startswith("cells, cell 1, trial 0: drive 'motor2' (node 2) sent no process")
    assert not stopped.stopped
    folders = sorted((out / "records").iterdir(), key=lambda path: len(path.name))
    assert [load(path).complete for path in folders] == [False, True]
    assert folders[1].name == plan.planned[0].hash
    assert (len(looks), pauses) == (2, [7.0])

    told: list[int] = []
    finished = run_on_bench(
        plan,
        out,
        wait=lambda seconds, stop: pauses.append(seconds),
        progress=lambda done, total, left: told.append(done),
    )
    assert (finished.done, finished.failures, told) == (3, (), [2, 3])
    assert (len(looks), pauses) == (4, [7.0, 2.0])
    runs = [row for row in read_table(out).to_pylist() if row["row"] == "run"]
    assert {row["status"] for row in runs} == {"complete"}
    assert {row["controller.settings.z2"] for row in runs} == {0.9, 0.95, 1.0}


def test_a_fault_on_the_way_to_the_start_ends_it_too(tmp_path: Path) -> None:
    plan = planned(tmp_path, TEXT.replace(", 1.0, 0.95]", "]"))
    stopped = run_on_bench(faulty(plan, 0, AT_THE_START), tmp_path / "out")
    assert (stopped.done, stopped.table) == (0, None)
    assert "cell 0, trial 0: drive 'motor2' (node 2) sent no process data" in stopped.failures[0]


def test_drives_in_fault_are_not_driven(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan, out = planned(tmp_path, TEXT), tmp_path / "out"
    monkeypatch.setattr(bench, "drive_troubles", lambda session: ["motor1 is in fault, 3210h"])
    stopped = run_on_bench(plan, out)
    assert (
        "before the run motor1 is in fault, 3210h; see to it and call again"
        in (stopped.failures[0])
    )
    assert not (out / "records").exists()


def test_somebody_asks_for_the_end(tmp_path: Path) -> None:
    flag = StopFlag()
    flag.set()
    stopped = run_on_bench(planned(tmp_path, TEXT), tmp_path / "out", stop=flag)
    assert (stopped.done, stopped.stopped, stopped.failures) == (0, True, ())


def test_what_is_not_on_a_bench_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, TEXT)
    plan = plan_campaign(load_campaign(path, {"plant": {"kind": "sim"}}))
    with pytest.raises(ConfigError, match="a bench runs plant 'can'; block cells is on another"):
        run_on_bench(plan, tmp_path / "out")
    with pytest.raises(ConfigError, match="pause is -1 s; it must be 0 to 3600 s"):
        run_on_bench(plan, tmp_path / "out", pause=-1.0)


def test_no_executor_moves_drives_on_a_wire(tmp_path: Path) -> None:
    plan = planned(tmp_path, TEXT.replace('settings.interface = "legbench"\n', ""))
    with pytest.raises(CampaignError, match="moves drives on a wire, which no executor does"):
        ran(plan, tmp_path / "out")
    assert not (tmp_path / "out").exists()
