"""One fault in mid-jump on the emulated leg, and what came of it."""

import os
import signal
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from legbench.control import JumpConfig
from legbench.design import LegDesign
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.faults import (
    FOREVER_NS,
    Babble,
    Fault,
    FrameFault,
    FrameFaultKind,
    NodeFault,
    NodeFaultKind,
)
from legbench.drives.emulated.network import Network
from legbench.drives.errors import DriveError
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.drives.setup.config import BusConfig
from legbench.errors import ConfigError
from legbench.experiment import Experiment, make_controller, start_of, targets_of
from legbench.interrupts import StopFlag
from legbench.limits.safety import SafetyLimits
from legbench.loop import Outcome, run
from legbench.plant.can import CanPlant
from legbench.plant.landing import End
from legbench.plants import BUS_LOG, EMULATED, LIMITS_NAME, CanChoice, Leg, OpenPlant, open_plant
from legbench.recording.reader import load
from legbench.recording.writer import RunWriter

CYCLES = 900
"""Number of cycles of a trial that nothing ends."""
STRIKE_NS = 1_000_000_000
"""Time at which a fault strikes, on the bus's clock: half a second into the run, in a jump [ns]."""
BRIEF_NS = 2_000_000
"""A disturbance that the link has to bridge."""
SILENCE_NS = 200_000_000
"""How long the drives are watched after the master has gone."""
POWERED = (
    DriveState.OPERATION_ENABLED,
    DriveState.QUICK_STOP_ACTIVE,
    DriveState.FAULT_REACTION_ACTIVE,
)
MS = 1_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """A fault to be tried."""

    name: str
    faults: tuple[Fault, ...] = ()
    cause: str | None = None
    """Cause that has to end the run; none: the run has to bridge the fault."""
    gone: bool = False
    """The master itself stops without a word, as by SIGKILL or SIGSTOP."""
    interrupted: bool = False
    """^C."""
    viewer: bool = False
    """The live view of the run is frozen, by SIGSTOP."""


class View(Protocol):
    """A live view of a run, in a process of its own."""

    @property
    def pid(self) -> int:
        """Process id of the view."""
        ...

    def stop(self) -> None:
        """End it."""
        ...


StartView = Callable[[Path], View]
"""Opens a view of the run in a folder."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What came of it."""

    name: str
    status: str
    cause: str | None
    cycles: int | None
    """Number of cycles from the fault to the reaction; none if the run bridged it."""
    drives: tuple[DriveState, ...]
    """States of the drives in the end, as they are and not as the master believes."""
    excess: float
    """Largest command beyond a limit, in range or in step, below zero [rad]."""
    intact: bool
    """Every row is in the recording, which says how it ended."""
    lost_cycles: int
    run: Path
    """Its recording."""

    @property
    def safe(self) -> bool:
        """No drive has power, no command left the limits, no row was lost."""
        quiet = not any(state in POWERED for state in self.drives)
        return quiet and self.excess <= 0.0 and self.intact


def _frame(
    kind: FrameFaultKind, cob_id: int | None, *, until_ns: int = FOREVER_NS, **how: int
) -> Fault:
    end_ns = STRIKE_NS + until_ns
    return FrameFault(kind=kind, cob_id=cob_id, start_ns=STRIKE_NS, end_ns=end_ns, **how)


def _node(kind: NodeFaultKind, node_id: int) -> Fault:
    return NodeFault(kind=kind, node_id=node_id, start_ns=STRIKE_NS)


def _part(kind: NodeFaultKind, node_id: int, size: float = 0.0) -> Fault:
    return NodeFault(kind=kind, node_id=node_id, start_ns=STRIKE_NS, size=size)


def _babble(every_us: int) -> Fault:
    return Babble(
        cob_id=1, start_ns=STRIKE_NS, end_ns=STRIKE_NS + 100 * MS, every_ns=1000 * every_us
    )


