"""How fast identification is: compiled anew, against pycma on the same residual, against a peer.

    python scripts/bench_identify.py [--peer]

Three steps of 3 s of the prototype, noise of 0.1 deg, start 30 % off. Times are of processor and
wall; on a machine that others use, ratios and evaluations are what counts. pycma minimises the very
sum of squares, in the same logarithms, from the same start, until it is within 1 % of a standard
error of our optimum in every parameter. `--peer` runs `mujoco.sysid`, too.
"""

import argparse
import os
import pickle
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import cma
import numpy as np

from legbench.control import PositionJumpConfig
from legbench.design import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.errors import PlantFault
from legbench.experiment import Experiment, run_batch
from legbench.identify import Question, identify, parse_free
from legbench.identify.base import Leg
from legbench.identify.fitting import fit
from legbench.identify.prediction import Guess, nothing_moved
from legbench.identify.problem import Problem
from legbench.identify.trial import FIXED, Trial, trial_of
from legbench.imperfections import Imperfections
from legbench.mjcf.options import Linkage, LinkageKind

DESIGN = load_design(Path(__file__).parents[1] / "models" / "prototype.toml")
OFF = replace(DESIGN, stiffness=(3.0, 1.7), damping=(0.0065, 0.0095))
CLOSE = 0.01
"""Part of a standard error within which pycma counts as having arrived [-]."""
FREED = {
    "4 free": parse_free(["k1", "k2", "d1", "d2"], start=False),
    "10 free": parse_free(["nine", "delay"], start=False),
}


def steps() -> tuple[Trial, ...]:
    """Three steps of 3 s, with noise on the link encoders."""
    noise = float(np.radians(0.1))
    runs = run_batch(
        [
            Experiment(
                design=DESIGN,
                controller=PositionJumpConfig(z2=1.0, dz2=0.3),
                setup=Setup(kind=SetupKind(kind)),
                linkage=Linkage(kind=LinkageKind.REDUCED),
                imperfections=Imperfections(link_noise=(noise, noise)),
                duration=3.0,
                seed=place,
            )
            for place, kind in enumerate(FIXED)
        ]
    )
    return tuple(replace(trial_of(each), name=str(place)) for place, each in enumerate(runs))


def against_cma(trials: tuple[Trial, ...], name: str) -> None:
    """Compare evaluations and processor time with pycma's."""
    leg = Leg.of(OFF)
    problem = Problem(trials, leg.reach, FREED[name])
    start = Guess(values=leg.values, starts=nothing_moved(trials))
    problem.misfit(start)  # compiled
    before = time.process_time()
    ours = fit(problem, start)
    mine = time.process_time() - before
    matrix, _ = ours.misfit.normal()
    close = ours.misfit.cost + CLOSE**2 * len(matrix)

    def cost(step: np.ndarray) -> float:
        try:
            return problem.misfit(problem.stepped(start, np.asarray(step))).cost
        except PlantFault:
            return float("inf")

    options = {"verbose": -9, "seed": 1, "maxfevals": 20_000, "ftarget": close, "tolfun": 0.0,
               "tolfunhist": 0.0, "tolx": 1e-12}  # fmt: skip
    before = time.process_time()
    search = cma.CMAEvolutionStrategy(len(matrix) * [0.0], 0.2, options)
    search.optimize(cost)
    theirs = time.process_time() - before
    arrived = "arrived" if search.result.fbest <= close else "did not arrive"
    print(
        f"{name}: ours {ours.evaluations} evaluations, {mine:.2f} s of CPU; pycma "
        f"{search.result.evaluations}, {theirs:.1f} s ({arrived}): {theirs / mine:.1f} times"
    )


COLD = """
import time, os
began = time.perf_counter(), time.process_time()
import pickle, sys
trials, design = pickle.load(open(sys.argv[1], "rb"))
from legbench.identify import Question, identify
outcome = identify(Question(design=design, trials=trials))
now = time.perf_counter(), time.process_time()
print(f"k, d of three runs, everything imported and compiled anew: {now[0] - began[0]:.2f} s, "
      f"{now[1] - began[1]:.2f} s of CPU, {outcome.evaluations} evaluations, "
      f"trusted: {outcome.trusted}")
"""


def cold(trials: tuple[Trial, ...], folder: Path) -> None:
    """Identify k and d in a new process whose store of compiled integrators is empty."""
    path = folder / "trials.pickle"
    path.write_bytes(pickle.dumps((trials, OFF)))
    for store in ("", str(folder / "store"), str(folder / "store")):
        environment = os.environ | {"LEGBENCH_CACHE": store}
        print(f"store {'none' if not store else 'new, then filled'}: ", end="", flush=True)
        subprocess.run([sys.executable, "-c", COLD, str(path)], env=environment, check=True)


def main() -> None:
    """Run the comparisons."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peer", action="store_true", help="run mujoco.sysid, too")
    asked = parser.parse_args()
    print("load", os.getloadavg())
    trials = steps()
    with tempfile.TemporaryDirectory() as folder:
        cold(trials, Path(folder))
    for name in FREED:
        against_cma(trials, name)
    if asked.peer:
        from legbench.identify.peer import ask_peer  # noqa: PLC0415

        question = Question(design=OFF, trials=trials)
        before = time.perf_counter()
        outcome = identify(question)
        mine = time.perf_counter() - before
        answer = ask_peer(question)
        print("\n".join(answer.lines(outcome)))
        print(f"mujoco.sysid over all of ours: {answer.seconds / mine:.1f} times")


if __name__ == "__main__":
    main()
