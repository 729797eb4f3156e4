"""Performance targets, each a ratio against a baseline measured in the same run.

    make bench                 every target
    scripts/bench.py loop row  some of them

Baseline and candidate take turns, so that a machine that changes its speed changes both; the
ratio is the median over the pairs.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
from mujoco import batch

from legbench.control import (
    BangBangConfig,
    Jump,
    JumpConfig,
    LegTargets,
    PositionJumpConfig,
)
from legbench.design import LegDesign, load_design
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import Support
from legbench.experiment import Experiment, record
from legbench.experiment.batch import LegGroup, start_together
from legbench.imperfections import Imperfections
from legbench.kinematics import joint_to_modal, joint_to_polar, joint_to_polar_rate
from legbench.loop import run
from legbench.metrics import summarise
from legbench.mjcf import BuildOptions, rest_qpos
from legbench.plant.batch import BatchPlant
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.recording.columns import Layout
from legbench.recording.reader import Recording, load
from legbench.recording.rows import BATCH_ROWS, RowBlock, RowLayout
from legbench.recording.writer import RunWriter
from legbench.signals import Command, Floats, Observation, Signal
from legbench.viz.live.rrd import write_rrd

MODELS = Path(__file__).parent.parent / "models"
PAIRS = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What was measured, what it had to be."""

    name: str
    value: float
    bound: float
    unit: str
    detail: str


def timed(work: Callable[[], object]) -> float:
    """Wall time of a call [s]."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def ratio_of(candidate: Callable[[], object], baseline: Callable[[], object]) -> tuple[float, str]:
    """Median of candidate over baseline, in turns after a warm-up, and the medians in words."""
    candidate()
    baseline()
    pairs = [(timed(candidate), timed(baseline)) for _ in range(PAIRS)]
    ratio = statistics.median(ours / bare for ours, bare in pairs)
    ours, bare = (statistics.median(column) for column in zip(*pairs, strict=True))
    return ratio, f"{1e3 * ours:.0f} ms against {1e3 * bare:.0f} ms"


def prototype() -> LegDesign:
    """The leg of every benchmark."""
    return load_design(MODELS / "prototype.toml")


def hopping(designs: LegDesign | list[LegDesign]) -> tuple[Jump, Start]:
    """The jump controller and its start."""
    targets = LegTargets(designs=designs, support=Support.FOOT)
    controller = Jump(JumpConfig(), targets)
    motor_pos = controller.start_motor_pos
    return controller, Start(joint_pos=targets.link_at_rest(motor_pos), motor_pos=motor_pos)


def played(plant: SimPlant, controller: Jump, cycles: int) -> Floats:
    """Motor positions (cycles, 2) of a closed-loop run, so that a bare loop repeats its motion."""
    observation = plant.reset()
    controller.reset(observation)
    targets = np.empty((cycles, 2))
    for cycle in range(cycles):
        command = controller.step(observation)
        targets[cycle] = command.motor_pos
        observation = plant.step(command)
    return targets


def bench_loop() -> Result:
    """Closed loop with recording against bare `mj_step` of the same model and steps."""
    cycles = 8000
    controller, start = hopping(prototype())
    plant = SimPlant(prototype(), BuildOptions(), start)

    with tempfile.TemporaryDirectory() as folder:

        def ours() -> None:
            with RunWriter.create(Path(folder), {}, name="bench") as writer:
                run(plant, controller, cycles, sink=writer)

        def bare() -> None:
            plant.reset()
            for _ in range(cycles):
                mujoco.mj_step(plant.model, plant.data, 4)

        ratio, detail = ratio_of(ours, bare)
    return Result(
        name="loop with recording / mj_step", value=ratio, bound=1.25, unit="x", detail=detail
    )


def bench_batch() -> Result:
    """512 legs with their controller against bare `mujoco.batch`."""
    legs, cycles = 512, 60
    controller, start = hopping([prototype()] * legs)
    plant = BatchPlant([prototype()] * legs, BuildOptions(), start)
    bare = standing_batch(plant, start, cycles)
    ratio, detail = ratio_of(lambda: run(plant, controller, cycles), bare)
    return Result(
        name="batch of 512 / mujoco.batch", value=ratio, bound=1.3, unit="x", detail=detail
    )


def standing_batch(plant: BatchPlant, start: Start, cycles: int) -> Callable[[], None]:
    """Bare steps of as many legs of the plant's first model, which stand at their starts."""
    legs = len(start.joint_pos)
    raw = batch.Batch(plant.model, nsim=legs, nthread=plant.threads)
    qpos, ctrl = raw.bind("qpos"), raw.bind("ctrl")
    rest = np.array([rest_qpos(plant.model, prototype(), row) for row in start.joint_pos])

    def bare() -> None:
        raw.reset()
        qpos[:], ctrl[:] = rest, start.motor_pos
        for _ in range(cycles):
            raw.step(nstep=4)

    return bare


