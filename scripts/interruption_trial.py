"""One command on the emulated leg, interrupted at one moment, and what was seen of the drives."""

import contextlib
import io
import json
import shutil
import signal
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, final
from unittest import mock

import can

from legbench import plants
from legbench.cli import drives, main, run
from legbench.cli.drives import DrivesArguments
from legbench.cli.drives_moving import Configure, Home, Jog, Zero
from legbench.cli.drives_reading import Bench
from legbench.cli.drives_timing import Jitter
from legbench.cli.run import RunArguments
from legbench.control import BangBangConfig
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network, stiff_body
from legbench.drives.emulated.network_time import NetworkTime
from legbench.drives.emulated.power import POWERED
from legbench.drives.master.session import Session
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.drives.setup.config import BusConfig
from legbench.interrupts import STOP_SIGNALS
from legbench.plant import can as can_plant

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "legbench"
HOME = str(ROOT)
STILL_CYCLES = 30
"""A run begins so long after the way to its start, however the leg still swings."""
MS = 1_000_000
WITHIN_NS = 50 * MS
"""From an interruption to no power in any drive."""
HANDED_NS = MS
"""A frame that the controller had before the interruption may act so long after it."""
RUN_ON = 0.1
"""Longest way of a motor after an interruption [rad]."""
OFFSET, STOP = 0.02, 0.06
"""How far a run starts from its start posture, and where a search finds its stop [rad]."""
SEARCH = '"6099:01 u32" = 60_000\n'
"""Speed of a search, in the parameters of a drive [counts/s]."""
TRACED = ("drives", "plant", "commissioning", "loop.py", "plants.py", "experiment.py")
HARDWARE = ("emulated", "bus.py", "wire.py", "timebase.py", "pacer.py")
"""What stands for the drives and their wire: no signal reaches into a real drive."""
STOPPING = ("close", "stop", "_end", "unpower", "__exit__", "_tell_events", "_judged")
RUNNING = ("_cycle", "move_to", "await_end", "_script")
COMMANDS = ("run", "jog", "home", "zero", "configure", "jitter", "script")


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """One moment at which a command is interrupted."""

    command: str
    kind: str
    """`call` of the bus or its clock, source `line`, or a `driver` that raises by itself."""
    number: int
    """Which call, or which pass of the line."""
    code: CodeType | None = None
    line: int = 0
    sent: signal.Signals = signal.SIGINT
    second: int = 0
    """Calls until the second signal; 0 for none."""


@final
class Injector:
    """Counts calls and lines, and interrupts at a point.

    Attributes:
        calls: made so far.
        struck: whether the first interruption has come.
        phase: of the command when it came.
        phases: of every call, without a point.
        lines: passes of every line, without a point.
    """

    def __init__(self, point: Point | None, on_strike: Callable[[], None]) -> None:
        self.point, self._on_strike = point, on_strike
        self.calls = 0
        self.phases: list[str] = []
        self.struck = False
        self.phase = "not reached"
        self._left = 0
        self.lines: Counter[tuple[CodeType, int]] = Counter()

    def call(self) -> None:
        """A call of the bus or its clock is about to be made."""
        self.calls += 1
        point = self.point
        if point is None:
            self.phases.append(_phase(sys._getframe(2)))
        elif self.struck:
            self._left -= 1
            if self._left == 0:
                self._raise(point)
        elif point.kind != "line" and self.calls == point.number:
            self._strike(point, sys._getframe(2))

    def trace(self, frame: FrameType, _event: str, _argument: Any) -> Any:
        """Trace function for `sys.settrace`."""
        code, point = frame.f_code, self.point
        if point is None:
            return self._count if _is_ours(code.co_filename) else None
        return self._pass if code is point.code and not self.struck else None

    def _count(self, frame: FrameType, event: str, _argument: Any) -> Any:
        if event == "line":
            self.lines[frame.f_code, frame.f_lineno] += 1
        return self._count

    def _pass(self, frame: FrameType, event: str, _argument: Any) -> Any:
        point = self.point
        if point is None or self.struck:
            return None
        if event == "line" and frame.f_lineno == point.line:
            self.lines[frame.f_code, frame.f_lineno] += 1
            if self.lines[frame.f_code, frame.f_lineno] == point.number:
                sys.settrace(None)
                self._strike(point, frame)
        return self._pass

    def _strike(self, point: Point, frame: FrameType | None) -> None:
        self.struck, self._left, self.phase = True, point.second, _phase(frame)
        self._on_strike()
        self._raise(point)

    def _raise(self, point: Point) -> None:
        if point.kind == "driver":
            raise KeyboardInterrupt
        signal.raise_signal(point.sent)


@cache
def _is_ours(name: str) -> bool:
    path = Path(name)
    if not path.is_relative_to(SOURCE):
        return False
    parts = path.relative_to(SOURCE).parts
    return parts[0] in TRACED and not set(parts) & set(HARDWARE)


