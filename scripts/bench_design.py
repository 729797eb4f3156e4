"""What `legbench design` and its tolerances cost; the status says whether bounds are kept.

    scripts/bench_design.py             both
    scripts/bench_design.py search      over bare pycma on as many evaluations of an empty function
    scripts/bench_design.py tolerances  time and memory of `check` and `design` with --tolerances

The search and pycma run in cold processes, turn by turn; the ratio is that of the medians. For
tolerances processor time counts, which holds on a busy machine, too.
"""

import json
import os
import statistics
import subprocess
import sys
import time

RUNS = 7
BOUND = 2.5
LONGEST, LARGEST = 10.0, 300.0
"""Bounds of a command with tolerances: processor time [s] and memory [MiB]."""
FLAT = 1.2
"""Largest memory of four times as many legs over that of so many."""
CALL = "import sys; from legbench.cli import main; sys.exit(main(sys.argv[1:]))"
BARE = """
import sys
import cma
left = int(sys.argv[1])
options = {"bounds": [0.0, 1.0], "popsize": 20, "verbose": -9, "verb_log": 0, "seed": 1}
strategy = cma.CMAEvolutionStrategy(7 * [0.5], 0.3, options)
while left > 0:
    points = strategy.ask()
    strategy.tell(points, [0.0] * len(points))
    left -= len(points)
"""


def seconds(command: list[str]) -> tuple[float, str]:
    """Wall time of a cold process [s], and what it printed."""
    began = time.perf_counter()
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return time.perf_counter() - began, done.stdout


def used(*words: str) -> tuple[float, float]:
    """Processor time [s] and largest memory [MiB] of a legbench command in a cold process."""
    process = subprocess.Popen([sys.executable, "-c", CALL, *words], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 1):
        raise SystemExit(f"legbench {' '.join(words)} ended with {process.returncode}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0


def bench_tolerances() -> bool:
    """Time and memory of scattered legs; whether they keep their bounds, with memory flat."""
    wide = ("--tolerances", "default")
    commands = {
        "check, 1000 legs": ("check", *wide, "--legs", "1000"),
        "check, 4000 legs": ("check", *wide, "--legs", "4000"),
        "design, 800 evaluations": ("design", "--requirements", "paper", *wide),
    }
    found = {name: used(*words) for name, words in commands.items()}
    for name, (cpu, memory) in found.items():
        print(f"{name:<24} {cpu:5.1f} s of processor time, {memory:.0f} MiB")
    growth = found["check, 4000 legs"][1] / found["check, 1000 legs"][1]
    print(f"memory of 4000 legs over that of 1000: {growth:.2f} (bound {FLAT})")
    bounded = (found["check, 1000 legs"], found["design, 800 evaluations"])
    return growth <= FLAT and all(cpu <= LONGEST and mib <= LARGEST for cpu, mib in bounded)


def bench_search() -> bool:
    """Run search and bare pycma in turns; whether the ratio keeps its bound."""
    design = [sys.executable, "-c", CALL, "design", "--requirements", "paper", "--json"]
    _, printed = seconds(design)
    evaluations = json.loads(printed)["evaluations"]
    bare = [sys.executable, "-c", BARE, str(evaluations)]
    seconds(bare)
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(RUNS):
        times[0].append(seconds(design)[0])
        times[1].append(seconds(bare)[0])
    ours, theirs = (statistics.median(part) for part in times)
    ratio = ours / theirs
    print(f"legbench design   {ours:.3f} s, {evaluations} evaluations")
    print(f"bare pycma        {theirs:.3f} s")
    print(f"ratio             {ratio:.2f} (bound {BOUND})")
    return ratio <= BOUND


BENCHES = {"search": bench_search, "tolerances": bench_tolerances}


def main() -> int:
    """Measure and print; 1 if a bound was missed."""
    if unknown := set(sys.argv[1:]) - BENCHES.keys():
        print(f"no benchmark {', '.join(sorted(unknown))}; there are {', '.join(BENCHES)}")
        return 2
    kept = [BENCHES[name]() for name in sys.argv[1:] or BENCHES]
    return 0 if all(kept) else 1


if __name__ == "__main__":
    sys.exit(main())
