"""Trial of one fault in mid-jump on the emulated leg."""

import os
import signal
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from legbench.commissioning.command_excess import excess_of
from legbench.commissioning.fault_table import MS, STRIKE_NS, FaultTrial
from legbench.control import JumpConfig
from legbench.design import LegDesign
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.errors import DriveError
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.errors import ConfigError
from legbench.experiment import Experiment, make_controller, start_of, targets_of
from legbench.experiment.manifest import manifest_of
from legbench.interrupts import StopFlag
from legbench.loop import Outcome, run
from legbench.plant.can import CanPlant
from legbench.plant.landing import End
from legbench.plants import BUS_LOG, EMULATED, LIMITS_NAME, CanChoice, Leg, OpenPlant, open_plant
from legbench.recording.reader import load
from legbench.recording.writer import RunWriter

CYCLES = 650
"""Number of cycles of a trial that nothing ends, about 150 of them after its fault."""
SILENCE_NS = 200_000_000
"""Time for which the drives are watched after the master has gone [ns]."""
POWERED = (
    DriveState.OPERATION_ENABLED,
    DriveState.QUICK_STOP_ACTIVE,
    DriveState.FAULT_REACTION_ACTIVE,
)


class View(Protocol):
    """Live view of a run, in a process of its own."""

    @property
    def pid(self) -> int:
        """Process id of the view."""
        ...

    def stop(self) -> None:
        """End the view."""
        ...


StartView = Callable[[Path], View]
"""Function that opens a view of the run in a folder."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """Result of the trial of one fault."""

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
    """Whether the recording has every row and the right end."""
    lost_cycles: int
    run: Path
    """Folder of the recording."""

    @property
    def safe(self) -> bool:
        """Whether no drive has power, no command left the limits, and no row was lost."""
        quiet = not any(state in POWERED for state in self.drives)
        return quiet and self.excess <= 0.0 and self.intact


def try_fault(
    trial: FaultTrial,
    bus_file: Path,
    design: LegDesign,
    out: Path,
    start_view: StartView | None = None,
) -> Result:
    """Jump on the emulated leg, let the fault strike, see what is left.

    Raises:
        ConfigError: the trial needs a viewer, and none is given; or as `open_plant`.
        RecordingError: as `RunWriter`.
    """
    if trial.viewer and start_view is None:
        raise ConfigError(f"the trial '{trial.name}' needs a viewer to freeze: give start_view")
    config, limits = load_bus(bus_file), load_limits(bus_file.parent / LIMITS_NAME)
    choice = CanChoice(bus=bus_file, interface=EMULATED, faults=trial.faults, end=End.STOP)
    chosen = Experiment(design=design, controller=JumpConfig(), plant=choice)
    start = start_of(chosen)
    leg = Leg(design=design, options=chosen.options, start=start, servo=chosen.servo)
    opened = open_plant(choice, leg)
    network = _network(opened)
    manifest = manifest_of(chosen, start, None, opened.plant.period, opened.facts, out)
    with opened.plant, RunWriter.create(out, manifest, name="trial") as writer:
        opened.start_log(writer)
        outcome = _viewed(trial, opened, chosen, writer, start_view)
        strike_ns = network.now_ns if trial.gone or trial.interrupted else STRIKE_NS
        ticks = outcome.cycles + opened.events()["bus"]["skipped_cycles"]
        reaction_ns = round(1e9 * _can(opened).began) + ticks * config.period_ns
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
        cycles=(reaction_ns - strike_ns) // config.period_ns + 1 if ended else None,
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


def _viewed(
    trial: FaultTrial,
    opened: OpenPlant,
    chosen: Experiment,
    writer: RunWriter,
    start_view: StartView | None,
) -> Outcome:
    """Run a trial, beside its viewer if it has one, which is set going again and ended."""
    view = start_view(writer.path) if trial.viewer and start_view is not None else None
    try:
        return _run(trial, opened, chosen, writer, view)
    finally:
        if view is not None:
            view.stop()
            with suppress(ProcessLookupError):
                os.kill(view.pid, signal.SIGCONT)


def _run(
    trial: FaultTrial,
    opened: OpenPlant,
    chosen: Experiment,
    writer: RunWriter,
    view: View | None,
) -> Outcome:
    network, stop = _network(opened), StopFlag()

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
    """Time at which the last drive has lost its power, after the master has gone [ns]."""
    until_ns = network.now_ns + SILENCE_NS
    while network.now_ns < until_ns:
        network.advance(network.now_ns + MS)
        if not any(drive.axis.power.state in POWERED for drive in network.drives):
            break
    return network.now_ns
