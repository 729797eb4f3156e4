"""Running campaigns: equal tables whoever runs them, and what is kept when something fails."""

import errno
import gc
import json
import os
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, final

import numpy as np
import pyarrow as pa
import pytest
from campaigns import BASE, MIXED, SMALL, planned, ran, table_bytes, written
from pyarrow import parquet

import legbench
from legbench.campaign import folder as folder_module
from legbench.campaign import load_campaign, plan_campaign, read_table, run_campaign, shards_of
from legbench.campaign.dask_workers import DaskExecutor
from legbench.campaign.executor import AbstractExecutor, Done, Note, SerialExecutor
from legbench.campaign.folder import open_folder
from legbench.campaign.plan import CampaignPlan
from legbench.campaign.pool import PoolExecutor
from legbench.campaign.provenance import provenance
from legbench.campaign.shards import FORMAT_KEY, PROVENANCE_KEY
from legbench.campaign.slurm import SlurmExecutor
from legbench.campaign.work import Work, do_work, work_of
from legbench.design import LegDesign
from legbench.design.toml import save_design
from legbench.errors import CampaignError
from legbench.experiment import run_batch
from legbench.experiment.running import record_in_memory
from legbench.imperfections import Imperfections
from legbench.interrupts import StopFlag
from legbench.recording import saved


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> CampaignPlan:
    return planned(tmp_path_factory.mktemp("file"), MIXED)


