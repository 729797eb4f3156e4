"""Campaigns whose processes die: nothing is lost, nothing is there twice, nobody is left over."""

import os
import random
import signal
import subprocess
import time
from concurrent.futures import Future
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from campaigns import LARGE, alive, children_of, planned, program, ran, table_bytes, written
from distributed import KilledWorker
from submitit.core.utils import FailedJobError, UncompletedJobError

from legbench.campaign import pool, read_table, shards_of
from legbench.campaign.dask_workers import DaskExecutor
from legbench.campaign.executor import Done, SerialExecutor
from legbench.campaign.pool import PoolExecutor
from legbench.campaign.slurm import SlurmExecutor
from legbench.campaign.work import Work, do_work, work_of
from legbench.errors import CampaignError
from legbench.interrupts import StopFlag

PATIENCE = 120.0
"""Longest that a test waits for another process [s]; none of them asserts how long it took."""


def waited(until: Any) -> None:
    """Look again and again until something is so."""
    end = time.monotonic() + PATIENCE
    while not until():
        assert time.monotonic() < end, "it never came to be"
        time.sleep(0.002)


@pytest.mark.long
def test_a_campaign_that_is_killed_is_gone_on_with(tmp_path: Path) -> None:
    """Killed once so many shards are there, at no particular instant; then gone on with here.

    `scripts/bench_campaign.py kills` does so again and again.
    """
    written(tmp_path, LARGE)
    plan, out = planned(tmp_path, LARGE), tmp_path / "out"
    chance = random.Random(4)
    wanted = chance.randrange(2, 10)
    with subprocess.Popen(program(tmp_path, out, "local")) as process:
        waited(lambda: len(list(out.glob("shards/*.parquet"))) >= wanted)
        time.sleep(chance.uniform(0.0, 0.02))
        started = children_of(process.pid)
        process.kill()
    assert process.returncode == -signal.SIGKILL
    assert started
    waited(lambda: not any(map(alive, started)))
    done = {path: path.read_bytes() for path in out.glob("shards/*.parquet")}
    assert wanted <= len(done) < 16
    ran(plan, out, SerialExecutor(1), 1)
    assert {path: path.read_bytes() for path in done} == done
    ran(plan, tmp_path / "whole", SerialExecutor(1))
    assert table_bytes(out) == table_bytes(tmp_path / "whole")
    hashes = read_table(out)["experiment"].to_pylist()
    assert len(set(hashes)) == 16
    assert len(list(out.glob("shards/*"))) == 16


def deadly(work: Work) -> bytes:
    """Kill the worker for some works: always, or the first time alone."""
    if work.hashes[0].startswith("always"):
        os.kill(os.getpid(), signal.SIGKILL)
    mark = work.records
    if mark is not None and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return do_work(Work(**{name: getattr(work, name) for name in FIELDS}, records=None))


FIELDS = ("name", "experiments", "hashes", "together")


@pytest.mark.long
def test_a_shard_whose_worker_dies_is_run_again_then_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One shard kills its worker once, one always; the others are run as ever."""
    shards = shards_of(planned(tmp_path, LARGE), 4)
    once, always, calm = (work_of(shard, None) for shard in shards[:3])
    once = Work(**{name: getattr(once, name) for name in FIELDS}, records=tmp_path / "mark")
    lost: dict[str, Any] = {name: getattr(always, name) for name in FIELDS}
    lost["hashes"] = ("always-deadly",)
    monkeypatch.setattr(pool, "_work", deadly)
    notes: list[str] = []
    works = [Work(**lost, records=None), once, calm]
    found = {d.work.name: d for d in PoolExecutor(1).run(works, StopFlag(), notes.append)}
    assert len(found) == 3
    assert found[once.name].failure is None
    assert found[calm.name].content == do_work(calm)
    failure = found[always.name].failure
    assert failure is not None
    assert "its worker died twice, the second time alone" in failure
    assert "always-deadl" in failure
    assert set(notes) == {"a worker died; shards that were running and are run again: 1"}


NOBODY: Any = None
"""State of a worker that nobody looks at."""


class Workers:
    """Stands for Dask's client: some shards kill their worker, once or always."""

    def __init__(self, deaths: dict[str, int]) -> None:
        self.deaths = dict(deaths)
        self.asked: list[str] = []

    def scheduler_info(self) -> dict[str, Any]:
        return {"workers": {"one": {}, "other": {}}}

    def get_executor(self, *, pure: bool) -> "Workers":
        assert not pure
        return self

    def submit(self, function: Any, work: Work) -> "Future[bytes]":
        assert function is do_work
        self.asked.append(work.name)
        future: Future[bytes] = Future()
        self.deaths[work.name] = self.deaths.get(work.name, 0) - 1
        if self.deaths[work.name] >= 0:
            future.set_exception(KilledWorker(work.name, NOBODY, 0))
        else:
            future.set_result(work.name.encode())
        return future


