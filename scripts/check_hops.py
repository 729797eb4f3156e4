"""Random disturbed hops of random legs on the fast path against DOP853 with dense events.

Exit status 1 if an event is missed, doubled or false, or an error above the bound is not one of a
hop that grazes a condition.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "tests" / "modes"))

from random_hops import compare, random_case

BOUND, MEDIAN = 1e-5, 1e-7
"""Largest error, and its median, in units of the map [-]."""


def main() -> int:
    """Print a line a wrong hop and a summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100_000, help="number of hops")
    parser.add_argument("--seed", type=int, default=0, help="first seed; each hop has its own")
    parser.add_argument("--tolerance", type=float, default=1e-9, help="of the fast path")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after that long")
    flags = parser.parse_args()
    errors, bad, grazing, seen, skipped, began = [], 0, 0, 0, 0, time.monotonic()
    for seed in range(flags.seed, flags.seed + flags.count):
        if time.monotonic() - began > flags.seconds:
            break
        verdict = compare(random_case(np.random.default_rng(seed)), flags.tolerance)
        if verdict is None:
            skipped += 1
            continue
        seen += 1
        if seen % 100 == 0:
            print(f"{seen} hops, {bad} wrong, {grazing} graze", file=sys.stderr, flush=True)
        errors.append(verdict.error)
        if not verdict.same or verdict.error > BOUND:
            grazing += verdict.grazes
            bad += not verdict.grazes
            kind = "grazes" if verdict.grazes else "WRONG"
            print(f"seed {seed}: {kind}, error {verdict.error:.1e}\n{verdict.why}", flush=True)
    median = float(np.median([error for error in errors if error > 0.0] or [0.0]))
    print(
        f"{seen} hops ({skipped} could not begin), tolerance {flags.tolerance:g}: {bad} wrong, "
        f"{grazing} graze; error median {median:.1e}, largest {max(errors, default=0.0):.1e}"
    )
    return int(bad > 0 or median > MEDIAN)


if __name__ == "__main__":
    raise SystemExit(main())
