"""Performance of campaigns, as ratios where there is a baseline, and what a kill leaves of one.

scripts/bench_campaign.py             every target but the paper's
scripts/bench_campaign.py paper       the campaign of section VI with 8 s each; minutes
scripts/bench_campaign.py kills 50    kill -9 at 50 random instants, each gone on with
"""

import ctypes
import gc
import random
import resource
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from bench import (
    MODELS,
    Result,
    bench_experiments,
    bench_setup,
    ratio_of,
    standing_batch,
    timed,
)

from legbench.campaign import load_campaign, plan_campaign, read_table, run_campaign, shards_of
from legbench.campaign.dask_workers import DaskExecutor
from legbench.campaign.executor import AbstractExecutor, SerialExecutor
from legbench.campaign.plan import CampaignPlan
from legbench.campaign.pool import PoolExecutor
from legbench.experiment.batch import LegGroup, start_together
from legbench.imperfections import Imperfections

PAPER = MODELS / "campaigns" / "paper.toml"
SWINGS = f"""
name = "swings"
trials = 16
base = {{ design = "{MODELS / "prototype.toml"}", duration = 1.0, setup.kind = "ffs" }}
grid.controller.kind = ["bang-bang", "position-jump"]
grid.controller.settings.z2 = [0.95, 1.0, 1.05, 1.1]
"""
SHORT = SWINGS.replace("trials = 16", "trials = 4").replace("duration = 1.0", "duration = 0.3")
PROGRAM = """
import sys
from pathlib import Path
sys.path[:0] = [{scripts!r}]
from bench_campaign import planned, ran
from legbench.campaign.executor import SerialExecutor
from legbench.campaign.pool import PoolExecutor
if __name__ == "__main__":
    file, out, which = sys.argv[1:]
    executor = PoolExecutor(2) if which == "local" else SerialExecutor(1)
    ran(planned(Path(file)), Path(out), executor, 2)
"""


def planned(file: Path) -> CampaignPlan:
    """The plan of a campaign file."""
    return plan_campaign(load_campaign(file))


def ran(plan: CampaignPlan, out: Path, executor: AbstractExecutor, size: int | None = None) -> None:
    """Run a campaign into a folder."""
    finished = run_campaign(plan, out, executor, shards_of(plan, size))
    if finished.table is None:
        raise SystemExit(f"it has not come to its end: {finished.failures}")


def in_folder(plan: CampaignPlan, executor: AbstractExecutor) -> Callable[[], None]:
    """A whole campaign in a folder of its own."""

    def work() -> None:
        with tempfile.TemporaryDirectory() as out:
            ran(plan, Path(out), executor)

    return work


def swings(text: str, folder: Path) -> CampaignPlan:
    """A plan of a campaign's text."""
    path = folder / "campaign.toml"
    path.write_text(text)
    return planned(path)


def bench_dask() -> Result:
    """Dask with two workers of its own against a pool of two, starts included."""
    with tempfile.TemporaryDirectory() as folder:
        plan = swings(SWINGS, Path(folder))
        dask, pool = in_folder(plan, DaskExecutor(workers=2)), in_folder(plan, PoolExecutor(2))
        pairs = [(timed(dask), timed(pool)) for _ in range(3)]
    ratio = statistics.median(ours / bare for ours, bare in pairs)
    best = tuple(min(column) for column in zip(*pairs, strict=True))
    return Result(
        name="Dask, two workers / local pool",
        value=ratio,
        bound=1.2,
        unit="x",
        detail=f"best {best[0]:.1f} s against {best[1]:.1f} s, {len(plan.planned)} runs of 1 s",
    )


def bench_shard() -> Result:
    """Legs of one shard on one thread, with controller and rows, against bare steps of as many."""
    with tempfile.TemporaryDirectory() as folder:
        plan = swings(SWINGS, Path(folder))
    chosen = [each.experiment for each in shards_of(plan)[0].planned]
    chosen = [replace(each, duration=0.25) for each in chosen]
    group = LegGroup(chosen)
    _, start = start_together(chosen)
    bare = standing_batch(group.open(1), start, 250)
    ratio, detail = ratio_of(lambda: group.run(1, None, 0, 250), bare)
    return Result(
        name=f"shard of {len(chosen)} / mujoco.batch",
        value=ratio,
        bound=1.0 / 0.66,
        unit="x",
        detail=detail,
    )


