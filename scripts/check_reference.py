"""The batched reference of hops against scipy's DOP853.

    python scripts/check_reference.py [--smooth 100] [--hops 200] [--seed 0]

Two things are compared. Smooth motions of random legs take the steps that `solve_ivp` takes, and
end in the same states. Whole hops, with their events, are those of a scalar program on scipy's
DOP853 and the package's own equations, events and rules of its own; both at their finest. Exit
status 1 if a step count differs, or events, or a state by more than 1e-10.
"""

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

sys.path.append(str(Path(__file__).parents[1] / "tests" / "modes"))

from dense_hop import DenseHop  # pyright: ignore[reportMissingImports]
from dense_rules import Rules  # pyright: ignore[reportMissingImports]
from random_hops import Case, random_case  # pyright: ignore[reportMissingImports]
from reference.dop853 import Accuracy, Rates, attempt
from reference.hops import Hops
from reference.verdicts import FINER, FINEST, UNITS, difference

from legbench.analytic import LegModel
from legbench.errors import LegbenchError
from legbench.signals import Floats, Ints

BOUND = 1e-10
"""Largest difference of states, in units of the map, or in rad and rad/s [-]."""
DURATION, FIRST = 0.6, 1e-3
"""Length of a smooth motion, and of its first step [s]."""


def followed(rates: Rates, state: Floats, accuracy: Accuracy) -> tuple[Floats, Ints]:
    """States (m, n) after the duration, and the numbers of steps (n,)."""
    time, step = np.zeros(state.shape[1]), np.full(state.shape[1], FIRST)
    rejected, taken = np.zeros(time.size, dtype=bool), np.zeros(time.size, dtype=np.int64)
    while (runs := time < DURATION).any():
        left = DURATION - time
        length = np.minimum(step, left)
        tried = attempt(rates, state, length, accuracy)
        goes, factor = tried.accepted & runs, tried.factor
        factor = np.where(rejected & tried.accepted, np.minimum(factor, 1.0), factor)
        state = np.where(goes, tried.reached, state)
        time = np.where(goes, np.where(length >= left, DURATION, time + length), time)
        step, rejected, taken = length * factor, ~tried.accepted, taken + goes
    return state, taken


def smooth(cases: list[Case], accuracy: Accuracy) -> int:
    """Print how smooth motions differ; return the number of those that do."""
    lanes = _hops(cases).lanes
    lanes.touched[:] = False
    states, taken = followed(lanes.rates, lanes.y, accuracy)
    worst, wrong = 0.0, 0
    for index in range(len(cases)):
        lane = lanes.take(np.array([index]))

        def rates(_time: float, y: Any, lane: Any = lane) -> Any:
            return lane.rates(y[:, np.newaxis])[:, 0]

        solved = solve_ivp(
            rates,
            (0.0, DURATION),
            lanes.y[:, index],
            method="DOP853",
            rtol=accuracy.relative,
            atol=accuracy.absolute,
            first_step=FIRST,
        )
        apart = float(np.max(np.abs(solved.y[:, -1] - states[:, index])))
        worst = max(worst, apart)
        wrong += apart > BOUND or len(solved.t) - 1 != taken[index]
    print(
        f"{len(cases)} smooth motions of {DURATION} s, {np.sum(taken)} steps: {wrong} differ from "
        f"solve_ivp in steps or states, largest difference {worst:.1e}"
    )
    return wrong


def whole(cases: list[Case]) -> int:
    """Print how whole hops differ; return the number of those that do."""
    errors, wrong, events = [], 0, 0
    stories = _hops(cases, FINEST, FINER).run()
    for case, story in zip(cases, stories, strict=True):
        rules, start = Rules(case.config, case.design), case.start
        dense = DenseHop(LegModel.of(case.design), rules, 1e-3, FINEST.relative)
        other = dense.run(start.height, start.speed, *start.angles())
        fault, error = difference(other, story), 0.0
        if other.ending == story.ending == "apex":
            error = float(np.max(np.abs(np.subtract(other.apex, story.apex)) / UNITS))
        events += len(story.events)
        errors.append(error)
        if fault or error > BOUND:
            wrong += 1
            print(f"  {fault or 'error'} {error:.1e}\n    scipy     {other}\n    reference {story}")
    print(
        f"{len(cases)} hops with {events} events: {wrong} differ from scipy's DOP853, "
        f"median {np.median(errors):.1e}, largest {max(errors):.1e}"
    )
    return wrong


def _hops(cases: list[Case], accuracy: Accuracy | None = None, longest: float = 1.0) -> Hops:
    starts = np.array([case.start.vector() for case in cases]).T
    designs, configs = [case.design for case in cases], [case.config for case in cases]
    return Hops(designs, configs, starts, accuracy, longest)


def _cases(count: int, seed: int) -> list[Case]:
    """Cases that the controller does not refuse."""
    found = []
    while len(found) < count:
        case = random_case(np.random.default_rng(seed))
        seed += 1
        try:
            Rules(case.config, case.design)
        except LegbenchError:
            continue
        found.append(case)
    return found


def main() -> int:
    """Print two lines."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--smooth", type=int, default=100, help="number of smooth motions [-]")
    parser.add_argument("--hops", type=int, default=200, help="number of hops [-]")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first hop [-]")
    flags = parser.parse_args()
    cases = _cases(max(flags.smooth, flags.hops), flags.seed)
    wrong = smooth(cases[: flags.smooth], Accuracy(1e-10, 1e-12))
    return int(wrong + whole(cases[: flags.hops]) > 0)


if __name__ == "__main__":
    raise SystemExit(main())
