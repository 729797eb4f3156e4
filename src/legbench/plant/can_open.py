"""Opening servo drives on a CAN bus as a plant, with what a run on them logs and tells."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, final

from legbench.clock import AbstractClock
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate, emulate_channels, on_bench
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.channels_bus import ChannelsBus
from legbench.drives.emulated.network import Network
from legbench.drives.master.session import Session
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.bus_numbers import RUN_PERIODS_US
from legbench.drives.setup.checks import check_together
from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.exchange import check_budget
from legbench.drives.setup.waivers import describe_waivers
from legbench.drives.transport.open_channels import adapters_of, open_channels
from legbench.drives.transport.realtime import Granted
from legbench.errors import ConfigError
from legbench.limits.safety import SafetyLimits
from legbench.plant.can import CanPlant
from legbench.plant.can_choice import BUS_LOG, EMULATED, LIMITS_NAME, CanChoice
from legbench.plant.can_events import bus_events
from legbench.plant.can_needs import check_needs
from legbench.plant.design_limits import joint_ranges, limits_events, limits_within
from legbench.plant.emulated_leg import EmulatedLeg
from legbench.plant.gone_drive import gone_drive
from legbench.plant.landing import End
from legbench.plant.leg_momentum import momentum_on
from legbench.plant.limits_file import limits_for
from legbench.plant.opening import Leg, OpenPlant
from legbench.plant.start import PERIOD
from legbench.servo import ServoConfig

LEG_PERIOD_NS = round(1e9 * PERIOD)
"""Period of the leg on the shafts of emulated drives [ns]."""
IDLE_POS = (-0.3, 0.3)
"""Motors of emulated drives that nothing hangs on: a knee that every leg can have [rad]."""


@final
class CanClock(AbstractClock):
    """Clock of a run on drives: the link waits, this shows how late its last SYNC was."""

    def __init__(self, plant: CanPlant) -> None:
        self._plant = plant

    def start(self) -> None:
        """Do nothing: the link has laid its grid already."""

    def wait(self, cycle: int) -> float:
        """Lateness of the cycle that has been seen [s]."""
        return self._plant.late


def open_can(choice: CanChoice, leg: Leg) -> OpenPlant:
    """Open the bus of a choice and what hangs on it; no drive is enabled before the reset.

    Raises:
        ConfigError: a file or a setting makes no sense, or limits are looser than the design's.
        BusError: the interface is not there, is down, or has a master.
        DriveError: a drive is missing, is another one, or refuses its configuration.
    """
    config, limits = _checked(choice, leg)
    session = open_session(config, choice, leg, leads=not choice.read_only)
    try:
        granted = session.request_realtime()
        link = session.link(
            limits,
            leg.design.stiffness,
            read_only=choice.read_only,
            momentum=momentum_on(config, leg.design, leg.options.setup, leg.imperfections),
        )
        link.open()
    except BaseException:
        session.close()
        raise
    plant = CanPlant(
        session, link, leg.start, read_only=choice.read_only, lands=choice.end is End.REST
    )
    waived = describe_waivers(config, limits)
    return OpenPlant(
        plant=plant,
        clock=CanClock(plant),
        facts=_facts(choice, config, limits, granted),
        notes=link.unprotected,
        start_log=lambda writer: session.log_to(writer.log(BUS_LOG)),
        events=lambda: limits_events(waived, link.shortfall) | bus_events(plant),
        realtime=not session.virtual,
        gone=lambda: gone_drive(link),
        trouble=lambda: None if link.stopped is None else link.stopped.trouble,
    )


def _checked(choice: CanChoice, leg: Leg) -> tuple[BusConfig, SafetyLimits]:
    """The bus file and the limits of a choice, held against each other and against the leg.

    Raises:
        ConfigError: they make no sense, or do not fit.
    """
    if leg.servo != ServoConfig():
        raise ConfigError(
            "servo settings describe a simulated servo; on the can plant the drives decide: leave "
            "slew_rate, bandwidth, delay_cycles and encoder_counts out"
        )
    config = load_bus(choice.bus_file)
    if not (leg.imperfections.perfect or choice.is_virtual(config)):
        raise ConfigError(
            "imperfections describe an emulated leg; the leg on the bench has its own: leave them "
            f"out, or give --interface {EMULATED}"
        )
    if len(config.nodes) != 2:
        raise ConfigError(f"{choice.bus}: {len(config.nodes)} nodes; a leg has 2")
    if config.period_us not in RUN_PERIODS_US:
        raise ConfigError(
            f"{choice.bus}: period_us is {config.period_us} us; a run needs "
            f"{', '.join(map(str, RUN_PERIODS_US))} us"
        )
    if not choice.read_only:
        check_needs(config, leg.needs)
    check_budget(config.at(choice.bitrate))
    if choice.limits is None:
        limits = limits_for(choice.bus_file.parent / LIMITS_NAME, leg.design)
    else:
        limits = limits_within(choice.limits, leg.design)
    check_together(config, limits, stops=joint_ranges(leg.design), leads=not choice.read_only)
    if not choice.is_virtual(config):
        limits.require_complete()
    return config, limits


def _facts(
    choice: CanChoice, config: BusConfig, limits: SafetyLimits, granted: Granted | None
) -> dict[str, Any]:
    """Entries of a run's manifest about the bus."""
    return {
        "bus": {
            "file": str(choice.bus),
            "interface": choice.interface or config.interface,
            "channel": choice.channel or "+".join(filter(None, config.channels)) or None,
            "bitrate": choice.bitrate or config.bitrate,
            "read_only": choice.read_only,
            "end": choice.end.value,
            "waived": list(config.waive),
            "nodes": {
                node.name: {"id": node.node_id, "identity": asdict(node.identity)}
                for node in config.nodes
            },
        },
        "limits": asdict(limits),
        "realtime": None if granted is None else asdict(granted),
    }


