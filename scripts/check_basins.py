"""Random basin maps over any two coordinates against brute force; status 1 if a cell differs."""

import argparse
import sys
import time
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "tests" / "modes"))

from brute_basins import differing, random_question

from legbench.design import load_design

ROOT = Path(__file__).parents[1]


def main() -> int:
    """Print a line a map."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--maps", type=int, default=10)
    parser.add_argument("--points", type=int, default=40, help="points a side")
    parser.add_argument("--dense", type=int, default=20, help="cells a map that DOP853 follows")
    parser.add_argument("--seed", type=int, default=0)
    flags = parser.parse_args()
    bad = 0
    for seed in range(flags.seed, flags.seed + flags.maps):
        name = ("prototype", "optimal", "table2")[seed % 3]
        question = random_question(
            load_design(ROOT / "models" / f"{name}.toml"), seed, flags.points
        )
        began = time.monotonic()
        wrong, edges = differing(question, flags.dense, seed)
        bad += len(wrong)
        print(
            f"map {seed}, {name}, {question.across.name} and {question.up.name}: {len(wrong)} of "
            f"{flags.points**2} cells differ, {edges} on an edge, "
            f"{time.monotonic() - began:.0f} s",
            *wrong,
            sep="\n  ",
            flush=True,
        )
    return int(bad > 0)


if __name__ == "__main__":
    raise SystemExit(main())
