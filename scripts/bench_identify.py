"""How fast identification is: compiled anew, against pycma on the same residual, against a peer.

    python scripts/bench_identify.py [--peer]

Three steps of 3 s of the prototype, noise of 0.1 deg, start 30 % off. Times are of processor and
wall; on a machine that others use, ratios and evaluations are what counts. pycma minimises the very
sum of squares, in the same logarithms, from the same start, until it is within 1 % of a standard
error of our optimum in every parameter. `--peer` runs `mujoco.sysid` instead, with k, d and the
start of each run free as they are here. pycma is ended when it has taken `ENOUGH` times our time
without arriving, the peer at `PEER_ENOUGH` times: it is at least so many times slower.
"""

import argparse
import os
import pickle
import resource
import signal
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
from legbench.identify import IdentificationTask, identify, parse_free
from legbench.identify.base import LegParameters
from legbench.identify.fitting import fit
from legbench.identify.prediction import Guess, nothing_moved
from legbench.identify.problem import Problem
from legbench.identify.trial import FIXED, FitTrial, trial_of
from legbench.imperfections import Imperfections
from legbench.mjcf.options import Linkage, LinkageKind

DESIGN = load_design(Path(__file__).parents[1] / "models" / "prototype.toml")
OFF = replace(DESIGN, stiffness=(3.0, 1.7), damping=(0.0065, 0.0095))
ENOUGH = 50.0
"""Processor time, as a multiple of ours, at which pycma is ended [-]."""
PEER_ENOUGH = 500.0
"""Processor time, as a multiple of ours, at which `mujoco.sysid` is ended [-]; it is let run to the
end where it can, since accuracy is compared, too."""
CLOSE = 0.01
"""Part of a standard error within which pycma counts as having arrived [-]."""
FREED = {
    "4 free": parse_free(["k1", "k2", "d1", "d2"], start=False),
    "10 free": parse_free(["nine", "delay"], start=False),
}


def steps() -> tuple[FitTrial, ...]:
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


def against_cma(trials: tuple[FitTrial, ...], name: str) -> None:
    """Compare evaluations and processor time with pycma's."""
    leg = LegParameters.of(OFF)
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

    before = time.process_time()

    def enough(_: object) -> bool:
        return time.process_time() - before > ENOUGH * mine

    options = {"verbose": -9, "seed": 1, "ftarget": close, "tolfun": 0.0, "tolfunhist": 0.0,
               "tolx": 1e-12, "termination_callback": enough}  # fmt: skip
    search = cma.CMAEvolutionStrategy(len(matrix) * [0.0], 0.2, options)
    search.optimize(cost)
    theirs = time.process_time() - before
    arrived = "arrived" if search.result.fbest <= close else "did not arrive"
    print(
        f"{name}: ours {ours.evaluations} evaluations, {mine:.2f} s of CPU; pycma "
        f"{search.result.evaluations}, {theirs:.1f} s ({arrived}): {theirs / mine:.1f} times",
        flush=True,
    )


COLD = """
import time, os
began = time.perf_counter(), time.process_time()
import pickle, sys
trials, design = pickle.load(open(sys.argv[1], "rb"))
from legbench.identify import IdentificationTask, identify
outcome = identify(IdentificationTask(design=design, trials=trials))
now = time.perf_counter(), time.process_time()
print(f"k, d of three runs, everything imported and compiled anew: {now[0] - began[0]:.2f} s, "
      f"{now[1] - began[1]:.2f} s of CPU, {outcome.evaluations} evaluations, "
      f"trusted: {outcome.trusted}")
"""


def cold(trials: tuple[FitTrial, ...], folder: Path) -> None:
    """Identify k and d in a new process whose store of compiled integrators is empty."""
    path = folder / "trials.pickle"
    path.write_bytes(pickle.dumps((trials, OFF)))
    for store in ("", str(folder / "store"), str(folder / "store")):
        environment = os.environ | {"LEGBENCH_CACHE": store}
        print(f"store {'none' if not store else 'new, then filled'}: ", end="", flush=True)
        subprocess.run([sys.executable, "-c", COLD, str(path)], env=environment, check=True)


PEER = """
import pickle, resource, sys
trials, design = pickle.load(open(sys.argv[1], "rb"))
from legbench.identify import IdentificationTask
from legbench.identify.peer import ask_peer
limit = int(resource.getrusage(resource.RUSAGE_SELF).ru_utime + float(sys.argv[2])) + 1
resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
answer = ask_peer(IdentificationTask(design=design, trials=trials))
pickle.dump(answer, open(sys.argv[1] + ".answer", "wb"))
"""


def against_sysid(trials: tuple[FitTrial, ...], name: str, folder: Path) -> None:
    """Compare the whole of an identification with the search of `mujoco.sysid` alone."""
    identify(IdentificationTask(design=OFF, trials=trials))  # compiled
    before = time.process_time()
    outcome = identify(IdentificationTask(design=OFF, trials=trials))
    mine = time.process_time() - before
    path = folder / "peer.pickle"
    path.write_bytes(pickle.dumps((trials, OFF)))
    before = cpu_of_children()
    command = [sys.executable, "-c", PEER, str(path), str(PEER_ENOUGH * mine)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    theirs = cpu_of_children() - before
    said = f"mujoco.sysid, {name}: {theirs:.0f} s of CPU against {mine:.2f} s of ours"
    answer = path.with_name(path.name + ".answer")
    if not answer.exists():
        ended = "has not arrived" if done.returncode == -signal.SIGXCPU else done.stderr[-500:]
        print(f"{said}, {ended}: more than {theirs / mine:.0f} times", flush=True)
        return
    found = pickle.loads(answer.read_bytes())
    off = [
        (each.name, round((found.values[each.name] - each.value) / each.error, 2))
        for each in outcome.estimates
    ]
    print(f"{said}: {theirs / mine:.0f} times; off ours by {off} standard errors", flush=True)


def cpu_of_children() -> float:
    """Processor time of all processes that were started and have ended [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def shortened(trials: tuple[FitTrial, ...], duration: float) -> tuple[FitTrial, ...]:
    """First part of runs [s]."""
    rows = round(duration / trials[0].period)
    return tuple(
        replace(
            each,
            time=each.time[:rows],
            motor_pos=each.motor_pos[:rows],
            joint_pos=each.joint_pos[:rows],
            applied_pos=each.applied_pos[:rows],
        )
        for each in trials
    )


def main() -> None:
    """Run the comparisons."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peer", action="store_true", help="run mujoco.sysid instead")
    asked = parser.parse_args()
    print("load", os.getloadavg())
    trials = steps()
    with tempfile.TemporaryDirectory() as folder:
        if asked.peer:
            for duration in (0.6, 3.0):
                name = f"three steps of {duration:g} s"
                against_sysid(shortened(trials, duration), name, Path(folder))
            return
        cold(trials, Path(folder))
    for name in FREED:
        against_cma(trials, name)


if __name__ == "__main__":
    main()