_F, _N = FrameFaultKind, NodeFaultKind
LOST, EMERGENCY, FOLLOWING = "process data lost", "drive emergency", "following error"
TRIALS = (
    Trial(name="answers of a drive dropped", faults=(_frame(_F.DROP, 0x181),), cause=LOST),
    Trial(
        name="answers dropped for 2 cycles",
        faults=(_frame(_F.DROP, 0x181, until_ns=BRIEF_NS),),
    ),
    Trial(name="SYNC dropped", faults=(_frame(_F.DROP, 0x080),), cause=LOST),
    Trial(name="commands of a drive dropped", faults=(_frame(_F.DROP, 0x202),), cause=EMERGENCY),
    Trial(name="master's heartbeat dropped", faults=(_frame(_F.DROP, 0x77E),), cause=EMERGENCY),
    Trial(name="cable pulled", faults=(_frame(_F.DROP, None),), cause=LOST),
    Trial(
        name="answers 0.3 ms late",
        faults=(_frame(_F.DELAY, 0x181, delay_ns=300_000),),
        cause=LOST,
    ),
    Trial(
        name="answers 0.7 ms late",
        faults=(_frame(_F.DELAY, 0x181, delay_ns=700_000),),
        cause=LOST,
    ),
    Trial(
        name="answers 1 ms late",
        faults=(_frame(_F.DELAY, 0x181, delay_ns=1_000_000),),
        cause=LOST,
    ),
    Trial(
        name="answers 2 ms late",
        faults=(_frame(_F.DELAY, 0x182, delay_ns=2_000_000),),
        cause=LOST,
    ),
    Trial(
        name="answers of one cycle 1 ms late",
        faults=(_frame(_F.DELAY, 0x181, until_ns=MS, delay_ns=1_000_000),),
    ),
    Trial(
        name="answers doubled",
        faults=(_frame(_F.DUPLICATE, 0x181, delay_ns=10_000),),
    ),
    Trial(
        name="answers too short",
        faults=(_frame(_F.WRONG_LENGTH, 0x182, length=7),),
        cause=LOST,
    ),
    Trial(
        name="commands too short",
        faults=(_frame(_F.WRONG_LENGTH, 0x202, length=5),),
        cause=EMERGENCY,
    ),
    Trial(name="bits of answers flipped", faults=(_frame(_F.BAD_BITS, 0x181),), cause=LOST),
    Trial(name="bits of commands flipped", faults=(_frame(_F.BAD_BITS, 0x201),), cause="bus off"),
    Trial(name="a node babbles, wire full", faults=(_babble(100),), cause=LOST),
    Trial(name="a node babbles, 1 frame/ms", faults=(_babble(1000),)),
    Trial(name="drive bus-off", faults=(_node(_N.BUS_OFF, 1),), cause=LOST),
    Trial(name="drive restarts", faults=(_node(_N.RESET, 2),), cause=LOST),
    Trial(name="drive unplugged", faults=(_node(_N.SILENT, 2),), cause=LOST),
    Trial(
        name="drive's heartbeat lost",
        faults=(_node(_N.HEARTBEAT_LOSS, 1),),
        cause="heartbeat lost",
    ),
    Trial(name="under-voltage", faults=(_node(_N.UNDER_VOLTAGE, 1),), cause=EMERGENCY),
    Trial(name="over-temperature", faults=(_node(_N.OVER_TEMPERATURE, 2),), cause=EMERGENCY),
    Trial(name="drive warns", faults=(_node(_N.WARNING, 1),)),
    Trial(name="jammed motor", faults=(_part(_N.JAMMED, 1),), cause=FOLLOWING),
    Trial(name="frozen motor encoder", faults=(_part(_N.MOTOR_FROZEN, 2),), cause=FOLLOWING),
    Trial(
        name="motor encoder steps 0.1 rad", faults=(_part(_N.MOTOR_STEP, 1, 0.1),), cause=FOLLOWING
    ),
    Trial(
        name="motor encoder drifts 1 rad/s",
        faults=(_part(_N.MOTOR_DRIFT, 2, 1.0),),
        cause=FOLLOWING,
    ),
    Trial(name="frozen link encoder", faults=(_part(_N.LINK_FROZEN, 1),), cause="sway"),
    Trial(
        name="link encoder steps 0.1 rad",
        faults=(_part(_N.LINK_STEP, 2, 0.1),),
        cause="joint speed",
    ),
    Trial(name="link encoder drifts 1 rad/s", faults=(_part(_N.LINK_DRIFT, 1, 1.0),), cause="sway"),
    Trial(name="process data repeated", faults=(_part(_N.REPEATING, 2),), cause="sway"),
    Trial(name="master killed or frozen", gone=True, cause="master gone"),
    Trial(name="^C", interrupted=True),
    Trial(name="the viewer hangs", viewer=True),
)


