"""One command on the emulated leg, interrupted at one moment, and what was seen of the drives."""

import contextlib
import io
import json
import shutil
import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final
from unittest import mock

import can
from interruption_points import ROOT, Injector, Point
from interruption_witness import Witness

from legbench import loop
from legbench.cli import drives, main
from legbench.cli.drives import DrivesArguments
from legbench.cli.drives_moving import Configure, Home, Jog, Zero
from legbench.cli.drives_reading import BenchFlags
from legbench.cli.drives_timing import Jitter
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.body import stiff_body
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.network_time import NetworkTime
from legbench.drives.master.session import Session
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.drives.setup.config import BusConfig
from legbench.interrupts import STOP_SIGNALS
from legbench.plant import can as can_plant
from legbench.plant import can_open, landing
from legbench.plant.can_choice import EMULATED, LIMITS_NAME

STILL_CYCLES = 30
"""A run begins so long after the way to its start, however the leg still swings."""
STILL_TIME, PATIENCE = 0.02, 0.1
"""So long a leg has to be still at the end of a run, or has for it [s]: enough to be interrupted
there, and seconds less than a leg really needs."""
OFFSET, STOP, FAR = 0.02, 0.06, 3.0
"""How far a run starts from its start posture, where a search finds its stop, and where stops are
that nobody meets [rad]."""
SEARCH, FAST = '"6099:01 u32" = 12517', '"6099:01 u32" = 60_000'
"""Speed of a search, in the parameters of a drive [counts/s]."""
COMMANDS = ("run", "rest", "jog", "home", "zero", "configure", "jitter", "script")
"""`rest` is a run that ends with its way to rest, `run` one that ends with a stop at once."""
RUNS = ("run", "rest")


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """What one interruption has led to."""

    phase: str
    status: int | None
    """Exit status; none for a script that ends by an exception."""
    faults: tuple[str, ...]
    injector: Injector


@final
class TrialBench:
    """Plays commands on an emulated leg, with files in a folder of their own."""

    def __init__(self, folder: Path) -> None:
        """Copy the bench's files into a folder, with a higher speed of searches."""
        self._bus, self._runs, self._zero = folder / "leg.toml", folder / "runs", folder / "zero"
        text = (ROOT / "hardware" / "leg.toml").read_text(encoding="utf-8")
        self._bus.write_text(text.replace(SEARCH, FAST), encoding="utf-8")
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
            row = command in RUNS and injector.phase == "run"
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
        cycle = loop._cycle

        def cycling(*arguments: Any) -> loop.Outcome:
            injector.began = True
            return cycle(*arguments)

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
            body_period_ns: int | None = None,
            faults: tuple[Any, ...] = (),
            configured: bool = False,
        ) -> Network:
            found = behaviours or [Behaviour(start_pos=start) for start in can_open.IDLE_POS]
            starts = [one.start_pos + (OFFSET if behaviours else 0.0) for one in found]
            reach = STOP if command == "home" else FAR

            def seen(angles: tuple[float, ...]) -> Any:
                witness.look()
                return body(angles)

            drives_ = [
                Behaviour(start_pos=start, hard_stop=(start - reach, start + reach))
                for start in starts
            ]
            network = emulate(
                config,
                drives_,
                body=seen,
                body_period_ns=body_period_ns,
                faults=faults,
                configured=configured,
            )
            witness.network = network
            return network

        with (
            mock.patch.object(can_open, "emulate", bench),
            mock.patch.object(can_plant, "STILL_PATIENCE_MS", STILL_CYCLES),
            mock.patch.object(landing, "STILL_TIME", STILL_TIME),
            mock.patch.object(landing, "PATIENCE", PATIENCE),
            mock.patch.object(loop, "_cycle", cycling),
            mock.patch.object(LockstepBus, "send", sending),
            mock.patch.object(LockstepBus, "recv", receiving),
            mock.patch.object(NetworkTime, "wait_until", waiting),
            mock.patch.object(drives, "parse", return_value=self._arguments(command)),
            contextlib.redirect_stdout(io.StringIO()),
        ):
            yield

    def _call(self, command: str) -> int:
        if command == "script":
            return self._script()
        if command not in RUNS:
            return main(["drives"])
        end = "rest" if command == "rest" else "stop"
        words = ["bang-bang", "--design", str(self._design), "--plant", "can", "--end", end]
        words += ["--bus", str(self._bus), "--interface", EMULATED, "--duration", "0.05"]
        return main(["run", *words, "--out", str(self._runs)])

    def _arguments(self, command: str) -> DrivesArguments | None:
        """What the command line would have made of the flags."""
        if command == "script" or command in RUNS:
            return None
        bench = BenchFlags(bus=self._bus, interface=EMULATED, design=self._design)
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
        limits = load_limits(self._bus.parent / LIMITS_NAME)
        bus = LockstepBus("leg", network=can_open.emulate(config))
        with Session(bus, config) as session, session.link(limits, (4.0, 5.0)) as link:
            start = link.start().motor_pos
            for cycle in range(40):
                link.command([start[0] + 5e-4 * cycle, start[1]])
                link.exchange()
        return 0