def bench_experiments() -> Result:
    """Experiments of 280 legs, each at a set point of its own, with rows, against bare steps."""
    legs, cycles = 280, 200
    chosen = [
        Experiment(
            design=prototype(),
            controller=BangBangConfig(z2=0.7 + 0.001 * leg, delay=0.01),
            setup=Setup(kind=SetupKind.FFS),
            duration=1e-3 * cycles,
        )
        for leg in range(legs)
    ]
    group = LegGroup(chosen)
    _, start = start_together(chosen)
    bare = standing_batch(group.open(), start, cycles)
    ratio, detail = ratio_of(lambda: group.run(None, None, 0, cycles), bare)
    return Result(
        name="280 experiments / mujoco.batch",
        value=ratio,
        bound=1.0 / 0.85,
        unit="x",
        detail=detail,
    )


def bench_setup() -> Result:
    """Setting up a batch of 280 legs that all differ, in CPU time for each leg."""
    legs = 280
    scale = 1.0 + 0.05 * np.linspace(-1.0, 1.0, legs)
    chosen = [
        Experiment(
            design=prototype(),
            controller=PositionJumpConfig(z2=0.9, dz2=0.1),
            setup=Setup(kind=SetupKind.FFS),
            imperfections=Imperfections(stiffness_error=(share - 1.0, 0.0)),
        )
        for share in scale.tolist()
    ]
    group = LegGroup(chosen)
    times = []
    for _ in range(PAIRS):
        began = time.process_time()
        start_together(chosen)
        group.open()
        times.append(1e3 * (time.process_time() - began) / legs)
    return Result(
        name="set-up of a leg of a batch",
        value=min(times),
        bound=1.0,
        unit="ms",
        detail=f"median {statistics.median(times):.2f} ms",
    )


def bench_row() -> Result:
    """A row written in the loop, without what it waits for nothing."""
    rows = 20000
    command, observation = first_cycle()
    costs = np.empty(rows)
    with (
        tempfile.TemporaryDirectory() as folder,
        RunWriter.create(Path(folder), {}, name="bench") as writer,
    ):
        for index in range(rows):
            began = time.perf_counter_ns()
            writer.append(command, observation, 0.0, 0.0)
            costs[index] = time.perf_counter_ns() - began
    median, high = np.percentile(costs, (50, 99)) / 1e3
    return Result(
        name="row in the loop", value=median, bound=5.0, unit="us", detail=f"p99 {high:.1f} us"
    )


def first_cycle() -> tuple[Command, Observation]:
    """What is recorded of the first cycle of a hop."""
    controller, start = hopping(prototype())
    observation = SimPlant(prototype(), BuildOptions(), start).reset()
    controller.reset(observation)
    return controller.step(observation), observation


def bench_own_signals() -> Result:
    """Four signals of the controller's own in each row against a row without any."""
    command, observation = first_cycle()
    telling = replace(command, signals=np.zeros(4))
    own = tuple(Signal(f"own{place}", (), "-", "") for place in range(4))
    plain, full = RowBlock(), RowBlock(RowLayout(Layout(own=own)))

    def fill(block: RowBlock, given: Command) -> None:
        for _ in range(400):
            block.count = 0
            for _ in range(BATCH_ROWS):
                block.put(given, observation, 0.0, 0.0)

    ratio, detail = ratio_of(lambda: fill(full, telling), lambda: fill(plain, command))
    return Result(
        name="row with own signals / without", value=ratio, bound=1.15, unit="x", detail=detail
    )


SUMMARIES = 20
"""Summaries in one measurement: one alone takes some milliseconds."""
SUMMARY_BEFORE = 10.5
"""Time of a summary in yardsticks while each figure still read the manifest and the rows for
itself: median of ten measurements of that code, each seven pairs in turns with the yardstick."""


def bench_summarise() -> Result:
    """The summary of an 8 s hop, of which the rows are read once, over what it took before.

    The yardstick is five times the coordinates of all rows, which are computed as ever.
    """
    with tempfile.TemporaryDirectory() as folder:
        experiment = Experiment(design=prototype(), controller=JumpConfig())
        recording = load(record(experiment, Path(folder)).path)

    def ours() -> None:
        for _ in range(SUMMARIES):
            summarise(recording)

    ratio, detail = ratio_of(ours, lambda: coordinates(recording))
    return Result(
        name="summary of 8 s / before",
        value=ratio / SUMMARY_BEFORE,
        bound=0.5,
        unit="x",
        detail=f"{ratio:.2f} yardsticks, {SUMMARY_BEFORE:g} before; {detail}",
    )


def coordinates(recording: Recording) -> None:
    """Compute polar and modal coordinates and rates of a run, five times a summary."""
    length = prototype().shank.length
    for _ in range(5 * SUMMARIES):
        joint_pos, joint_vel = recording["joint_pos"], recording["joint_vel"]
        joint_to_polar(joint_pos, length)
        joint_to_polar_rate(joint_pos, joint_vel, length)
        joint_to_modal(joint_pos)
        joint_to_modal(joint_vel)


