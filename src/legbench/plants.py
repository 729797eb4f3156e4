"""Which plant a run is made on, and what has to be opened and told for it: the one place."""

import math
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, final

from legbench.analytic.smooth import Accuracy
from legbench.clock import AbstractClock, VirtualClock
from legbench.design import LegDesign
from legbench.drives.bus import LockstepBus
from legbench.drives.bus_file import load_bus, load_limits
from legbench.drives.checks import check_together
from legbench.drives.config import BusConfig
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.faults import Fault
from legbench.drives.emulated.network import Network
from legbench.drives.limits import UNLIMITED, Range, SafetyLimits
from legbench.drives.link import Link
from legbench.drives.master.lock import ChannelLock
from legbench.drives.master.stop_report import StopReport
from legbench.drives.open_bus import adapter_of, open_bus
from legbench.drives.session import Session
from legbench.drives.shortfall import Shortfall
from legbench.drives.waivers import describe_waivers
from legbench.drives.wire import check_load
from legbench.errors import ConfigError
from legbench.mjcf import BuildOptions
from legbench.plant.abstract import AbstractPlant
from legbench.plant.analytic import AnalyticPlant
from legbench.plant.can import CanPlant
from legbench.plant.emulated_leg import EmulatedLeg
from legbench.plant.landing import End
from legbench.plant.limited import LimitedPlant
from legbench.plant.sim import SimPlant
from legbench.plant.start import PERIOD, Start
from legbench.servo import ServoConfig

EMULATED = "legbench"
"""Interface of the emulated leg in this process, in virtual time."""
IDLE_POS = (-0.3, 0.3)
"""Motors of emulated drives that nothing hangs on: a knee that every leg can have [rad]."""
KNEE_WIND = 0.1
"""Motors may ask for so much beyond a knee stop, which loads each spring by half of it [rad]."""
SINGULAR_SHARE = 0.2
"""Of the way from a singular pose of the bars to the knee stop, links keep this share [-]."""
LIMITS_NAME = "limits.toml"
"""Beside the bus file, unless another file is chosen."""
BUS_LOG = "bus.log"
"""Raw frames in the run folder, candump format."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SimChoice:
    """MuJoCo."""

    kind: ClassVar[str] = "sim"
    limits: Path | None = None
    """Safety limits; none act without a file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AnalyticChoice:
    """The paper's equations."""

    kind: ClassVar[str] = "analytic"
    limits: Path | None = None
    """Safety limits; none act without a file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CanChoice:
    """Servo drives on a CAN bus, real or emulated."""

    kind: ClassVar[str] = "can"
    bus: Path = Path("hardware/leg.toml")
    interface: str | None = None
    channel: str | None = None
    bitrate: int | None = None
    read_only: bool = False
    limits: Path | None = None
    """By default `limits.toml` beside the bus file."""
    end: End = End.REST
    """What follows when the time is over."""
    faults: tuple[Fault, ...] = ()
    """To inject into the emulated leg in this process, on its virtual time."""

    def is_virtual(self, config: BusConfig) -> bool:
        """Whether it is the emulated leg in this process, in virtual time."""
        return (self.interface or config.interface) == EMULATED


PlantChoice = SimChoice | AnalyticChoice | CanChoice


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """The leg that the plant is to be."""

    design: LegDesign
    options: BuildOptions
    start: Start
    servo: ServoConfig


@final
class CanClock(AbstractClock):
    """Never waits, because the link does; tells how late its last SYNC was."""

    def __init__(self, plant: CanPlant) -> None:
        self._plant = plant

    def start(self) -> None:
        """The link's grid is laid already."""

    def wait(self, cycle: int) -> float:
        """Lateness of the cycle that has been seen [s]."""
        return self._plant.late


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenPlant:
    """A plant that is ready to be reset, and what belongs to a run on it."""

    plant: AbstractPlant
    clock: AbstractClock
    """What paces it if nobody asks for another pace."""
    manifest: dict[str, Any]
    """What a run has to say of it."""
    session: Session | None = None
    link: Link | None = None
    waived: tuple[str, ...] = ()
    """Protections that a run on it does without, a line each."""
    shortfall: Shortfall | None = None
    """Which commands its limits changed; None without limits."""

    def start_log(self, run: Path) -> None:
        """Record raw frames into a run folder from now on, if there are any."""
        if self.session is not None:
            self.session.log_to(run / BUS_LOG)

    @property
    def realtime(self) -> bool:
        """Whether the machine's clock paces it: whoever holds up its loop holds up drives."""
        return self.session is not None and not self.session.virtual

    @property
    def began(self) -> float | None:
        """Time of row 0 on the bus's own time base, as in the bus log [s]."""
        return self.plant.began if isinstance(self.plant, CanPlant) else None

    @property
    def stopped(self) -> StopReport | None:
        """How the stop of the drives has ended; none where there were none to stop."""
        return None if self.link is None else self.link.stopped

    def events(self) -> dict[str, dict[str, Any]]:
        """What a run on it has to tell in the end, by name."""
        events: dict[str, dict[str, Any]] = {}
        if self.waived:
            events["waived"] = {"protections": list(self.waived)}
        if self.shortfall is not None and (told := self.shortfall.told()):
            events["limited"] = told
        if self.link is None:
            return events
        cycle, stopped = self.link.cycle, self.link.stopped
        log = None if self.session is None else self.session.log
        if log is not None and log.error is not None:
            events["bus log not written"] = {"error": log.error}
        if self.link.listener_error is not None:
            events["onlooker failed"] = {"who": "listener", "error": self.link.listener_error}
        if stopped is not None and stopped != StopReport():
            events["stop"] = asdict(stopped)
        landing = self.plant.landing if isinstance(self.plant, CanPlant) else None
        if landing is not None:
            events["rest"] = asdict(landing)
        if self.link.not_parked:
            events["not parked"] = {"drives": self.link.not_parked}
        return events | {
            **cycle.notices.events,
            "bus": {
                "skipped_cycles": self.link.skipped_total,
                "silent_cycles": cycle.silent_total,
                "late_frames": cycle.late_frames,
                "error_frames": cycle.error_frames,
                "lost_cycles": [watch.lost_total for watch in cycle.watches],
                "emergencies": [str(text) for watch in cycle.watches for text in watch.history],
                "state": self.link.state.name.lower(),
                "began": self.began,
            },
        }


