"""How punctual a run over SocketCAN is: `legbench run jump` against `legbench drives emulate`.

Master and drives are processes of their own on the interface vcan0; behind the drives hangs
MuJoCo's leg with all its bars. What is printed comes from the run's folder. Ends with 1 unless
every tick was kept and every answer came.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import can
import numpy as np
from processes import BUS, Child, drives_on, ip, legbench

from legbench.recording.reader import Recording, load
from legbench.signals import Floats

SYNC, ANSWERS = 0x080, (0x181, 0x182)
QUANTILES = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999, "max": 1.0}
LOOK_EVERY = 2.0
"""Between two looks at the processes [s]."""
Shares = list[tuple[float, float]]
"""Processor time of master and drives, as parts of the time that passed."""


def watch(run: Child, drives: Child) -> Shares:
    """Look on until the run has ended."""
    began = time.monotonic()
    shares: Shares = []
    before = None
    while not run.ended():
        if drives.ended():
            run.end()
            break
        now = (time.monotonic(), run.spent_ns, drives.spent_ns)
        if before is not None:
            span = 1e9 * (now[0] - before[0])
            shares.append(((now[1] - before[1]) / span, (now[2] - before[2]) / span))
            print(f"  {now[0] - began:3.0f} s of the guest's time", flush=True)
        before = now
        time.sleep(LOOK_EVERY)
    return shares


def exchanges(log: Path, began: float) -> Floats:
    """From SYNC to the last answer, one value for each whole cycle since `began` [us]."""
    took, sync, last, missing = [], 0.0, 0.0, 0
    with can.CanutilsLogReader(log) as frames:
        for frame in frames:
            if frame.arbitration_id == SYNC:
                if sync >= began and missing == 0:
                    took.append(1e6 * (last - sync))
                sync, missing = frame.timestamp, len(ANSWERS)
            elif frame.arbitration_id in ANSWERS:
                last, missing = frame.timestamp, missing - 1
    return np.array(took)


def row(name: str, values: Sequence[float] | Floats) -> str:
    """A line of the table."""
    return f"{name:<24}" + "".join(f"{np.quantile(values, at):9.1f}" for at in QUANTILES.values())


def told(recording: Recording, cycles: int, shares: Shares) -> bool:
    """Print what a run left; whether all of it was on time."""
    bus = next(event for event in recording.events if event["name"] == "bus")
    exchange = exchanges(recording.path / "bus.log", bus["began"])
    rows, status = len(recording.time), recording.description.status
    print(f"{rows} cycles of 1 ms, {status}")
    for name, words in recording.manifest["plant"]["realtime"].items():
        print(f"  {name:<11} {words}")
    print(f"{'[us]':<24}" + "".join(f"{name:>9}" for name in QUANTILES))
    print(row("wake-up", recording["late_us"]))
    print(row("exchange", exchange))
    print(row("cycle", recording["cycle_us"][1:]))
    for place, name in enumerate(("master", "drives and leg") if shares else ()):
        part = float(np.median([share[place] for share in shares]))
        print(f"processor, {name:<15} {1e3 * part:6.1f} a cycle")
    lost = sum(bus["lost_cycles"])
    print(f"{bus['skipped_cycles']} overruns, {lost} lost, {bus['late_frames']} late frames")
    whole = status == "complete" and rows == cycles and len(exchange) >= cycles
    return whole and bus["skipped_cycles"] == lost == 0


def measured(folder: Path, cycles: int) -> int:
    """Run, print, judge."""
    with drives_on(folder) as drives:
        run = legbench(
            folder / "run.txt",
            *("run", "jump", "--plant", "can", *BUS, "--duration", str(1e-3 * cycles)),
            *("--out", str(folder / "runs")),
        )
        try:
            shares = watch(run, drives.child)
        finally:
            run.end()
    print(run.text)
    if run.status != 0:
        print(f"the run ended with {run.status}; the drives: {drives.child.text[-2000:]}")
        return 1
    (run_folder,) = (folder / "runs").iterdir()
    return 0 if told(load(run_folder), cycles, shares) else 1


def main() -> int:
    """Measure on vcan0, which is up already."""
    parser = argparse.ArgumentParser(description="How punctual a run over SocketCAN is.")
    parser.add_argument("--cycles", type=int, default=20_000, help="of 1 ms")
    chosen = parser.parse_args()
    ip("link", "set", "vcan0", "up")
    with tempfile.TemporaryDirectory() as folder:
        return measured(Path(folder), chosen.cycles)


if __name__ == "__main__":
    sys.exit(main())