def bench_rrd() -> Result:
    """An 8 s run to `.rrd` with all plots."""
    with tempfile.TemporaryDirectory() as folder:
        experiment = Experiment(design=prototype(), controller=JumpConfig())
        recording = load(record(experiment, Path(folder)).path)
        target = Path(folder) / "view.rrd"
        write_rrd(recording, target)
        times = [timed(lambda: write_rrd(recording, target)) for _ in range(PAIRS)]
        size = target.stat().st_size
    value = statistics.median(times)
    return Result(
        name="8 s run to .rrd", value=value, bound=0.5, unit="s", detail=f"{size / 1e6:.1f} MB"
    )


def bench_jump() -> Result:
    """The jump controller on one leg, in floats, against the same on a batch of one, in arrays."""
    steps = 4000
    one, _ = hopping(prototype())
    batch_of_one, _ = hopping([prototype()])
    torque, motor_pos = np.array([0.3, -0.3]), np.array([-0.3, 0.3])

    def stepped(controller: Jump, torque: Floats, motor_pos: Floats) -> Callable[[], None]:
        zero = np.zeros(torque.shape)
        seen = Observation(
            time=0.01,
            motor_pos=motor_pos,
            joint_pos=zero,
            joint_vel=zero,
            spring_torque=torque,
            applied_pos=motor_pos,
        )
        controller.reset(seen)

        def run_steps() -> None:
            for _ in range(steps):
                controller.step(seen)

        return run_steps

    rows = (torque[np.newaxis], motor_pos[np.newaxis])
    ratio, detail = ratio_of(
        stepped(one, torque, motor_pos), stepped(batch_of_one, rows[0], rows[1])
    )
    return Result(
        name="jump, one leg / batch of one", value=ratio, bound=0.1, unit="x", detail=detail
    )


def cpu_time(*words: str) -> float:
    """Least CPU time of a fresh Python process with these arguments, its bytecode cached [s]."""
    times = []
    with tempfile.TemporaryDirectory() as cache:
        kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
        environment = kept | {"PYTHONPYCACHEPREFIX": cache}
        for _ in range(1 + PAIRS):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            command = [sys.executable, *words]
            subprocess.run(command, check=True, capture_output=True, env=environment)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(times[1:])


def bench_start(name: str, bound: float, *words: str) -> Result:
    """A fresh process against one that only imports NumPy, in CPU time."""
    bare, ours = cpu_time("-c", "import numpy"), cpu_time(*words)
    detail = f"{1e3 * ours:.0f} ms against {1e3 * bare:.0f} ms"
    return Result(
        name=f"{name} / import numpy", value=ours / bare, bound=bound, unit="x", detail=detail
    )


def bench_first() -> Result:
    """A run of one cycle, from the command line to its summary."""
    with tempfile.TemporaryDirectory() as folder:
        design = str(MODELS / "prototype.toml")
        words = ("-m", "legbench", "run", "jump", "--design", design, "--duration", "0.001")
        return bench_start("run jump of one cycle", 5.0, *words, "--out", folder)


def bench_cold() -> Result:
    """All that a run costs besides its simulation: one cycle, from the shell to the last line."""
    with tempfile.TemporaryDirectory() as folder:
        words = ("-m", "legbench", "run", "jump", "--duration", "0.001", "--out", folder)
        bare, ours = cpu_time("-c", "import numpy"), cpu_time(*words)
    detail = f"CPU time; import numpy takes {1e3 * bare:.0f} ms"
    return Result(name="run jump of one cycle", value=ours, bound=1.5, unit="s", detail=detail)


BENCHES = {
    "loop": bench_loop,
    "batch": bench_batch,
    "experiments": bench_experiments,
    "setup": bench_setup,
    "row": bench_row,
    "own": bench_own_signals,
    "summary": bench_summarise,
    "rrd": bench_rrd,
    "jump": bench_jump,
    "import": lambda: bench_start("import legbench", 0.2, "-c", "import legbench"),
    "help": lambda: bench_start("legbench --help", 0.3, "-m", "legbench", "--help"),
    "run-help": lambda: bench_start("run --help", 3.0, "-m", "legbench", "run", "--help"),
    "first": bench_first,
    "cold": bench_cold,
}


def main() -> int:
    """Measure and print; 1 if a target was missed."""
    missed = 0
    if unknown := set(sys.argv[1:]) - BENCHES.keys():
        print(f"no benchmark {', '.join(sorted(unknown))}; there are {', '.join(BENCHES)}")
        return 2
    for name in sys.argv[1:] or BENCHES:
        result = BENCHES[name]()
        met = result.value <= result.bound
        missed += not met
        verdict = "ok" if met else "MISSED"
        measured = f"{result.value:6.2f} {result.unit:<2} (bound {result.bound:g})"
        print(f"{verdict:<6} {result.name:<32} {measured}  {result.detail}", flush=True)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
