"""Campaigns whose processes die: nothing is lost, nothing is there twice, nobody is left over."""

import os
import random
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest
from campaigns import MIXED, alive, children_of, planned, program, ran, table_bytes, written

from legbench.campaign import pool, read_table, shards_of
from legbench.campaign.executor import SerialExecutor
from legbench.campaign.pool import PoolExecutor
from legbench.campaign.work import Work, do_work, work_of
from legbench.interrupts import StopFlag

PATIENCE = 120.0
"""Longest that a test waits for another process [s]; none of them asserts how long it took."""


def waited(until: Any) -> None:
    """Look again and again until something is so."""
    end = time.monotonic() + PATIENCE
    while not until():
        assert time.monotonic() < end, "it never came to be"
        time.sleep(0.002)


def test_a_campaign_that_is_killed_is_gone_on_with(tmp_path: Path) -> None:
    """Killed once so many shards are there, at no particular instant; then gone on with here.

    `scripts/bench_campaign.py kills` does so again and again.
    """
    written(tmp_path, MIXED)
    plan, out = planned(tmp_path, MIXED), tmp_path / "out"
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


def test_a_shard_whose_worker_dies_is_run_again_then_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One shard kills its worker once, one always; the others are run as ever."""
    shards = shards_of(planned(tmp_path, MIXED), 4)
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
