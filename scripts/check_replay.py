"""Replays of reference runs: controllers to the bit, legs to the bit or to the encoders' counts.

Every built-in controller runs on every built-in plant with the legs of the paper, as it is
and, in simulations, imperfect. Prints a line a run and ends with status 1 where a bound is missed.
Words on the command line choose the cases that have one of them in their name, such as `can`.
"""

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from legbench.control import BangBangConfig, ControllerSettings, JumpConfig, PositionJumpConfig
from legbench.design import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.drives.setup.bus_file import load_bus
from legbench.errors import LegbenchError
from legbench.experiment import Experiment, record
from legbench.imperfections import Imperfections
from legbench.plant.landing import End
from legbench.plants import AnalyticChoice, CanChoice, SimChoice
from legbench.recording.reader import Recording, load
from legbench.replay.comparison import Replayed
from legbench.replay.controller import replay_controller
from legbench.replay.log import load_log
from legbench.replay.moved import MotionSource
from legbench.replay.recorded import recorded_controller, recorded_leg
from legbench.replay.resimulation import resimulate
from legbench.servo import ServoConfig

ROOT = Path(__file__).parents[1]
BUS = ROOT / "hardware" / "leg.toml"
DURATION = 2.0
"""Length of the runs [s]."""
COUNTS, JUMP = 4.0, 3e-3
"""Largest error of a link on drives, from measured motors: in a fixed setup [counts of the
encoder], in a jump [rad]."""
IMPERFECT = Imperfections(
    stiffness_error=(0.02, -0.01),
    coulomb_friction=(0.01, 0.01),
    link_noise=(1e-3, 1e-3),
    motor_noise=(1e-4, 1e-4),
    motor_delay_cycles=(1, 2),
    backlash=(0.002, 0.002),
)
SLOW = ServoConfig(bandwidth=60.0, delay_cycles=1, encoder_counts=16_384)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """Run to be made and replayed."""

    name: str
    experiment: Experiment
    exact: tuple[MotionSource, ...]
    """Sources from which its resimulation is identical to the bit."""


def cases() -> Iterator[Case]:
    """Yield every combination that is checked."""
    jump, swing, step = JumpConfig(), BangBangConfig(), PositionJumpConfig()
    laws: tuple[tuple[ControllerSettings, SetupKind], ...] = (
        (jump, SetupKind.JUMP),
        (swing, SetupKind.FFS),
        (swing, SetupKind.VFTS),
        (step, SetupKind.FFS),
        (step, SetupKind.HFTS),
    )
    both = tuple(MotionSource)
    for leg in ("prototype", "optimal", "table2"):
        design = load_design(ROOT / "models" / f"{leg}.toml")
        for law, setup in laws:
            for plant in (SimChoice(), AnalyticChoice(), CanChoice(bus=BUS, interface="legbench")):
                virtual = not isinstance(plant, CanChoice)
                if not virtual and leg == "table2":
                    continue
                chosen = Experiment(
                    design=design,
                    controller=law,
                    setup=Setup(kind=setup),
                    plant=plant
                    if virtual
                    else CanChoice(bus=BUS, interface="legbench", end=End.STOP),
                    duration=DURATION,
                )
                yield Case(
                    name=f"{leg} {plant.kind} {law.kind} {setup}",
                    experiment=chosen,
                    exact=both if virtual else (),
                )
    design = load_design(ROOT / "models" / "prototype.toml")
    for words, servo, imperfections, exact in (
        ("slow servo", SLOW, Imperfections(), (MotionSource.COMMANDS,)),
        ("imperfect", ServoConfig(), IMPERFECT, (MotionSource.COMMANDS,)),
    ):
        chosen = Experiment(
            design=design,
            controller=swing,
            setup=Setup(kind=SetupKind.FFS),
            servo=servo,
            imperfections=imperfections,
            duration=DURATION,
            seed=7,
        )
        yield Case(name=f"prototype sim bang-bang ffs, {words}", experiment=chosen, exact=exact)


def links(signals: Replayed) -> float:
    """Largest error of a link [rad]."""
    return max(each.max for each in signals.deviations() if each.signal.startswith("joint_pos"))


def judged(case: Case, run: Recording) -> tuple[list[str], bool]:
    """Words of a run's line, and whether every bound is kept."""
    commands = replay_controller(run, recorded_controller(run)).commands
    words = ["controller identical" if commands.identical else f"CONTROLLER {commands.first()}"]
    good = commands.identical
    count = load_bus(BUS).nodes[0].link_units.resolution
    for source in MotionSource:
        found = resimulate(run, recorded_leg(run), source)
        if found.signals.identical:
            words.append(f"{source} identical")
            continue
        worst = links(found.signals)
        words.append(f"{source} {worst:.2e} rad = {worst / count:.2f} counts")
        bound = JUMP if run.description.jumps else COUNTS * count
        on_drives = run.description.plant == "can" and source is MotionSource.MOTORS
        good = good and source not in case.exact and (not on_drives or worst <= bound)
    if (run.path / "bus.log").is_file():
        design, setup = run.description.design, run.description.setup
        log = load_log(run.path / "bus.log", load_bus(BUS), BUS.name, design, setup).recording
        words.append(f"log {len(log.time)} rows")
    return words, good


def main(words: list[str]) -> int:
    """Record and replay the cases that have one of the words; 1 where a bound is missed."""
    missed = done = 0
    with tempfile.TemporaryDirectory() as folder:
        for case in cases():
            if words and not set(words) & set(case.name.replace(",", "").split()):
                continue
            try:
                finished = record(case.experiment, Path(folder))
            except LegbenchError as error:
                print(f"{case.name}: not recorded: {error}", flush=True)
                continue
            line, good = judged(case, load(finished.path))
            ending = finished.outcome.cause or finished.outcome.status
            print(f"{case.name} ({ending}): {'; '.join(line)}", flush=True)
            done, missed = done + 1, missed + (not good)
    print(f"{done} runs, {missed} miss a bound")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
