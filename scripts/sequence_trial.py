"""One run on the emulated leg that faults strike, and what was seen of its drives and its files."""

import json
import signal
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

from sequence_draw import Interrupt, Schedule, Sequence

from legbench import loop
from legbench.commissioning.command_excess import excess_of
from legbench.commissioning.fault_trial import SILENCE_NS
from legbench.control import BangBangConfig, JumpConfig, PositionJumpConfig
from legbench.control.settings import ControllerSettings
from legbench.design import LegDesign, load_design
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.network_time import NetworkTime
from legbench.drives.emulated.power import POWERED
from legbench.drives.master.stop import StopSequence
from legbench.drives.setup.bus_file import load_bus
from legbench.errors import LegbenchError, PlantFault
from legbench.experiment import Experiment, record
from legbench.interrupts import stop_on_interrupt
from legbench.plant import can as can_plant
from legbench.plant import can_open, landing
from legbench.plant.landing import End
from legbench.plants import BUS_LOG, EMULATED, LIMITS_NAME, CanChoice, limits_for
from legbench.recording.reader import load

ROOT = Path(__file__).parents[1]
BUS = ROOT / "hardware" / "leg.toml"
CONTROLLERS: dict[str, tuple[ControllerSettings, float]] = {
    "jump": (JumpConfig(), 0.25),
    "bang-bang": (BangBangConfig(), 0.2),
    "position-jump": (PositionJumpConfig(), 0.2),
}
"""Controller and duration of its run [s], by kind."""
STILL_CYCLES, STILL_TIME, PATIENCE = 30, 0.1, 0.3
"""A run begins so many cycles after the way to its start, however the leg still swings; at its end
a leg has to be still for so long, and has so long for it [s]. On the bench both take seconds."""
MS = 1_000_000
LATE_NS = 2 * MS
"""A command that a drive had before a stop began may enable it so long afterwards."""


@dataclass
class Seen:
    """What was seen of one run.

    Attributes:
        network: the bus.
        marks: when each phase began [ns], in order.
        edges: drives that got power after the first stop had begun.
        lost_ns: when a drive has lost its power [ns].
        ended_ns: when the command was over.
        left: whether each drive had power then.
        power_ns: when a drive had power last.
        alone_ms: for how long one drive had power and the other had none, since the first row.
        interrupted: whether ^C has come.
        status: "complete", "interrupted", "fault", or "refused" before there was a recording.
        cause: its cause; of a refusal the type of the error.
        message: what the user is told.
        violations: what must not be, in words.
    """

    network: Network | None = None
    marks: list[tuple[int, str]] = field(default_factory=lambda: [(0, "open")])
    edges: list[str] = field(default_factory=list)
    lost_ns: list[int] = field(default_factory=list)
    powered: tuple[bool, ...] = ()
    ended_ns: int = 0
    left: tuple[bool, ...] = ()
    power_ns: int = 0
    alone_ms: int = 0
    interrupted: bool = False
    status: str = ""
    cause: str | None = None
    message: str | None = None
    rows: int = 0
    violations: list[str] = field(default_factory=list)

    @property
    def now_ns(self) -> int:
        """Time of the bus [ns]; 0 before there is one."""
        return 0 if self.network is None else self.network.now_ns

    def mark(self, phase: str) -> None:
        """A phase begins."""
        self.marks.append((self.now_ns, phase))

    def stop_ns(self) -> int | None:
        """When the first stop of the drives began [ns]."""
        return next((at_ns for at_ns, phase in self.marks if phase == "stop"), None)

    def phase_at(self, at_ns: int) -> str:
        """Which phase a moment [ns] was in."""
        if self.ended_ns and at_ns >= self.ended_ns:
            return "not reached"
        return [phase for since_ns, phase in self.marks if since_ns <= at_ns][-1]

    def look(self) -> None:
        """A millisecond has passed: power that comes after a stop has begun is a violation."""
        if self.network is None:
            return
        powered = tuple(drive.axis.power.state in POWERED for drive in self.network.drives)
        if any(powered):
            self.power_ns = self.now_ns
            ran = any(phase == "run" for _, phase in self.marks)
            self.alone_ms += ran and not all(powered)
        self.lost_ns += [
            self.now_ns
            for before, now in zip(self.powered or powered, powered, strict=True)
            if before and not now
        ]
        stop_ns = self.stop_ns()
        if stop_ns is not None and self.now_ns > stop_ns + LATE_NS and self.powered:
            for drive, before, now in zip(self.network.drives, self.powered, powered, strict=True):
                if now and not before:
                    late_ms = (self.now_ns - stop_ns) / MS
                    self.edges.append(
                        f"drive {drive.node_id} got power {late_ms:.1f} ms after the stop began"
                    )
        self.powered = powered


@cache
def _design() -> LegDesign:
    return load_design(ROOT / "models" / "optimal.toml")


def play(sequence: Sequence) -> Seen:
    """Make the run of a sequence, and look at what is left of it.

    Raises:
        KeyboardInterrupt: somebody else has interrupted.
    """
    seen = Seen()
    controller, duration = CONTROLLERS[sequence.controller]
    interrupts = [one for one in sequence.strikes if isinstance(one, Interrupt)]
    faults = tuple(one for one in sequence.strikes if not isinstance(one, Interrupt))
    choice = CanChoice(
        bus=BUS,
        interface=EMULATED,
        faults=faults,
        end=End.REST if sequence.rests else End.STOP,
    )
    experiment = Experiment(
        design=_design(), controller=controller, duration=duration, plant=choice
    )
    with tempfile.TemporaryDirectory() as name, _watched(seen, interrupts):
        out = Path(name)
        _record(experiment, out, seen)
        if seen.status == "interrupted" and not seen.interrupted:
            raise KeyboardInterrupt
        seen.ended_ns, seen.left = seen.now_ns, seen.powered
        if seen.network is not None:
            # A leg that a dead encoder has led astray may fall through its knee without power: its
            # drives stay as they are.
            with suppress(PlantFault):
                seen.network.advance(seen.now_ns + SILENCE_NS)
        for run in sorted(out.iterdir()):
            _read(run, seen, experiment)
    return seen


