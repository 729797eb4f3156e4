"""Campaigns as arrays of Slurm jobs, through Slurm's own programs as submitit calls them."""

from pathlib import Path

import pytest
from campaigns import SMALL, planned, ran, table_bytes
from slurm_cluster import Cluster
from submitit import SlurmJob

from legbench.campaign import run_campaign, shards_of
from legbench.campaign.executor import Done, SerialExecutor
from legbench.campaign.slurm import SlurmExecutor
from legbench.campaign.work import Work
from legbench.errors import CampaignError
from legbench.interrupts import StopFlag


@pytest.fixture
def cluster(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Cluster:
    # Submitit waits so long for the file of a job whose state says that it has ended.
    monkeypatch.setattr(SlurmJob, "_results_timeout_s", 0)
    return Cluster(tmp_path / "cluster", monkeypatch)


def named(count: int) -> list[Work]:
    return [
        Work(name=f"w{n}", experiments=(), hashes=(f"h{n}",), together=True, records=None)
        for n in range(count)
    ]


def test_an_array_of_jobs_one_of_which_dies_changes_no_byte(
    cluster: Cluster, tmp_path: Path
) -> None:
    """Of two shards one is killed before it ends and is run again, alone."""
    plan = planned(tmp_path, SMALL)
    cluster.mark("101_1", "dies")
    notes: list[str] = []
    jobs = SlurmExecutor(tmp_path / "jobs", options={"slurm_partition": "legs"}, look_every=0.01)
    finished = run_campaign(plan, tmp_path / "out", jobs, shards_of(plan, 4), note=notes.append)
    assert finished.failures == ()
    assert notes == ["jobs that died, whose shards are run again: 1"]
    assert cluster.states() == {"101_0": "COMPLETED", "101_1": "FAILED", "102": "COMPLETED"}
    script = cluster.script("101_0")
    for directive in ("array=0-1%2", "partition=legs", "job-name=legbench", "mem=2GB", "time=60"):
        assert f"#SBATCH --{directive}\n" in script
    assert "#SBATCH --array" not in cluster.script("102")
    ran(plan, tmp_path / "whole", SerialExecutor(1))
    assert table_bytes(tmp_path / "out") == table_bytes(tmp_path / "whole")


def test_jobs_that_are_cancelled_or_die_twice_are_named(cluster: Cluster, tmp_path: Path) -> None:
    """An administrator cancels one, the other's node fails; both are submitted once more."""
    cluster.cancel("101_0")
    for job in ("101_1", "102_0", "102_1"):
        cluster.mark(job, "dies")
    jobs = SlurmExecutor(tmp_path / "jobs", look_every=0.01)
    notes: list[str] = []
    found = {done.work.name: done for done in jobs.run(named(2), StopFlag(), notes.append)}
    assert notes == ["jobs that died, whose shards are run again: 2"]
    assert cluster.states() == {
        "101_0": "CANCELLED by 0",
        "101_1": "FAILED",
        "102_0": "FAILED",
        "102_1": "FAILED",
    }
    for place in range(2):
        failure = str(found[f"w{place}"].failure)
        assert f"its job died twice: 1 experiments from h{place} on" in failure


def test_jobs_that_wait_are_cancelled_all_of_them(
    cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Somebody asks for the end; `scancel` fails for one job, which has just ended."""
    cluster.hold()
    cluster.mark("101_0", "purged")
    jobs, stop, notes = SlurmExecutor(tmp_path / "jobs"), StopFlag(), list[str]()
    monkeypatch.setattr("time.sleep", lambda _: stop.set())
    assert list(jobs.run(named(3), stop, notes.append)) == []
    assert cluster.states() == {"101_1": "CANCELLED by 1000", "101_2": "CANCELLED by 1000"}
    assert notes == ["scancel has failed for jobs that may have ended: 101_0; see squeue"]


def test_whoever_gives_up_waiting_leaves_no_job_behind(
    cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A full disk, say, ends the campaign while jobs are in the queue."""
    cluster.hold()
    jobs = SlurmExecutor(tmp_path / "jobs")
    waiting = jobs.run(named(2), StopFlag(), print)

    class DiskFullError(Exception):
        pass

    def first_look(_self: SlurmJob[Done]) -> bool:
        raise DiskFullError

    monkeypatch.setattr(SlurmJob, "done", first_look)
    with pytest.raises(DiskFullError):
        next(waiting)
    assert cluster.states() == {"101_0": "CANCELLED by 1000", "101_1": "CANCELLED by 1000"}


@pytest.mark.parametrize("count", [1, 3], ids=["one job", "an array"])
def test_jobs_that_slurm_refuses_are_told_in_one_line(
    cluster: Cluster, tmp_path: Path, count: int
) -> None:
    cluster.refuse("sbatch: error: invalid partition specified: legs\nBatch job submission failed")
    jobs = SlurmExecutor(tmp_path / "jobs", options={"slurm_partition": "legs"})
    with pytest.raises(CampaignError, match="refuses the jobs: sbatch: error: invalid") as error:
        list(jobs.run(named(count), StopFlag(), print))
    assert "\n" not in str(error.value)
    assert "--slurm NAME=VALUE" in str(error.value)