def _phase(frame: FrameType | None) -> str:
    names = []
    while frame is not None:
        if frame.f_code.co_filename.startswith(HOME):
            names.append(frame.f_code.co_name)
        frame = frame.f_back
    if any(name in STOPPING for name in names):
        return "stop"
    if "start" in names:
        return "start-up"
    return "run" if any(name in RUNNING for name in names) else "start-up"


@dataclass
class Witness:
    """What was seen on the bus and in the drives since an interruption."""

    network: Network | None = None
    at_ns: int | None = None
    angles: tuple[float, ...] = ()
    powered: tuple[bool, ...] = ()
    targets: dict[int, bytes] = field(default_factory=dict)
    moved: Counter[int] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)
    led: bool = False
    over: bool = False
    """The drives had their power before the interruption, and none any more."""

    def strike(self) -> None:
        """The interruption comes now."""
        if self.network is not None:
            self.at_ns = self.network.now_ns
            self.over = self.led and not any(self.powered)
            self.angles = tuple(drive.axis.motion.angle for drive in self.network.drives)

    def sent(self, message: can.Message) -> None:
        """Look at a frame of the master: after an interruption nothing leads a drive on."""
        cob_id, data = message.arbitration_id, bytes(message.data)
        if 0x200 < cob_id < 0x280 and data[0] & 0x0F == 0x0F:
            if self.at_ns is not None and data[2:] != self.targets.get(cob_id):
                self.moved[cob_id] += 1
            self.targets[cob_id] = data[2:]
        elif self.at_ns is not None and 0x600 < cob_id < 0x680:
            key, word = data[1:3], data[4]
            if data[0] == 0x23 and key == b"\x7a\x60":
                self.faults.append("a target was written")
            if data[0] == 0x2B and key == b"\x40\x60" and word & 0x04:
                self.faults.append(f"controlword {word:02X}h was written")

    def look(self) -> None:
        """One millisecond has passed."""
        network = self.network
        if network is None:
            return
        powered = tuple(drive.axis.power.state in POWERED for drive in network.drives)
        if self.at_ns is not None:
            since_ns = network.now_ns - self.at_ns
            for before, now in zip(self.powered or powered, powered, strict=True):
                if now and not before and since_ns > HANDED_NS:
                    self.faults.append(f"enabled {since_ns / MS:.1f} ms later")
            if any(powered) and since_ns > WITHIN_NS:
                self.faults.append("power after 50 ms")
        self.powered = powered
        self.led = self.led or any(powered)

    def conclude(self, *, row: bool) -> None:
        """The command has ended; `row` tells that a row may have been finished first."""
        network = self.network
        if network is None or self.at_ns is None:
            return
        if any(drive.axis.power.state in POWERED for drive in network.drives):
            self.faults.append("power at the end of the command")
        network.advance(max(network.now_ns, self.at_ns + WITHIN_NS) + 2 * MS)
        if max(self.moved.values(), default=0) > int(row):
            self.faults.append(f"{max(self.moved.values())} targets after the interruption")
        for drive, before in zip(network.drives, self.angles, strict=True):
            if abs(drive.axis.motion.angle - before) > RUN_ON:
                self.faults.append("a motor ran on")


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """What one interruption has led to."""

    phase: str
    status: int | None
    """Exit status; none for a script that ends by an exception."""
    faults: tuple[str, ...]
    injector: Injector


