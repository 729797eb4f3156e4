"""Try every fault in mid-jump on the emulated leg; the table of docs/drives.md on stdout."""

import tempfile
import time
from pathlib import Path

from legbench.commissioning.fault_table import TRIALS
from legbench.commissioning.fault_trial import Result, try_fault
from legbench.design import load_design
from legbench.viz.live.launch import LiveView, start_live

ROOT = Path(__file__).parents[1]
PATIENCE = 30.0
"""Time that a view may take to begin [s]."""
EXIT = {"complete": 0, "interrupted": 0, "fault": 1}


def row(result: Result) -> str:
    """One line of the table."""
    lost = f"bridged, {result.lost_cycles} lost" if result.lost_cycles else "bridged"
    reaction = lost if result.cycles is None else f"{result.cycles}"
    exit_status = EXIT.get(result.status, "-")
    drives = ", ".join(sorted({state.value for state in result.drives}))
    return (
        f"| {result.name} | {result.cause or result.status} | {reaction} | {drives} | "
        f"{'none' if result.excess <= 0.0 else f'{result.excess:.2g} rad'} | "
        f"{'whole' if result.intact else 'NOT WHOLE'} | {exit_status} |"
    )


def view(run: Path) -> LiveView:
    """A live view that needs no screen and has begun; the run's own time stands meanwhile."""
    started, end = start_live(run, save=run / "live.rrd"), time.monotonic() + PATIENCE
    while not (run / "live.rrd").exists() and time.monotonic() < end:
        time.sleep(0.02)
    return started


def main() -> None:
    """Print the table."""
    print(
        "| fault | ended by | cycles | drives in the end | command beyond limits | recording | "
        "exit |"
    )
    print("|---|---|---|---|---|---|---|")
    design = load_design(ROOT / "models" / "optimal.toml")
    with tempfile.TemporaryDirectory() as folder:
        for trial in TRIALS:
            bus_file = ROOT / "hardware" / "leg.toml"
            print(row(try_fault(trial, bus_file, design, Path(folder), view)))


if __name__ == "__main__":
    main()
