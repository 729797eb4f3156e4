"""`legbench run`: a controller drives a leg, the run is recorded and rated."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import subcommand

from legbench.cli.output import note, print_json, progress, report_error
from legbench.cli.parse import parse
from legbench.cli.table import limited, print_summary
from legbench.cli.waived import tell_waived_of
from legbench.clock import WallClock
from legbench.control import BangBangConfig, JumpConfig, PositionJumpConfig, SetpointMeaning
from legbench.design import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.errors import ConfigError, MissingExtraError
from legbench.experiment import USUAL_SETUP, Experiment, record
from legbench.interrupts import stop_on_interrupt
from legbench.kinematics import ModalConvention
from legbench.metrics import summarise
from legbench.mjcf import Ground, Linkage, LinkageKind
from legbench.plant.landing import End
from legbench.plant.start import PERIOD
from legbench.plants import EMULATED, AnalyticChoice, CanChoice, PlantChoice, SimChoice
from legbench.recording.reader import load
from legbench.servo import ServoConfig

if TYPE_CHECKING:
    from legbench.viz.live import LiveView


@dataclass(frozen=True, slots=True, kw_only=True)
class RunArguments:
    """Run a controller on a leg, record it, rate it."""

    controller: (
        Annotated[JumpConfig, subcommand("jump", description="hop in place")]
        | Annotated[BangBangConfig, subcommand("bang-bang", description="sustain the mode")]
        | Annotated[PositionJumpConfig, subcommand("position-jump", description="step response")]
    )
    design: Path = Path("models/optimal.toml")
    """Design file of the leg."""
    setup: SetupKind | None = None
    """How the leg is held; by default jump for jump, ffs for the others."""
    boom_radius: float | None = None
    """Length of the boom that guides the trunk in ffs [m]; by default a plane."""
    linkage: LinkageKind = LinkageKind.BARS
    """Physical parallel bars, or the constraint they make."""
    tip_radius: float = Ground().tip_radius
    """Radius of the rolling foot tip [m]."""
    plant: Literal["sim", "analytic", "can"] = "sim"
    """What is controlled: MuJoCo, the paper's equations, or the drives on a bus."""
    limits: Path | None = None
    """Safety limits; on can by default limits.toml beside the bus file, elsewhere none."""
    bus: Path = Path("hardware/leg.toml")
    """can: bus file."""
    interface: str | None = None
    """can: python-can's name of the interface, legbench is an emulated leg; else the bus file's."""
    channel: str | None = None
    """can: such as can0; else the bus file's."""
    bitrate: int | None = None
    """can: of interfaces that set their own; else the bus file's [bit/s]."""
    read_only: bool = False
    """can: observe, change nothing in a drive; commands are recorded and go nowhere."""
    end: Literal["rest", "stop"] | None = None
    """can: what follows the last recorded row. rest, by default: the motors go to the posture of
    the start, at start_speed of the bus file [rad/s], the leg comes to rest, for which it has 10 s,
    then power goes. stop: quick stop at once, in mid-flight, too."""
    setpoint: SetpointMeaning = SetpointMeaning.LINK
    """Whether z2 is the link's equilibrium or the motor's position."""
    convention: ModalConvention = ModalConvention.ORTHONORMAL
    """How eq. (15) is read."""
    servo: ServoConfig = field(default_factory=ServoConfig)
    duration: float = 8.0
    """[s]"""
    out: Path = Path("runs")
    """Folder of the runs."""
    real_time: bool = False
    """Pace the simulation by the wall clock; watching does so, too."""
    view: bool = False
    """Watch live in rerun, from a process of its own."""
    serve: bool = False
    """Watch live in a browser on this machine."""
    json: bool = False
    """Print one JSON object on stdout."""