def named(count: int) -> list[Work]:
    return [
        Work(name=f"w{n}", experiments=(), hashes=(f"h{n}",), together=True, records=None)
        for n in range(count)
    ]


def test_what_a_dead_worker_of_dask_had_is_run_again_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    workers = Workers({"w1": 1, "w3": 9})
    monkeypatch.setattr(DaskExecutor, "_client", lambda self: nullcontext(workers))
    notes: list[str] = []
    found = {d.work.name: d for d in DaskExecutor().run(named(6), StopFlag(), notes.append)}
    assert notes == ["a worker died; shards that it had and that are run again: 2"]
    assert sorted(workers.asked[:6]) == ["w0", "w1", "w2", "w3", "w4", "w5"]
    assert sorted(workers.asked[6:]) == ["w1", "w3"]
    assert {name: done.failure is None for name, done in found.items()} == {
        **dict.fromkeys(["w0", "w1", "w2", "w4", "w5"], True),
        "w3": False,
    }
    assert "its worker died twice, the second time alone: 1 experiments from h3 on" in str(
        found["w3"].failure
    )


class Job:
    """Stands for a job of submitit that comes to its end, or dies."""

    def __init__(self, work: Work, ends: str) -> None:
        self.work, self.ends, self.cancelled = work, ends, False
        self.paths = SimpleNamespace(stderr="job.err")

    def done(self) -> bool:
        return True

    def cancel(self) -> None:
        self.cancelled = True

    def result(self) -> Done:
        if self.ends == "dies":
            raise UncompletedJobError
        if self.ends == "fails":
            raise FailedJobError
        return Done(work=self.work, content=b"rows")


def test_jobs_that_die_are_submitted_once_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = SlurmExecutor(tmp_path, cluster="debug")
    ends = {"w0": ["ends"], "w1": ["dies", "ends"], "w2": ["dies", "dies"], "w3": ["fails"]}
    submitted: list[str] = []

    def submit(works: list[Work]) -> dict[Any, Work]:
        submitted.extend(work.name for work in works)
        return {Job(work, ends[work.name].pop(0)): work for work in works}

    monkeypatch.setattr(jobs, "_submit", submit)
    notes: list[str] = []
    found = {done.work.name: done for done in jobs.run(named(4), StopFlag(), notes.append)}
    assert submitted == ["w0", "w1", "w2", "w3", "w1", "w2"]
    assert notes == ["jobs that died, whose shards are run again: 2"]
    assert found["w0"].failure is found["w1"].failure is None
    assert "its job died twice" in str(found["w2"].failure)
    assert found["w3"].failure == "its job failed; see job.err"


def test_jobs_are_cancelled_when_somebody_asks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs, flag, kept = SlurmExecutor(tmp_path, cluster="debug"), StopFlag(), []

    def submit(works: list[Work]) -> dict[Any, Work]:
        kept.extend(Job(work, "ends") for work in works)
        return dict(zip(kept, works, strict=True))

    monkeypatch.setattr(jobs, "_submit", submit)
    flag.set()
    assert list(jobs.run(named(2), flag, print)) == []
    assert [job.cancelled for job in kept] == [True, True]


def test_a_cluster_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="no jobs can be submitted"):
        SlurmExecutor(tmp_path, cluster="slurm")
    with pytest.raises(CampaignError, match="no jobs can be submitted"):
        SlurmExecutor(tmp_path, cluster="debug", options={"walltime": 3})