def open_plant(choice: PlantChoice, leg: Leg) -> OpenPlant:
    """Open the plant of a choice; nothing moves before its `reset`.

    Raises:
        ConfigError: a file or a setting makes no sense, or limits are looser than the design's.
        BusError: the interface is not there, is down, or has a master.
        DriveError: a drive is missing, is another one, or refuses its configuration.
    """
    match choice:
        case SimChoice():
            plant = SimPlant(leg.design, leg.options, leg.start, leg.servo)
            return _alone(choice, leg, plant, {})
        case AnalyticChoice():
            plant = AnalyticPlant(leg.design, leg.options.setup, leg.start, leg.servo)
            return _alone(choice, leg, plant, {"accuracy": asdict(Accuracy())})
        case CanChoice():
            return _open_can(choice, leg)


def limits_for(path: Path, design: LegDesign) -> SafetyLimits:
    """Limits of a file; a range that it leaves out is the design's.

    Raises:
        ConfigError: the file makes no sense, or is looser than the design.
    """
    limits, joint = load_limits(path), joint_ranges(design)
    motor_knee, joint_knee = knee_ranges(design)
    open_range = (UNLIMITED, UNLIMITED)
    own_motor, own_joint = limits.motor_knee_range, limits.joint_knee_range
    try:
        limits = replace(
            limits,
            motor_range=joint if limits.motor_range == open_range else limits.motor_range,
            joint_range=joint if limits.joint_range == open_range else limits.joint_range,
            motor_knee_range=motor_knee if own_motor == UNLIMITED else own_motor,
            joint_knee_range=joint_knee if own_joint == UNLIMITED else own_joint,
        )
        limits.check_within(motor=joint, joint=joint, motor_knee=motor_knee, joint_knee=joint_knee)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None
    return limits


def joint_ranges(design: LegDesign) -> tuple[Range, Range]:
    """What the stops of a design leave to q1 and q2, and so to the motors [rad]."""
    hip, knee = design.limits.hip, design.limits.knee
    return hip, (hip[0] + knee[0], hip[1] + knee[1])


def knee_ranges(design: LegDesign) -> tuple[Range, Range]:
    """Return what the knee stops of a design leave to q2 - q1 of the motors and of the links [rad].

    Motors may wind the springs against a stop by a little, as a push does that straightens the
    leg. The stops give way: a jump of the optimal leg goes 0.18 rad into them. Links must stay
    away from the singular poses 0 and pi by a share of what lies between these and the stops.
    """
    low, high = design.limits.knee
    links = (SINGULAR_SHARE * low, math.pi - SINGULAR_SHARE * (math.pi - high))
    return (low - KNEE_WIND, high + KNEE_WIND), links


def _alone(
    choice: SimChoice | AnalyticChoice, leg: Leg, plant: AbstractPlant, told: dict[str, Any]
) -> OpenPlant:
    """A plant that is nothing but computed, in virtual time."""
    manifest, shortfall = {"plant": choice.kind, **told}, None
    waived: tuple[str, ...] = ()
    if choice.limits is not None:
        limits = limits_for(choice.limits, leg.design)
        _check_servo(leg.servo, limits)
        plant = LimitedPlant(plant, limits, delay_cycles=leg.servo.delay_cycles)
        manifest["limits"], shortfall = asdict(limits), plant.shortfall
        waived = describe_waivers(None, limits)
    return OpenPlant(
        plant=plant, clock=VirtualClock(), manifest=manifest, waived=waived, shortfall=shortfall
    )


