"""What a recording costs a loop in real time on a machine that others keep busy.

    scripts/bench_recording.py

Four processes that never wait run beside `legbench drives jitter`, which takes turns: with a
recording, without, without, with. The drives are another process behind a socket. Missed ticks
come in bursts, the machine's and not the program's, so single trials say little: counts are summed
over turns, until those without a recording have come to 30 or 24 turns have passed.
"""

import json
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

ROOT = Path(__file__).parents[1]
CYCLES, BUSY = 5000, 4
ENOUGH, TURNS = 30, 24
BOUND = 1.5
ORDER = ("with", "without", "without", "with")
CALL = "import sys; from legbench.cli import main; sys.exit(main(sys.argv[1:]))"
BUSY_CALL = "while True: pass"
START_TIME = 30.0
"""Longest wait for the drives to be there [s]."""


def legbench(*arguments: str | int | Path) -> list[str]:
    """Return a command line of this interpreter's legbench."""
    return [sys.executable, "-c", CALL, *map(str, arguments)]


def beside(stack: ExitStack, command: list[str]) -> "subprocess.Popen[bytes]":
    """Start a process that ends with the stack."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    stack.callback(process.wait)
    stack.callback(process.kill)
    return process


def bus(channel: Path) -> list[str]:
    """Return the flags that name the emulated leg."""
    flags = ["--bus", ROOT / "hardware/leg.toml", "--design", ROOT / "models/optimal.toml"]
    return [*map(str, flags), "--interface", "legbench_unix", "--channel", str(channel)]


def called(command: list[str]) -> str:
    """Run a command to its end; what it printed."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{command[3:5]} ended with {done.returncode}: {done.stderr}")
    return done.stdout


def trial(channel: Path, recording: str, out: Path) -> dict[str, int]:
    """Measure once; counts by name."""
    command = legbench("drives", "jitter", "--cycles", CYCLES, "--json", *bus(channel))
    told = json.loads(called([*command, "--recording", recording, "--out", str(out)]))
    return {name: told[name] for name in ("skipped", "late", "silent", "lost")}


def main() -> int:
    """Measure and print; 1 if the bound is missed."""
    sums = {"with": 0, "without": 0}
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        channel = Path(folder) / "leg.sock"
        serve = ("drives", "emulate", "--bare", "--patience", 1000)
        beside(stack, legbench(*serve, *bus(channel)))
        deadline = time.monotonic() + START_TIME
        while not channel.exists():
            if time.monotonic() > deadline:
                raise SystemExit("the emulated drives did not start")
            time.sleep(0.05)
        called(legbench("drives", "configure", *bus(channel), "--write"))
        for _ in range(BUSY):
            beside(stack, [sys.executable, "-c", BUSY_CALL])
        for turn in range(TURNS):
            name = ORDER[turn % len(ORDER)]
            counts = trial(channel, name, Path(folder) / "runs")
            sums[name] += counts["skipped"]
            print(f"{name:<8} {counts}", flush=True)
            if turn % len(ORDER) == len(ORDER) - 1 and sums["without"] >= ENOUGH:
                break
    met = sums["with"] <= BOUND * sums["without"]
    verdict = "ok" if met else "MISSED"
    print(
        f"{verdict:<6} skipped ticks under {BUSY} busy processes: {sums['with']} with a recording, "
        f"{sums['without']} without (bound {BOUND:g} times)"
    )
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