def try_fault(
    trial: Trial, bus_file: Path, design: LegDesign, out: Path, start_view: StartView | None = None
) -> Result:
    """Jump on the emulated leg, let the fault strike, see what is left.

    Raises:
        ConfigError: the trial needs a viewer, and none is given; or as `open_plant`.
        RecordingError: as `RunWriter`.
    """
    if trial.viewer and start_view is None:
        raise ConfigError(f"the trial '{trial.name}' needs a viewer to freeze: give start_view")
    config = load_bus(bus_file)
    limits = load_limits(bus_file.parent / LIMITS_NAME)
    choice = CanChoice(bus=bus_file, interface=EMULATED, faults=trial.faults, end=End.STOP)
    chosen = Experiment(design=design, controller=JumpConfig())
    start = start_of(chosen)
    leg = Leg(design=design, options=chosen.options, start=start, servo=chosen.servo)
    opened = open_plant(choice, leg)
    network = _network(opened)
    with (
        opened.plant,
        RunWriter.create(out, {"plant": "can"} | opened.facts, name="trial") as writer,
    ):
        opened.start_log(writer.path)
        view = start_view(writer.path) if trial.viewer and start_view is not None else None
        try:
            outcome = _run(trial, opened, chosen, writer, network, view)
        finally:
            if view is not None:
                view.stop()
                with suppress(ProcessLookupError):
                    os.kill(view.pid, signal.SIGCONT)
        strike_ns = network.now_ns if trial.gone or trial.interrupted else STRIKE_NS
        ticks = outcome.cycles + opened.events()["bus"]["skipped_cycles"]
        reaction_ns = round(1e9 * _can(opened).began) + ticks * MS
        if trial.gone:
            reaction_ns = _wait_for_drives(network)
        opened.plant.close()
        network.advance(network.now_ns + SILENCE_NS)
        writer.close(outcome.status, outcome.cause)
    ended = trial.gone or trial.interrupted or outcome.status == "fault"
    found = load(writer.path)
    intact = found.torn is None and len(found.time) == outcome.cycles
    return Result(
        name=trial.name,
        status="gone" if trial.gone else outcome.status,
        cause=outcome.cause,
        cycles=(reaction_ns - strike_ns) // MS + 1 if ended else None,
        drives=tuple(drive.axis.power.state for drive in network.drives),
        excess=excess_of(writer.path / BUS_LOG, config, limits),
        intact=intact and found.manifest["cause"] == outcome.cause,
        lost_cycles=max(opened.events()["bus"]["lost_cycles"]),
        run=writer.path,
    )


def _can(opened: OpenPlant) -> CanPlant:
    if not isinstance(opened.plant, CanPlant):
        raise DriveError("faults strike drives; this plant has none")
    return opened.plant


def _network(opened: OpenPlant) -> Network:
    bus = _can(opened).session.bus
    if not isinstance(bus, LockstepBus):
        raise DriveError("faults strike on the emulated leg in this process only")
    return bus.network


def _run(
    trial: Trial,
    opened: OpenPlant,
    chosen: Experiment,
    writer: RunWriter,
    network: Network,
    view: View | None,
) -> Outcome:
    stop = StopFlag()

    def watch(_done: int, _total: int) -> None:
        if network.now_ns < STRIKE_NS:
            return
        if trial.gone or trial.interrupted:
            stop.set()
        if view is not None:
            os.kill(view.pid, signal.SIGSTOP)

    controller = make_controller(chosen.controller, targets_of(chosen))
    outcome = run(opened.plant, controller, CYCLES, sink=writer, stop=stop, progress=watch)
    return replace(outcome, status="interrupted") if trial.gone else outcome


def _wait_for_drives(network: Network) -> int:
    """Nobody speaks any more: when the last drive has lost its power [ns]."""
    until_ns = network.now_ns + SILENCE_NS
    while network.now_ns < until_ns:
        network.advance(network.now_ns + MS)
        if not any(drive.axis.power.state in POWERED for drive in network.drives):
            break
    return network.now_ns


def excess_of(log: Path, config: BusConfig, limits: SafetyLimits) -> float:
    """Largest excess of a command to an enabled drive over the limits, from raw frames [rad]."""
    worst = -1.0
    step_max = limits.command_speed * config.period
    lines = log.read_text(encoding="ascii").split()
    frames = [line.partition("#") for line in lines if "#" in line]
    for node, (low, high) in zip(config.nodes, limits.motor_range, strict=True):
        name = f"{node.rpdo_id(node.rpdos[0]):03X}"
        slack, last = node.motor.resolution, None
        for cob_id, _, data in frames:
            if cob_id != name or data[:4] != "0F00":
                continue
            counts = int.from_bytes(bytes.fromhex(data[4:12]), "little", signed=True)
            angle = node.motor.to_rad(counts)
            beyond = max(low - angle, angle - high)
            if last is not None:
                beyond = max(beyond, abs(angle - last) - step_max)
            worst, last = max(worst, beyond - slack), angle
    return worst
