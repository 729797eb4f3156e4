"""A named set of choices, and what running it leaves: a run folder."""

import math
import platform
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from legbench.clock import AbstractClock
from legbench.control import (
    AbstractController,
    BangBang,
    BangBangConfig,
    Jump,
    JumpConfig,
    LegTargets,
    PositionJump,
    PositionJumpConfig,
    SetpointMeaning,
)
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.design.toml import design_to_mapping
from legbench.drives.master.stop_report import add_trouble
from legbench.errors import ConfigError, RecordingError
from legbench.interrupts import StopFlag, shielded
from legbench.kinematics import ModalConvention
from legbench.loop import Outcome, Progress, run
from legbench.mjcf import BuildOptions, Ground, Linkage, Numerics, build_spec, to_xml, xml_hash
from legbench.onlooker import Onlooker
from legbench.plant.start import PERIOD, Start
from legbench.plants import Leg, OpenPlant, PlantChoice, SimChoice, open_plant
from legbench.recording.writer import RunWriter
from legbench.servo import ServoConfig
from legbench.verdict import answered, stopped_well

ControllerConfig = JumpConfig | BangBangConfig | PositionJumpConfig
USUAL_SETUP = {
    JumpConfig: SetupKind.JUMP,
    BangBangConfig: SetupKind.FFS,
    PositionJumpConfig: SetupKind.FFS,
}
"""Where each controller is at home."""
RECORDED_PACKAGES = ("mujoco-core", "numpy", "scipy", "pyarrow")


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """Everything that decides a run.

    Raises:
        ConfigError: a duration that is shorter than a cycle, or endless.
    """

    design: LegDesign
    controller: ControllerConfig
    setup: Setup = field(default_factory=Setup)
    linkage: Linkage = field(default_factory=Linkage)
    ground: Ground = field(default_factory=Ground)
    numerics: Numerics = field(default_factory=Numerics)
    servo: ServoConfig = field(default_factory=ServoConfig)
    meaning: SetpointMeaning = SetpointMeaning.LINK
    convention: ModalConvention = ModalConvention.ORTHONORMAL
    duration: float = 8.0
    """[s]"""
    plant: PlantChoice = field(default_factory=SimChoice)

    def __post_init__(self) -> None:
        if not PERIOD <= self.duration < math.inf:
            raise ConfigError(
                f"duration is {self.duration:g} s; it must be at least one cycle of {PERIOD:g} s, "
                "and finite"
            )

    @property
    def options(self) -> BuildOptions:
        """What the model is made of besides the design."""
        return BuildOptions(
            setup=self.setup, linkage=self.linkage, ground=self.ground, numerics=self.numerics
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Finished:
    """A run that has ended, one way or another."""

    path: Path
    outcome: Outcome


def make_controller(config: ControllerConfig, targets: LegTargets) -> AbstractController:
    """The controller of a configuration, for the legs of `targets`.

    Raises:
        ConfigError: settings that the leg refuses.
    """
    match config:
        case JumpConfig():
            return Jump(config, targets)
        case BangBangConfig():
            return BangBang(config, targets)
        case PositionJumpConfig():
            return PositionJump(config, targets)


def targets_of(experiment: Experiment) -> LegTargets:
    """Set points of the experiment's leg in its setup."""
    return LegTargets(
        designs=experiment.design,
        support=experiment.setup.support,
        meaning=experiment.meaning,
        convention=experiment.convention,
    )


def start_of(experiment: Experiment) -> Start:
    """The state that an experiment begins in: its controller's first posture, at rest.

    Raises:
        ConfigError: settings that the leg refuses.
    """
    targets = targets_of(experiment)
    motor_pos = make_controller(experiment.controller, targets).start_motor_pos
    return Start(joint_pos=targets.link_at_rest(motor_pos), motor_pos=motor_pos)


def record(
    experiment: Experiment,
    out: Path,
    *,
    clock: AbstractClock | None = None,
    stop: StopFlag | None = None,
    progress: Progress | None = None,
    on_started: Callable[[Path], None] | None = None,
) -> Finished:
    """Run an experiment, in virtual time by default, and leave a run folder under `out`.

    Args:
        experiment: what to run.
        out: folder of the runs, made if need be.
        clock: when cycles begin; by default as the plant paces itself.
        stop: ends the run when it is set.
        progress: told now and then how far the run is.
        on_started: told the run folder before the first cycle. Neither can end the run: the first
            failure of each is an event of the run, and it is not called again.

    A run whose drives could not be shown to be without power in the end is a fault, whatever it
    was until then. An interruption before the run folder is there leaves nothing behind; one
    before the first row leaves a folder that says `interrupted` and holds no rows.

    Raises:
        ConfigError: settings that the leg or the plant refuses; nothing is written.
        KeyboardInterrupt: interrupted before the plant began to go to its start.
        BusError, DriveError: a bus or a drive is not what it should be; before the first cycle.
        PlantFault: something went wrong on the way to the start posture.
        RecordingError: the folder cannot be written, or the disk failed on the way; what was
            written by then stays readable.
    """
    controller = make_controller(experiment.controller, targets_of(experiment))
    start = start_of(experiment)
    cycles = round(experiment.duration / PERIOD)
    leg = Leg(
        design=experiment.design, options=experiment.options, start=start, servo=experiment.servo
    )
    xml = to_xml(build_spec(experiment.design, experiment.options))
    watching = Onlooker("progress", progress)
    starting = Onlooker("on_started", on_started)
    opened = open_plant(experiment.plant, leg)
    with opened.plant:
        manifest = _manifest(experiment, start, xml) | opened.manifest
        kind = experiment.controller.kind
        name = f"{kind}-{experiment.design.name}"
        with _recording(out, manifest, name, realtime=opened.realtime) as writer:
            try:
                (writer.path / "leg.xml").write_text(xml, encoding="utf-8")
                opened.start_log(writer.path)
            except OSError as error:
                raise RecordingError(f"{writer.path}: {error}") from error
            starting(writer.path)
            try:
                outcome = run(
                    opened.plant,
                    controller,
                    cycles,
                    clock=clock or opened.clock,
                    sink=writer,
                    stop=stop,
                    progress=watching,
                )
            except BaseException as error:
                opened.plant.close()
                _tell_events(opened, writer, (starting, watching), writer.rows * PERIOD)
                add_trouble(error, opened.stopped)
                raise
            outcome = answered(outcome, opened.link)
            opened.plant.close()
            outcome = stopped_well(outcome, opened.stopped)
            _tell_events(opened, writer, (starting, watching), outcome.time)
            writer.event(outcome.time, "end", status=outcome.status, cause=outcome.cause)
            writer.close(outcome.status, outcome.cause)
    return Finished(path=writer.path, outcome=outcome)


@contextmanager
def _recording(
    out: Path, manifest: dict[str, Any], name: str, *, realtime: bool
) -> Iterator[RunWriter]:
    """Write a new run; one that is interrupted while its folder is made is closed as usual."""
    with ExitStack() as stack:
        with shielded():
            writer = stack.enter_context(
                RunWriter.create(out, manifest, name=name, realtime=realtime)
            )
        yield writer


def _tell_events(
    opened: OpenPlant, writer: RunWriter, onlookers: Sequence[Onlooker], time: float
) -> None:
    """Write what the plant and the onlookers have to tell of a run that ended at `time` [s]."""
    for event, detail in opened.events().items():
        writer.event(time, event, **detail)
    for each in onlookers:
        if each.failure is not None:
            writer.event(time, "onlooker failed", who=each.name, error=each.failure)


def _manifest(experiment: Experiment, start: Start, xml: str) -> dict[str, Any]:
    """What a run has to say of itself; everything a reader needs to judge it."""
    return {
        "design": design_to_mapping(experiment.design),
        "mjcf_sha256": xml_hash(xml),
        "setup": asdict(experiment.setup),
        "linkage": asdict(experiment.linkage),
        "ground": asdict(experiment.ground),
        "numerics": asdict(experiment.numerics),
        "servo": asdict(experiment.servo),
        "controller": {"kind": experiment.controller.kind, **asdict(experiment.controller)},
        "conventions": {
            "modal": str(experiment.convention),
            "setpoint": str(experiment.meaning),
            "rating_reference": "motor",
        },
        "period": PERIOD,
        "seed": None,
        "initial_state": {
            "joint_pos": start.joint_pos.tolist(),
            "motor_pos": start.motor_pos.tolist(),
        },
        "versions": {"python": platform.python_version(), **_versions()},
    }


def _versions() -> dict[str, str]:
    found: dict[str, str] = {}
    for package in RECORDED_PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found