def bench_memory() -> Result:
    """Memory that a leg of a batch of distinct legs keeps once it is set up, with its manifest."""
    first = planned(PAPER).planned[0].experiment
    chosen = [
        replace(first, imperfections=Imperfections(stiffness_error=(1e-4 * leg, 0.0)))
        for leg in range(1, 561)
    ]
    libc, kept, sizes = ctypes.CDLL(None), [], []
    for part in (chosen[:280], chosen[280:]):
        gc.collect()
        libc.malloc_trim(0)
        before = resident()
        group = LegGroup(part)
        kept.append((group, group.open(1)))
        peak = resident() - before
        gc.collect()
        libc.malloc_trim(0)
        sizes.append((resident() - before, peak))
    size, peak = (value / len(chosen[280:]) / 1024.0 for value in sizes[-1])
    return Result(
        name="memory of a leg of a batch",
        value=size,
        bound=40.0,
        unit="KiB",
        detail=f"{peak:.0f} KiB a leg until freed memory is given back",
    )


def resident() -> int:
    """Resident memory of this process [bytes]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


def bench_paper() -> Result:
    """The paper's campaign, 8 s each, with recordings, in a pool of two."""
    plan = plan_campaign(load_campaign(PAPER, {"duration": 8.0}))
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        began = time.perf_counter()
        finished = run_campaign(plan, out, PoolExecutor(2), shards_of(plan), records=True)
        took = time.perf_counter() - began
        size = sum(path.stat().st_size for path in (out / "records").rglob("*") if path.is_file())
    if finished.table is None:
        raise SystemExit(f"it has not come to its end: {finished.failures}")
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return Result(
        name=f"the paper's {len(plan.planned)} runs of 8 s",
        value=took / 60.0,
        bound=4.0,
        unit="min",
        detail=f"{(usage.ru_utime + usage.ru_stime) / 60.0:.1f} min of processor time, recordings "
        f"{size / 1e6:.0f} MB (bound 200)",
    )


def bench_kills(count: int = 10) -> Result:
    """Campaigns killed at random instants and gone on with, whose table is another one."""
    chance, wrong = random.Random(count), 0
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        plan = swings(SHORT, home)
        ran(plan, home / "whole", SerialExecutor())
        wanted = (home / "whole" / "table.parquet").read_bytes()
        program = home / "program.py"
        program.write_text(PROGRAM.format(scripts=str(Path(__file__).parent)))
        longest, kills = 4.0, 0
        for number in range(count):
            out = home / f"out{number}"
            command = [sys.executable, str(program), str(home / "campaign.toml"), str(out)]
            for which in ("serial", "local"):
                with subprocess.Popen([*command, which]) as process:
                    try:
                        process.wait(chance.uniform(0.5, longest))
                    except subprocess.TimeoutExpired:
                        process.kill()
                kills += process.returncode == -signal.SIGKILL
            before = {path: path.read_bytes() for path in out.glob("shards/*.parquet")}
            ran(plan, out, SerialExecutor(), 2)
            same = all(path.read_bytes() == content for path, content in before.items())
            hashes = set(read_table(out)["experiment"].to_pylist())
            same &= (out / "table.parquet").read_bytes() == wanted
            wrong += not (same and len(hashes) == len(plan.planned))
    return Result(
        name=f"tables that {kills} kills have changed",
        value=wrong,
        bound=0,
        unit="",
        detail=f"{count} campaigns of {len(plan.planned)} runs, killed twice and gone on with",
    )


BENCHES = {
    "experiments": bench_experiments,
    "shard": bench_shard,
    "setup": bench_setup,
    "memory": bench_memory,
    "dask": bench_dask,
    "kills": bench_kills,
    "paper": bench_paper,
}


def main() -> int:
    """Measure and print; 1 if a target was missed."""
    missed = 0
    words = sys.argv[1:] or [name for name in BENCHES if name != "paper"]
    if unknown := {word for word in words if not word.isdigit()} - BENCHES.keys():
        print(f"no benchmark {', '.join(sorted(unknown))}; there are {', '.join(BENCHES)}")
        return 2
    numbers = [int(word) for word in words if word.isdigit()]
    for name in (word for word in words if not word.isdigit()):
        bench = BENCHES[name]
        result = bench_kills(*numbers[:1]) if bench is bench_kills else bench()
        met = result.value <= result.bound
        missed += not met
        verdict = "ok" if met else "MISSED"
        measured = f"{result.value:6.2f} {result.unit:<3} (bound {result.bound:g})"
        print(f"{verdict:<6} {result.name:<32} {measured}  {result.detail}", flush=True)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