def experiment_of(chosen: RunArguments) -> Experiment:
    """The experiment that the flags describe.

    Raises:
        LegbenchError: the design file or a setting makes no sense.
    """
    kind = chosen.setup or USUAL_SETUP[type(chosen.controller)]
    return Experiment(
        design=load_design(chosen.design),
        controller=chosen.controller,
        setup=Setup(kind=kind, boom_radius=chosen.boom_radius),
        linkage=Linkage(kind=chosen.linkage),
        ground=Ground(tip_radius=chosen.tip_radius),
        servo=chosen.servo,
        meaning=chosen.setpoint,
        convention=chosen.convention,
        duration=chosen.duration,
        plant=plant_of(chosen),
    )


def plant_of(chosen: RunArguments) -> PlantChoice:
    """The plant that the flags describe.

    Raises:
        ConfigError: a flag of the bus for a plant that has none.
    """
    given = (chosen.interface, chosen.channel, chosen.bitrate, chosen.read_only or None, chosen.end)
    if chosen.plant != "can" and any(value is not None for value in given):
        raise ConfigError(
            "interface, channel, bitrate, read-only and end are of a bus, and plant "
            f"{chosen.plant} has none; add --plant can"
        )
    if chosen.plant == "sim":
        return SimChoice(limits=chosen.limits)
    if chosen.plant == "analytic":
        return AnalyticChoice(limits=chosen.limits)
    return CanChoice(
        bus=chosen.bus,
        interface=chosen.interface,
        channel=chosen.channel,
        bitrate=chosen.bitrate,
        read_only=chosen.read_only,
        end=End(chosen.end or End.REST),
        limits=chosen.limits,
    )


def plays_alone(chosen: RunArguments) -> bool:
    """Whether time is the computer's own to choose; drives on a wire keep their own."""
    return chosen.plant != "can" or chosen.interface == EMULATED


@dataclass(slots=True)
class Watching:
    """The live view of a run, if there is one."""

    serve: bool
    view: "LiveView | None" = None

    def start(self, run: Path) -> None:
        """Open the view; a machine that has none gets a note, the run goes on."""
        from legbench.viz.live import start_live

        try:
            self.view = start_live(run, serve=self.serve)
        except MissingExtraError as error:
            note(f"legbench: {error}")
            return
        if self.view.url is not None:
            note(f"watch at {self.view.url}; `legbench replay {run} --serve` shows it again")

    def stop(self) -> None:
        """Let the view show the last rows, and no more."""
        if self.view is not None:
            self.view.stop()


def main(arguments: list[str]) -> int:
    """Run a controller on a leg and record it.

    Returns:
        0 when the run came to its end or was stopped by ^C after its first row, 1 when a fault
        ended it or a drive kept its power, 130 when ^C came before the first row.
    """
    chosen = parse(RunArguments, "run", arguments)
    experiment = experiment_of(chosen)
    tell_waived_of(experiment.plant)
    watched = chosen.view or chosen.serve
    watching = Watching(serve=chosen.serve)
    paced = watched or chosen.real_time
    clock = WallClock(PERIOD) if paced and plays_alone(chosen) else None
    with stop_on_interrupt(raises=True) as stop:
        finished = record(
            experiment,
            chosen.out,
            clock=clock,
            stop=stop,
            progress=progress,
            on_started=watching.start if watched else None,
        )
    watching.stop()
    if finished.outcome.status == "interrupted" and finished.outcome.cycles == 0:
        report_error(f"interrupted before the first row; {finished.path} holds 0 rows")
        return 130
    if finished.outcome.message is not None:
        note(f"legbench: {finished.outcome.message}")
    summary = summarise(load(finished.path))
    if summary.limited_cycles:
        note(
            f"legbench: the limits changed the command in {limited(summary)}: the leg ran "
            "something else than it was asked to; the event 'limited' in events.jsonl says more"
        )
    if chosen.json:
        print_json(summary.to_json())
    else:
        print_summary(summary)
    return 1 if finished.outcome.status == "fault" else 0