def open_session(
    config: BusConfig, choice: CanChoice, leg: Leg | None = None, *, leads: bool = True
) -> Session:
    """Open the bus of a choice; with interface `legbench` the emulated leg in this process.

    Args:
        config: the bus file.
        choice: which bus.
        leg: on the shafts of emulated drives; nothing by default.
        leads: or only reads.

    Raises:
        BusError: the interface is not there, is down, or has a master.
        ConfigError: no bus has the bitrate that is asked for.
    """
    seen = config.at(choice.bitrate)  # refuses a bitrate that no bus has before one is open
    if not choice.is_virtual(config):
        adapters = adapters_of(config, interface=choice.interface, channel=choice.channel)
        bus, lock = open_channels(seen, adapters, leads=leads)
        return Session(bus, seen, lock=lock)
    networks = _emulated(config, choice, leg)
    if len(networks) > 1:
        bus = ChannelsBus(tuple(networks), config, choice.bitrate)
    else:
        bus = LockstepBus("leg", network=networks[0], bitrate=choice.bitrate)
    return Session(bus, seen)


def _emulated(config: BusConfig, choice: CanChoice, leg: Leg | None) -> Sequence[Network]:
    """The emulated leg; its drives run at the bitrate of the bus file, whatever is asked for.

    For those who only look its drives have kept their configuration: nobody may write it.
    """
    several = len(config.channels) > 1
    if leg is None:
        starts = IDLE_POS if len(config.nodes) == len(IDLE_POS) else (0.0,) * len(config.nodes)
        idle = [on_bench(node, start) for node, start in zip(config.nodes, starts, strict=True)]
        if several:
            return emulate_channels(config, idle, configured=choice.read_only)
        return [emulate(config, idle, configured=choice.read_only)]
    body = EmulatedLeg(leg.design, leg.options, leg.start, leg.imperfections, leg.seed)
    drives = [_behaviour(leg, body, place) for place in range(len(leg.start.motor_pos))]
    faults, configured = choice.faults, choice.read_only
    if several:
        return emulate_channels(
            config,
            drives,
            body=body,
            body_period_ns=LEG_PERIOD_NS,
            faults=faults,
            configured=configured,
        )
    network = emulate(
        config,
        drives,
        body=body,
        body_period_ns=LEG_PERIOD_NS,
        faults=faults,
        configured=configured,
    )
    return [network]


def _behaviour(leg: Leg, body: EmulatedLeg, place: int) -> Behaviour:
    """Behaviour of the drive of one motor, with the imperfections of that motor."""
    imperfections, start = leg.imperfections, float(leg.start.motor_pos[place])
    slew, delay = imperfections.motor_slew_rate, imperfections.motor_delay_cycles
    if imperfections.motor_range is None:
        stops = None
    else:
        low, high = stops = imperfections.motor_range[place]
        start = min(max(start, low), high)
    return Behaviour(
        start_pos=start,
        hard_stop=stops,
        slew_rate=None if slew is None else slew[place],
        setpoint_delay=0 if delay is None else delay[place],
        motor_noise=None if imperfections.motor_noise is None else lambda: body.motor_noise[place],
    )