@final
class Theatre:
    """Plays commands on an emulated leg, with files in a folder of their own."""

    def __init__(self, folder: Path) -> None:
        """Copy the bench's files into a folder, with a speed for searches."""
        self._bus, self._runs, self._zero = folder / "leg.toml", folder / "runs", folder / "zero"
        text = (ROOT / "hardware" / "leg.toml").read_text(encoding="utf-8")
        key = "[node.parameters]\n"
        self._bus.write_text(text.replace(key, key + SEARCH), encoding="utf-8")
        shutil.copy(ROOT / "hardware" / "limits.toml", folder)
        self._design = ROOT / "models" / "optimal.toml"

    def play(self, command: str, point: Point | None = None, *, lines: bool = False) -> Trial:
        """Run a command to its end, and interrupt it at a point.

        Args:
            command: one of `COMMANDS`.
            point: where; without one all calls are counted.
            lines: count the passes of source lines, too.

        Raises:
            KeyboardInterrupt: somebody else has interrupted.
        """
        witness = Witness()
        injector = Injector(point, witness.strike)
        before = {number: signal.getsignal(number) for number in STOP_SIGNALS}
        error = io.StringIO()
        status: int | None = None
        with (
            self._patched(command, witness, injector),
            contextlib.redirect_stderr(error),
            warnings.catch_warnings(),
        ):
            # A file that was opened, and interrupted before its `with` began.
            warnings.simplefilter("ignore", ResourceWarning)
            for number in STOP_SIGNALS:
                # Outside of a command that handles them, all three raise KeyboardInterrupt.
                signal.signal(number, signal.default_int_handler)
            if lines or (point is not None and point.kind == "line"):
                sys.settrace(injector.trace)
            try:
                status = self._call(command)
            except BaseException as escaped:
                if not (command == "script" and isinstance(escaped, KeyboardInterrupt)):
                    witness.faults.append(f"{escaped!r} came out of the command")
            finally:
                sys.settrace(None)
                now = [signal.getsignal(number) for number in STOP_SIGNALS]
                for number, handler in before.items():
                    signal.signal(number, handler)
        if witness.over and injector.phase == "start-up":
            injector.phase = "stop"
        if injector.struck:
            row = command == "run" and injector.phase == "run"
            witness.conclude(row=row)
            self._judge(injector.phase, status, error.getvalue(), witness.faults)
        elif point is not None and status == 130:
            raise KeyboardInterrupt  # From outside: nothing of ours has come yet.
        if set(now) != {signal.default_int_handler}:
            witness.faults.append("a signal handler is left")
        return Trial(
            phase=injector.phase,
            status=status,
            faults=tuple(dict.fromkeys(witness.faults)),
            injector=injector,
        )

    def _judge(self, phase: str, status: int | None, error: str, faults: list[str]) -> None:
        if status not in (0, 130, None) or (phase == "start-up" and status == 0):
            faults.append(f"exit status {status}: {error.strip()}")
        faults += [
            f"said {text!r}"
            for text in ("Traceback", "keeps its power", "no longer answers")
            if text in error
        ]
        for folder in sorted(self._runs.glob("*")):
            try:
                ended = json.loads((folder / "run.json").read_text(encoding="utf-8"))["status"]
            except (OSError, ValueError) as trouble:
                ended = str(trouble)
            if ended not in ("complete", "interrupted"):
                faults.append(f"a run that says {ended}")
        shutil.rmtree(self._runs, ignore_errors=True)

    @contextlib.contextmanager
    def _patched(self, command: str, witness: Witness, injector: Injector) -> Iterator[None]:
        """Watch the bus, the clock and the drives of everything that is opened."""
        send, recv, wait = LockstepBus.send, LockstepBus.recv, NetworkTime.wait_until

        def sending(bus: LockstepBus, msg: can.Message, timeout: float | None = None) -> None:
            injector.call()
            witness.sent(msg)
            send(bus, msg, timeout)

        def receiving(bus: LockstepBus, timeout: float | None = None) -> can.Message | None:
            injector.call()
            return recv(bus, timeout)

        def waiting(timebase: NetworkTime, at_ns: int) -> None:
            injector.call()
            wait(timebase, at_ns)

        def bench(
            config: BusConfig,
            behaviours: list[Behaviour] | None = None,
            *,
            body: Callable[..., Any] = stiff_body,
            faults: tuple[Any, ...] = (),
            configured: bool = False,
        ) -> Network:
            starts = [0.0, 0.0] if behaviours is None else [one.start_pos for one in behaviours]
            off = 0.0 if behaviours is None else OFFSET
            stop = (-STOP, STOP) if command == "home" else (-3.0, 3.0)

            def seen(angles: tuple[float, ...]) -> Any:
                witness.look()
                return body(angles)

            drives_ = [Behaviour(start_pos=start + off, hard_stop=stop) for start in starts]
            network = emulate(config, drives_, body=seen, faults=faults, configured=configured)
            witness.network = network
            return network

        with (
            mock.patch.object(plants, "emulate", bench),
            mock.patch.object(can_plant, "STILL_PATIENCE", STILL_CYCLES),
            mock.patch.object(LockstepBus, "send", sending),
            mock.patch.object(LockstepBus, "recv", receiving),
            mock.patch.object(NetworkTime, "wait_until", waiting),
            mock.patch.object(drives, "parse", return_value=self._arguments(command)),
            mock.patch.object(run, "parse", return_value=self._arguments(command)),
            contextlib.redirect_stdout(io.StringIO()),
        ):
            yield

    def _call(self, command: str) -> int:
        if command == "script":
            return self._script()
        return main(["run" if command == "run" else "drives"])

    def _arguments(self, command: str) -> RunArguments | DrivesArguments | None:
        """What the command line would have made of the flags."""
        if command == "script":
            return None
        if command == "run":
            return RunArguments(
                controller=BangBangConfig(),
                design=self._design,
                plant="can",
                bus=self._bus,
                interface=plants.EMULATED,
                duration=0.1,
                out=self._runs,
            )
        bench = Bench(bus=self._bus, interface=plants.EMULATED, design=self._design)
        actions = {
            "jog": Jog(node="motor1", by=0.02, speed=0.5),
            "home": Home(node="motor1", method=-3),
            "zero": Zero(posture=(0.0, 0.0), out=self._zero),
            "configure": Configure(write=True),
            "jitter": Jitter(cycles=50),
        }
        return DrivesArguments(action=actions[command], bench=bench)

    def _script(self) -> int:
        """A user's own program, with Python's own handler of ^C."""
        config = load_bus(self._bus)
        limits = load_limits(self._bus.parent / plants.LIMITS_NAME)
        bus = LockstepBus("leg", network=plants.emulate(config))
        with Session(bus, config) as session, session.link(limits, (4.0, 5.0)) as link:
            start = link.start().motor_pos
            for cycle in range(40):
                link.command([start[0] + 5e-4 * cycle, start[1]])
                link.exchange()
        return 0