@pytest.fixture(scope="module")
def whole(mixed: CampaignPlan, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Table of the campaign that this process has run at one go."""
    out = tmp_path_factory.mktemp("whole")
    finished = ran(mixed, out)
    assert (finished.done, finished.total, finished.failures) == (8, 8, ())
    return table_bytes(out)


@pytest.mark.parametrize(("size", "threads"), [(1, 1), (3, 2), (8, 2)])
def test_company_and_threads_change_no_byte(
    mixed: CampaignPlan, whole: bytes, size: int, threads: int, tmp_path: Path
) -> None:
    ran(mixed, tmp_path, SerialExecutor(threads), size)
    assert table_bytes(tmp_path) == whole


def test_processes_of_this_machine_change_no_byte(
    mixed: CampaignPlan, whole: bytes, tmp_path: Path
) -> None:
    ran(mixed, tmp_path, PoolExecutor(1), 2)
    assert table_bytes(tmp_path) == whole


@pytest.mark.long
def test_dask_changes_no_byte(mixed: CampaignPlan, whole: bytes, tmp_path: Path) -> None:
    ran(mixed, tmp_path, DaskExecutor(workers=1), 2)
    assert table_bytes(tmp_path) == whole


@pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_jobs_change_no_byte(mixed: CampaignPlan, whole: bytes, tmp_path: Path) -> None:
    """Jobs of the array that Slurm gets, run by submitit in this process; it leaves logs open."""
    jobs = SlurmExecutor(tmp_path / "jobs", cluster="debug")
    ran(mixed, tmp_path / "out", jobs, 4)
    assert table_bytes(tmp_path / "out") == whole
    gc.collect()


def test_parts_of_several_callers_make_one_table(
    mixed: CampaignPlan, whole: bytes, tmp_path: Path
) -> None:
    shards, executor = shards_of(mixed, 2), SerialExecutor(1)
    for number in (2, 3):
        finished = run_campaign(mixed, tmp_path, executor, shards, part=(number, 3))
        assert finished.table is None
        assert finished.done == finished.wanted
        assert not finished.stopped
    finished = run_campaign(mixed, tmp_path, executor, shards, part=(1, 3))
    assert finished.table is not None
    assert table_bytes(tmp_path) == whole


def test_the_table_says_what_ran_where(mixed: CampaignPlan, whole: bytes, tmp_path: Path) -> None:
    (tmp_path / "table.parquet").write_bytes(whole)
    table = read_table(tmp_path)
    assert sorted(set(table["experiment"].to_pylist())) == sorted(e.hash for e in mixed.planned)
    assert sum(kind == "run" for kind in table["row"].to_pylist()) == 8
    told = json.loads(table.schema.metadata[PROVENANCE_KEY])
    assert told == [provenance()]
    assert told[0]["cpu"]
    assert len(told[0]["libm"]["fingerprint"]) == 16
    for each in mixed.planned:
        rows = [row for row in table.to_pylist() if row["experiment"] == each.hash]
        assert {row["trial"] for row in rows} == {each.trial}
        assert {row["seed"] for row in rows} == {each.experiment.seed}


def test_trials_share_all_but_their_noise(tmp_path: Path) -> None:
    """Common random numbers: a trial has the same noise in every cell, another trial has not."""
    text = BASE.replace('"ffs"', '"hfts"').replace("0.12", "0.5")
    plan = planned(tmp_path, f"trials = 2\n{text}[grid]\ncontroller.settings.z2 = [1.0, 1.01]\n")
    assert [each.experiment.seed for each in plan.planned] == [5, 6, 5, 6]
    ideal = [replace(each.experiment, imperfections=Imperfections()) for each in plan.planned]
    noisy = run_batch([each.experiment for each in plan.planned])
    noise = [
        one["joint_pos"] - other["joint_pos"]
        for one, other in zip(noisy, run_batch(ideal), strict=True)
    ]
    np.testing.assert_allclose(noise[0], noise[2], atol=1e-12)
    assert np.abs(noise[0] - noise[1]).max() > 1e-4
    ran(plan, tmp_path / "out")
    rows = read_table(tmp_path / "out").to_pylist()
    first = [row for row in rows if row["row"] == "period" and row["index"] == 1]
    assert len(first) == len({row["rating"] for row in first}) == 4


@final
class Interrupted(AbstractExecutor):
    """Runs a number of shards, then somebody asks for the end."""

    def __init__(self, shards: int) -> None:
        self._left = shards

    def run(self, works: Sequence[Work], stop: StopFlag, note: Note) -> Iterator[Done]:
        for done in SerialExecutor(1).run(works, stop, note):
            yield done
            self._left -= 1
            if self._left == 0:
                stop.set()


def test_an_interrupted_campaign_is_gone_on_with(
    mixed: CampaignPlan, whole: bytes, tmp_path: Path
) -> None:
    told: list[tuple[int, int]] = []
    shards = shards_of(mixed, 2)
    stopped = run_campaign(mixed, tmp_path, Interrupted(2), shards)
    assert (stopped.done, stopped.stopped, stopped.table) == (4, True, None)
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "shards").iterdir()}
    assert len(before) == 2
    finished = run_campaign(
        mixed,
        tmp_path,
        SerialExecutor(1),
        shards,
        progress=lambda done, total, left: told.append((done, total)),
    )
    assert [done for done, _ in told] == [4, 6, 8]
    assert finished.table is not None
    assert table_bytes(tmp_path) == whole
    for path, time in before.items():
        assert path.stat().st_mtime_ns == time
    # Once more: nothing is left to do, and the table is as it was.
    again = run_campaign(mixed, tmp_path, Interrupted(0), shards)
    assert again.done == 8
    assert table_bytes(tmp_path) == whole


def test_a_stop_in_mid_shard_gives_it_up(mixed: CampaignPlan) -> None:
    (shard, *_) = shards_of(mixed, 8)
    flag = StopFlag()
    flag.set()
    assert list(SerialExecutor(1).run([work_of(shard, None)], flag, print)) == []


def test_recordings_are_run_folders(tmp_path: Path) -> None:
    plan = planned(tmp_path, SMALL.replace("trials = 2", "trials = 1"))
    run_campaign(plan, tmp_path / "out", SerialExecutor(1), shards_of(plan), records=True)
    each = plan.planned[2]
    found = legbench.load(tmp_path / "out" / "records" / each.hash)
    alone = record_in_memory(each.experiment)
    assert found.complete
    assert found.torn is None
    for name in alone.columns.keys() - {"cycle_us", "late_us"}:
        assert found.columns[name].tobytes() == alone.columns[name].tobytes(), name
    assert not found["cycle_us"].any()
    assert found.events == alone.events
    assert legbench.Experiment.from_run(found.path) == each.experiment
    # Recordings that are asked for later are made later.
    shutil.rmtree(found.path)
    run_campaign(plan, tmp_path / "out", SerialExecutor(1), shards_of(plan), records=True)
    assert found.path.is_dir()


def test_controllers_of_one_s_own_are_found_wherever_they_are_run(tmp_path: Path) -> None:
    sine = Path(__file__).parents[1] / "control" / "guests" / "sine.py"
    kind = f'"{sine}:Sine"'
    text = BASE.replace('"position-jump"', kind).replace("controller.settings.delay = 0.02\n", "")
    plan = planned(tmp_path, text + "[grid]\ncontroller.settings.freq = [2.0, 3.0]\n")
    run_campaign(plan, tmp_path / "out", SerialExecutor(1), shards_of(plan), records=True)
    for each in plan.planned:
        kept = tmp_path / "out" / "records" / each.hash
        assert legbench.Experiment.from_run(kept) == each.experiment
        assert legbench.load(kept)["swing"].any()


def test_a_leg_that_faults_is_in_the_table_and_the_others_are_as_without_it(
    prototype: LegDesign, tmp_path: Path
) -> None:
    limits = replace(prototype.limits, knee=(0.02, 3.1))
    wild = replace(prototype, limits=limits, damping=(0.0, 0.0))
    save_design(wild, tmp_path / "wild.toml")
    text = """
base.design = "wild.toml"
base.duration = 0.4
base.setup.kind = "hfts"
base.linkage.kind = "reduced"
base.controller = {kind = "position-jump", settings = {delay = 0.02}}
[[list]]
controller.settings.z2 = 0.08
controller.settings.dz2 = 1.3
[[list]]
controller.settings.z2 = 0.8
controller.settings.dz2 = 0.1
"""
    plan = planned(tmp_path, text)
    ran(plan, tmp_path / "out", size=2)
    rows = [row for row in read_table(tmp_path / "out").to_pylist() if row["row"] == "run"]
    by_hash = {row["experiment"]: row for row in rows}
    lost, calm = (by_hash[each.hash] for each in plan.planned)
    assert (lost["status"], lost["cause"]) == ("fault", "leg straightened through")
    assert lost["length"] < 0.4
    assert (calm["status"], calm["cause"]) == ("complete", None)
    ran(plan, tmp_path / "apart", size=1)
    assert table_bytes(tmp_path / "apart") == table_bytes(tmp_path / "out")


def test_experiments_that_no_batch_can_run_are_run_alone(tmp_path: Path) -> None:
    text = BASE.replace("duration = 0.12", "duration = 0.05") + (
        "[grid]\nplant.kind = ['sim', 'analytic']\n"
    )
    plan = planned(tmp_path, text)
    assert [shard.together for shard in shards_of(plan)] == [True, False]
    assert ran(plan, tmp_path / "out").table is not None


# --- what goes wrong --------------------------------------------------------------------------


def rewritten(path: Path, change: dict[bytes, bytes]) -> None:
    table = parquet.read_table(str(path))
    parquet.write_table(
        table.replace_schema_metadata({**(table.schema.metadata or {}), **change}), str(path)
    )


def test_a_shard_of_another_version_is_refused(tmp_path: Path) -> None:
    plan = planned(tmp_path)
    ran(plan, tmp_path / "out")
    (path,) = (tmp_path / "out" / "shards").iterdir()
    other: Any = json.loads(json.dumps(provenance()))
    other["versions"]["mujoco"] = "1.2.3"
    rewritten(path, {PROVENANCE_KEY: json.dumps(other).encode()})
    with pytest.raises(CampaignError, match=r"was written by mujoco 1\.2\.3; here is mujoco"):
        ran(plan, tmp_path / "out")
    rewritten(path, {FORMAT_KEY: b"0"})
    with pytest.raises(CampaignError, match="has format 0; this legbench writes 1"):
        ran(plan, tmp_path / "out")
    path.write_bytes(b"torn")
    with pytest.raises(CampaignError, match=r"is damaged: .*remove it, and it is run again"):
        ran(plan, tmp_path / "out")
    path.unlink()
    assert ran(plan, tmp_path / "out").table is not None


def test_two_campaigns_in_one_folder(tmp_path: Path) -> None:
    plan = planned(tmp_path)
    other = planned(tmp_path, SMALL.replace("trials = 2", "trials = 1"))
    out = tmp_path / "out"
    with open_folder(out, plan):
        with pytest.raises(CampaignError, match=r"another campaign works in .*out: wait for it"):
            ran(plan, out)
        with pytest.raises(CampaignError, match="another campaign works in"):
            run_campaign(plan, out, SerialExecutor(1), shards_of(plan), part=(1, 2))
    with open_folder(out, plan, (1, 2)):
        with pytest.raises(CampaignError, match="another campaign works in"):
            run_campaign(plan, out, SerialExecutor(1), shards_of(plan), part=(1, 2))
        with pytest.raises(CampaignError, match="another campaign works in"):
            ran(plan, out)
        with open_folder(out, plan, (2, 2)):
            pass
    with pytest.raises(
        CampaignError, match="holds another campaign, 'small' of 8 experiments; this is 'small' of"
    ):
        ran(other, out)
    (out / "campaign.json").write_text("{")
    with pytest.raises(CampaignError, match=r"campaign\.json is damaged"):
        ran(plan, out)
    (out / "campaign.json").unlink()
    (out / "shards" / "x.parquet").write_bytes(b"")
    with pytest.raises(CampaignError, match="holds something else"):
        ran(plan, out)


def test_a_full_disk_keeps_what_is_done(
    mixed: CampaignPlan, whole: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    good = folder_module.write_whole
    room = [4]

    def write(path: Path, content: bytes) -> None:
        room[0] -= 1
        if room[0] < 0:
            path.with_name(f".{path.name}.draft").write_bytes(content[:7])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        good(path, content)

    with monkeypatch.context() as patch:
        patch.setattr(folder_module, "write_whole", write)
        with pytest.raises(CampaignError, match=r"No space left on device.*what is done is kept"):
            ran(mixed, tmp_path, size=2)
    kept = sorted(path.name for path in (tmp_path / "shards").glob("*.parquet"))
    assert len(kept) == 2
    assert list((tmp_path / "shards").glob(".*.draft"))
    ran(mixed, tmp_path, size=2)
    assert table_bytes(tmp_path) == whole
    assert not list(tmp_path.rglob(".*.draft"))


def test_a_full_disk_under_recordings_ends_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    plan = planned(tmp_path)
    monkeypatch.setattr(saved, "_write_samples", full)
    with pytest.raises(CampaignError, match=r"No space left on device.*make room"):
        run_campaign(plan, tmp_path / "out", SerialExecutor(1), shards_of(plan), records=True)
    assert not any((tmp_path / "out" / "records").iterdir())
    assert not any((tmp_path / "out" / "shards").iterdir())


@final
class Strange(AbstractExecutor):
    """Sends something else than what was asked for."""

    def __init__(self, way: str) -> None:
        self._way = way

    def run(self, works: Sequence[Work], stop: StopFlag, note: Note) -> Iterator[Done]:
        content = do_work(works[1 if self._way == "other" else 0])
        if self._way == "version":
            table = parquet.read_table(pa.BufferReader(content))
            buffer = pa.BufferOutputStream()
            metadata = {**(table.schema.metadata or {}), PROVENANCE_KEY: b'{"versions": {}}'}
            parquet.write_table(table.replace_schema_metadata(metadata), buffer)
            content = buffer.getvalue().to_pybytes()
        yield Done(work=works[0], content=content)


@pytest.mark.parametrize(
    ("way", "why"),
    [("other", "has sent another shard"), ("version", "a worker's shard was written by legbench")],
)
def test_workers_that_are_not_what_they_should_be(
    mixed: CampaignPlan, way: str, why: str, tmp_path: Path
) -> None:
    finished = run_campaign(mixed, tmp_path, Strange(way), shards_of(mixed, 2))
    assert why in finished.failures[0]
    assert not any((tmp_path / "shards").iterdir())
    assert finished.table is None


def test_a_guest_that_changes_on_the_way_is_named(tmp_path: Path) -> None:
    (shard, *_) = shards_of(planned(tmp_path))
    work = work_of(shard, None)
    tables = dict(work.experiments[0]) | {"seed": 99}
    changed = Work(
        name=work.name,
        experiments=(tables, *work.experiments[1:]),
        hashes=work.hashes,
        together=True,
        records=None,
    )
    (done,) = SerialExecutor(1).run([changed], StopFlag(), print)
    assert done.failure is not None
    assert "a controller or plant of yours was changed" in done.failure


def test_a_file_of_another_folder_is_the_same_campaign(tmp_path: Path) -> None:
    """Where a campaign file lies is no part of it: its experiments are."""
    (tmp_path / "a").mkdir()
    first = plan_campaign(load_campaign(written(tmp_path, SMALL)))
    second = plan_campaign(load_campaign(written(tmp_path / "a", SMALL)))
    assert first.digest == second.digest
    assert [s.name for s in shards_of(first)] == [s.name for s in shards_of(second)]
