"""Long runs and many runs: peak memory and time of what reads recordings.

    scripts/bench_records.py long [FOLDER [NAME ...]]   replay, figure, rrd and export of 600 s
                                             and 3600 s, also of part of a run beside another
    scripts/bench_records.py runs [FOLDER]   `legbench runs` over 1000 runs, cold and warm

A long run is a recorded jump whose limit cycle is repeated. Each command is a process of its own;
its peak is what the kernel counted (ru_maxrss), its time that of the processor.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from legbench.metrics import Analysis
from legbench.recording.archive import write_archive
from legbench.recording.manifest import write_manifest
from legbench.recording.reader import load

ROOT = Path(__file__).parents[1]
CALL = "import sys; from legbench.cli import main; sys.exit(main(sys.argv[1:]))"
SHORT, LONG = 600.0, 3600.0
"""Lengths of the two runs [s]."""
PEAK_MIB, RATIO = 1024.0, 6.5
RUNS, COLD, WARM = 1000, 10.0, 1.0
ITSELF = "the run itself"
"""Stands for the folder of the run that is read."""
PART = ["replay", "--json", "--from", "10"]
RECORDED = 8.0
"""Length of the jump that is recorded and repeated [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """What a command cost."""

    cpu: float
    """Processor time [s]."""
    wall: float
    """Time until it ended [s]."""
    peak_mib: float
    """Largest resident memory [MiB]."""


def cost_of(*arguments: str | Path) -> Cost:
    """Run a legbench command in a process of its own."""
    command = [sys.executable, "-c", CALL, *map(str, arguments)]
    begin = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"legbench {' '.join(command[3:])} ended with {process.returncode}")
    return Cost(
        cpu=usage.ru_utime + usage.ru_stime,
        wall=time.monotonic() - begin,
        peak_mib=usage.ru_maxrss / 1024.0,
    )


def jump(folder: Path) -> Path:
    """Record a jump of the prototype."""
    design = ROOT / "models/prototype.toml"
    cost_of("run", "jump", "--design", design, "--duration", str(RECORDED), "--out", folder)
    return max(folder.iterdir())


def long_run(recorded: Path, path: Path, duration: float) -> Path:
    """Write a run that begins as a recorded one and repeats its limit cycle.

    Args:
        recorded: folder of the run.
        path: folder to write.
        duration: its length [s].
    """
    recording = load(recorded)
    jumps = Analysis(recording).gait.jumps
    first, stop = np.searchsorted(recording.time, [jumps.start[len(jumps) // 2], jumps.end[-1]])
    table = parquet.read_table(recorded / "samples.parquet")
    rows = round(1000 * duration)
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir(parents=True)
    manifest = recording.manifest | {"id": path.name, "rows": rows, "duration": duration - 1e-3}
    write_archive(path, Repeated(table, int(first), int(stop), rows), manifest)  # pyright: ignore
    write_manifest(path, manifest)
    (path / "events.jsonl").touch()
    return path


class Repeated:
    """Batches of a run whose rows [first, stop) are repeated, as `write_archive` takes them."""

    def __init__(self, table: pa.Table, first: int, stop: int, rows: int) -> None:
        self.schema = table.schema
        self._table, self._first, self._stop, self._rows = table, first, stop, rows

    def __iter__(self) -> Iterator[pa.RecordBatch]:
        """Yield batches of which none holds more than the repeated rows."""
        done, part = 0, self._table.slice(0, self._stop)
        while done < self._rows:
            part = part.slice(0, self._rows - done)
            times = pa.array(1_000_000 * np.arange(done, done + part.num_rows))
            timed = part.set_column(0, self.schema.field(0), times)
            yield from timed.combine_chunks().to_batches()
            done += part.num_rows
            part = self._table.slice(self._first, self._stop - self._first)


def long(folder: Path) -> bool:
    """Measure what reads long runs; whether every bound is met."""
    recorded = jump(folder / "recorded")
    runs = [long_run(recorded, folder / f"{each:g}s", each) for each in (SHORT, LONG)]
    met = True
    for name, arguments in (
        ("replay", ["replay", "--json"]),
        ("figure", ["replay", "--json", "--figure", folder / "figure.png"]),
        ("rrd", ["replay", "--json", "--rrd", folder / "run.rrd"]),
        ("beside", ["replay", "--json", "--rrd", folder / "two.rrd", "--against", ITSELF]),
        ("part", [*PART, "--rrd", folder / "part.rrd", "--against", ITSELF]),
        ("figures", ["replay", "--json", "--figure", folder / "two.png", "--against", ITSELF]),
        ("parquet", ["export", "--parquet", "--out", folder / "run.parquet"]),
        ("csv", ["export", "--csv", "--out", folder / "run.csv"]),
        ("mat", ["export", "--mat", "--out", folder / "run.mat"]),
        ("mcap", ["export", "--mcap", "--out", folder / "run.mcap"]),
    ):
        if ONLY and name not in ONLY:
            continue
        first, *rest = arguments
        short, whole = (
            cost_of(first, run, *(run if each == ITSELF else each for each in rest)) for run in runs
        )
        ratio = whole.cpu / short.cpu
        fine = whole.peak_mib <= PEAK_MIB and ratio <= RATIO
        met &= fine
        print(
            f"{'ok' if fine else 'MISSED':<7} {name:<8} {whole.cpu:6.1f} s for {LONG:g} s, "
            f"{ratio:4.2f} times that of {SHORT:g} s (bound {RATIO:g}); peak "
            f"{whole.peak_mib:5.0f} MiB (bound {PEAK_MIB:g}; {short.peak_mib:.0f} for {SHORT:g} s)",
            flush=True,
        )
    return met


def many(folder: Path) -> bool:
    """Measure the listing of many runs; whether both bounds are met."""
    recorded, parent = jump(folder / "recorded"), folder / "many"
    for number in range(RUNS):
        path = parent / f"{recorded.name}-{number}"
        shutil.copytree(recorded, path, dirs_exist_ok=True)
    index = folder / "cache"
    shutil.rmtree(index, ignore_errors=True)
    os.environ["XDG_CACHE_HOME"] = str(index)
    costs = [cost_of("runs", parent, "--json") for _ in range(2)]
    met = costs[0].wall <= COLD and costs[1].wall <= WARM
    told = ", ".join(
        f"{name} {cost.wall:.2f} s (processor {cost.cpu:.2f} s, bound {bound:g})"
        for name, cost, bound in zip(("cold", "warm"), costs, (COLD, WARM), strict=True)
    )
    print(f"{'ok' if met else 'MISSED':<7} {RUNS} runs: {told}; load {os.getloadavg()[0]:.1f}")
    return met


ONLY = sys.argv[3:]
"""Names of the commands to measure; none: all."""


def main(arguments: list[str]) -> int:
    """Measure what is asked for; 1 if a bound is missed."""
    parts = {"long": long, "runs": many}
    if not arguments or arguments[0] not in parts:
        print(__doc__, file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(arguments[1]) if len(arguments) > 1 else Path(temporary)
        return 0 if parts[arguments[0]](folder) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