def _check_servo(servo: ServoConfig, limits: SafetyLimits) -> None:
    """Refuse a simulated servo that the limits would take for a jammed motor.

    Raises:
        ConfigError: it is slower than they take for healthy.
    """
    if math.isinf(limits.following_error):
        return
    if servo.bandwidth is not None and servo.bandwidth < limits.servo_bandwidth:
        raise ConfigError(
            f"servo bandwidth is {servo.bandwidth:g} Hz, the limits take {limits.servo_bandwidth:g}"
            " Hz for the slowest healthy one: lower servo_bandwidth in the limits file"
        )
    if servo.slew_rate is not None and servo.slew_rate < limits.command_speed:
        raise ConfigError(
            f"servo slew_rate is {servo.slew_rate:g} rad/s, the limits let commands through at "
            f"{limits.command_speed:g} rad/s: lower command_speed in the limits file"
        )


def _open_can(choice: CanChoice, leg: Leg) -> OpenPlant:
    if leg.servo != ServoConfig():
        raise ConfigError(
            "servo settings describe a simulated servo; on the can plant the drives decide: leave "
            "slew_rate, bandwidth, delay_cycles and encoder_counts out"
        )
    config = load_bus(choice.bus)
    if len(config.nodes) != 2:
        raise ConfigError(f"{choice.bus}: {len(config.nodes)} nodes; a leg has 2")
    if config.period != PERIOD:
        raise ConfigError(f"{choice.bus}: period_us is {config.period_us}; runs need 1000")
    check_load(config.at(choice.bitrate))
    limits = limits_for(choice.limits or choice.bus.parent / LIMITS_NAME, leg.design)
    check_together(config, limits, stops=joint_ranges(leg.design), leads=not choice.read_only)
    if not choice.is_virtual(config):
        limits.require_complete()
    session = open_session(config, choice, leg, leads=not choice.read_only)
    try:
        granted = session.be_punctual()
        link = session.link(limits, leg.design.stiffness, read_only=choice.read_only)
        link.open()
    except BaseException:
        session.close()
        raise
    plant = CanPlant(
        session, link, leg.start, read_only=choice.read_only, lands=choice.end is End.REST
    )
    manifest = {
        "plant": "can",
        "bus": {
            "file": str(choice.bus),
            "interface": choice.interface or config.interface,
            "channel": choice.channel or config.channel,
            "bitrate": choice.bitrate or config.bitrate,
            "read_only": choice.read_only,
            "end": choice.end,
            "waived": list(config.waive),
            "nodes": {
                node.name: {"id": node.node_id, "identity": asdict(node.identity)}
                for node in config.nodes
            },
        },
        "limits": asdict(limits),
        "realtime": None if granted is None else asdict(granted),
    }
    return OpenPlant(
        plant=plant,
        clock=CanClock(plant),
        manifest=manifest,
        session=session,
        link=link,
        waived=describe_waivers(config, limits),
        shortfall=link.shortfall,
    )


def open_session(
    config: BusConfig, choice: CanChoice, leg: Leg | None = None, *, leads: bool = True
) -> Session:
    """Open the bus of a choice; with interface `legbench` the emulated leg in this process.

    The channel is locked before its adapter is touched: opening a serial one resets it under a
    program that uses it. Whoever only reads locks no channel that others may share.

    Args:
        config: the bus file.
        choice: which bus.
        leg: on the shafts of emulated drives; nothing by default.
        leads: or only reads.

    Raises:
        BusError: the interface is not there, is down, or has a master.
    """
    if not choice.is_virtual(config):
        adapter = adapter_of(config, interface=choice.interface, channel=choice.channel)
        lock = ChannelLock.of_channel(adapter.interface, adapter.channel)
        if leads or not adapter.shared:
            lock.acquire()
        try:
            bus = open_bus(config.at(choice.bitrate), adapter)
        except BaseException:
            lock.release()
            raise
        return Session(bus, config.at(choice.bitrate), lock=lock)
    network = _emulated(config, choice, leg)
    bus = LockstepBus("leg", network=network, bitrate=choice.bitrate)
    return Session(bus, config.at(choice.bitrate))


def _emulated(config: BusConfig, choice: CanChoice, leg: Leg | None) -> Network:
    """The emulated leg; its drives run at the bitrate of the bus file, whatever is asked for.

    For those who only look its drives have kept their configuration: nobody may write it.
    """
    if leg is None:
        idle = [Behaviour(start_pos=start) for start in IDLE_POS]
        fits = len(config.nodes) == len(idle)
        return emulate(config, idle if fits else None, configured=choice.read_only)
    motors = [float(value) for value in leg.start.motor_pos]
    return emulate(
        config,
        [Behaviour(start_pos=motor) for motor in motors],
        body=EmulatedLeg(leg.design, leg.options, leg.start),
        faults=choice.faults,
        configured=choice.read_only,
    )