def _record(experiment: Experiment, out: Path, seen: Seen) -> None:
    try:
        with stop_on_interrupt(raises=True) as stop:
            finished = record(experiment, out, stop=stop)
    except PlantFault as error:
        seen.status, seen.cause, seen.message = "fault", error.cause, str(error)
    except LegbenchError as error:
        seen.status, seen.cause, seen.message = "refused", type(error).__name__, str(error)
    except KeyboardInterrupt as error:
        seen.status, seen.cause = "interrupted", type(error).__name__
        seen.message = "; ".join(getattr(error, "__notes__", ())) or None
    except Exception as error:  # Whatever came out is what is looked for.
        seen.status = "escaped"
        seen.violations.append(f"{error!r} came out of the run")
    else:
        outcome = finished.outcome
        seen.status, seen.cause, seen.message = outcome.status, outcome.cause, outcome.message
        seen.rows = outcome.cycles


def _read(run: Path, seen: Seen, experiment: Experiment) -> None:
    """Read a run's folder: its samples are whole, it tells how it has ended, commands are safe."""
    manifest = json.loads((run / "run.json").read_text(encoding="utf-8"))
    found = load(run)
    if found.torn is not None:
        seen.violations.append(f"the recording is torn: {found.torn}")
    if len(found.time) != manifest["rows"] or (seen.rows and len(found.time) != seen.rows):
        seen.violations.append(
            f"{len(found.time)} rows were read, {manifest['rows']} are told, {seen.rows} were made"
        )
    status = "fault" if seen.status == "refused" else seen.status
    if (manifest["status"], manifest["cause"]) != (status, seen.cause):
        seen.violations.append(
            f"run.json says {manifest['status']}, {manifest['cause']}; the run {status}, "
            f"{seen.cause}"
        )
    log = run / BUS_LOG
    if log.exists():
        limits = limits_for(BUS.parent / LIMITS_NAME, experiment.design)
        excess = excess_of(log, load_bus(BUS), limits)
        if excess > 0.0:
            seen.violations.append(f"a command was {excess:.3g} rad beyond its limits")
    elif seen.status == "complete":
        seen.violations.append("there is no bus log")


@contextmanager
def _watched(seen: Seen, interrupts: list[Interrupt]) -> Iterator[None]:
    """Watch the bus, its drives and the phases of whatever is opened; interrupt it."""
    waiting = sorted(one.start_ns for one in interrupts)

    def strike() -> None:
        if waiting and seen.now_ns >= waiting[0]:
            waiting.pop(0)
            seen.interrupted = True
            signal.raise_signal(signal.SIGINT)

    def before(owner: type, name: str) -> Any:
        method: Callable[..., Any] = getattr(owner, name)

        def interrupted(*arguments: Any, **named: Any) -> Any:
            strike()
            return method(*arguments, **named)

        return mock.patch.object(owner, name, interrupted)

    def phase(owner: Any, name: str, called: str) -> Any:
        function: Callable[..., Any] = getattr(owner, name)

        def marked(*arguments: Any, **named: Any) -> Any:
            seen.mark(called)
            return function(*arguments, **named)

        return mock.patch.object(owner, name, marked)

    emulate = can_open.emulate

    def bench(*arguments: Any, body: Callable[..., Any], **named: Any) -> Network:
        def moved(angles: tuple[float, ...]) -> Any:
            seen.look()
            return body(angles)

        network = emulate(*arguments, body=moved, **named)
        seen.network = network
        return network

    with ExitStack() as stack:
        for patch in (
            mock.patch.object(can_open, "emulate", bench),
            mock.patch.object(can_plant, "STILL_PATIENCE_MS", STILL_CYCLES),
            mock.patch.object(landing, "STILL_TIME", STILL_TIME),
            mock.patch.object(landing, "PATIENCE", PATIENCE),
            before(LockstepBus, "send"),
            before(LockstepBus, "recv"),
            before(NetworkTime, "wait_until"),
            phase(loop, "_start", "start"),
            phase(loop, "_cycle", "run"),
            phase(loop, "_to_rest", "rest"),
            phase(StopSequence, "run", "stop"),
        ):
            stack.enter_context(patch)
        yield


def healthy(controllers: Iterable[str]) -> dict[tuple[str, bool], Schedule]:
    """Make the runs without faults, and return when their phases begin and end.

    Args:
        controllers: their kinds; each runs once to rest, and once to a stop.

    Raises:
        RuntimeError: one of them does not end complete.
    """
    schedules: dict[tuple[str, bool], Schedule] = {}
    for controller in controllers:
        for rests in (True, False):
            seen = play(Sequence(number=-1, controller=controller, rests=rests, strikes=()))
            if seen.status != "complete" or seen.violations:
                raise RuntimeError(f"a healthy run: {seen}")
            ends = [at_ns for at_ns, _ in seen.marks[1:]]
            schedules[controller, rests] = {
                phase: (at_ns, end_ns)
                for (at_ns, phase), end_ns in zip(seen.marks, [*ends, seen.ended_ns], strict=True)
                if end_ns > at_ns
            }
    return schedules
