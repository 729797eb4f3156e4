"""What `legbench design` costs over bare pycma on as many evaluations of an empty function.

Both run in cold processes, turn by turn; the ratio of the medians is printed, and the status says
whether it keeps its bound.
"""

import json
import statistics
import subprocess
import sys
import time

RUNS = 7
BOUND = 2.5
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


def main() -> int:
    """Run both in turns."""
    call = "import sys; from legbench.cli import main; sys.exit(main(sys.argv[1:]))"
    design = [sys.executable, "-c", call, "design", "--requirements", "paper", "--json"]
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
    return 0 if ratio <= BOUND else 1


if __name__ == "__main__":
    sys.exit(main())
