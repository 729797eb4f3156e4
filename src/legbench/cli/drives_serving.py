"""`legbench drives emulate|monitor`: running until told to stop."""

import math
import sys
import time
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from legbench.cli.drives_reading import BenchFlags
from legbench.cli.output import note, print_json, report_error
from legbench.errors import ConfigError
from legbench.shipped import locate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from legbench.commissioning.emulate import Server
    from legbench.drives.emulated.body import Body
    from legbench.drives.emulated.network import Network
    from legbench.drives.setup.config import BusConfig

UNIX, SLCAN = "legbench_unix", "slcan"
"""Interfaces of a bus behind a socket file, and behind a terminal."""


def _check_time(name: str, value: float) -> None:
    if not value > 0.0:
        raise ConfigError(f"{name} is {value:g} s; it must be positive")


def _at_bitrate(config: "BusConfig", bitrate: int | None) -> "BusConfig":
    return config if bitrate is None else replace(config, bitrate=bitrate)


def only(config: "BusConfig", name: str) -> "BusConfig":
    """Return a bus with one of its drives alone; raises ConfigError for another name."""
    nodes = tuple(node for node in config.nodes if node.name == name)
    if not nodes:
        names = ", ".join(node.name for node in config.nodes)
        raise ConfigError(f"no node '{name}' in the bus file; there are {names}")
    return replace(config, nodes=nodes)


def _wearing(config: "BusConfig", eds: Path | None) -> "BusConfig":
    """Give all nodes of a bus one data sheet, if there is one."""
    if eds is None:
        return config
    return replace(config, nodes=tuple(replace(node, eds=eds) for node in config.nodes))


def _tell_problems(config: "BusConfig") -> None:
    """Say which drives cannot be used as the bus file says; they are served all the same."""
    from legbench.commissioning.learn import problems_of

    for problem in problems_of(config):
        report_error(problem)


def _print_state(as_json: bool, at: float, node: str, state: str) -> None:
    """Print the new state of a drive, `at` so many seconds after the start."""
    if as_json:
        print_json({"time": at, "node": node, "state": state})
    else:
        print(f"{at:9.3f} s  {node}: {state}")
    sys.stdout.flush()


@dataclass(frozen=True, slots=True, kw_only=True)
class Emulate:
    """Emulate a leg for other processes, at --channel: a socket file for legbench_unix.

    Drives that hang on several channels are served at a place each, --channel A,B. With
    --serve slcan the leg sits behind pseudo terminals, as behind adapters on serial lines, and
    --channel may name links to them. With --interface it sits on those buses, such as socketcan on
    a vcan. --bitrate is that of the emulated wire.
    """

    serve: Literal["unix", "slcan"] = "unix"
    """Way in which other processes reach it: a socket file, or python-can's slcan on a terminal."""
    bare: bool = False
    """Whether the shafts are bare, so that MuJoCo is not needed."""
    only: str | None = None
    """Name of the only drive of the bus file on this bus, bare, such as for `drives node-id`."""
    eds: Path | None = None
    """Data sheet (EDS) whose dictionary all drives wear; else those that the bus file names."""
    patience: int = 5
    """Number of periods without SYNC or target that fault a drive; more on a busy machine."""
    seconds: float = math.inf
    """Time after which the command ends [s]."""

    def run(self, bench: BenchFlags) -> int:
        """Serve until ^C or SIGTERM, printing every change of a drive's state."""
        _check_time("seconds", self.seconds)
        self._check_way(bench)
        from legbench.commissioning.emulate import serve
        from legbench.drives.emulated.bus_server import BusServer
        from legbench.drives.emulated.slcan_server import SlcanServer
        from legbench.drives.emulated.unix_server import ChannelsServer, UnixServer
        from legbench.interrupts import stop_on_interrupt
        from legbench.plant.can_open import open_session

        bench = replace(bench, bus=locate(bench.bus))
        config = _wearing(_at_bitrate(bench.config(), bench.bitrate), self.eds)
        start_pos, body = self._leg(bench)
        if self.only is not None:
            config, start_pos = only(config, self.only), (0.0,)
        paths = self._paths(bench, config)
        end = time.monotonic() + self.seconds

        _tell_problems(config)

        def serve_at(networks: "Sequence[Network]") -> "Server":
            if self.serve == SLCAN:
                return SlcanServer(networks, paths, warn=note)
            if len(paths) > 1:
                return ChannelsServer(networks, paths)
            if paths:
                return UnixServer(networks[0], paths[0])
            return BusServer(networks, open_session(config, bench.choice, leads=False).bus)

        with stop_on_interrupt() as stop:
            serve(
                config,
                serve_at,
                start_pos=start_pos,
                body=body,
                patience=self.patience,
                report=partial(_print_state, bench.json),
                ready=partial(self._tell_ready, bench, config.bitrate),
                stop=lambda: stop.is_set or time.monotonic() > end,
            )
        return 0

    @staticmethod
    def _tell_ready(bench: BenchFlags, bitrate: int, server: "Server") -> None:
        """Say how a program reaches the drives."""
        from legbench.drives.emulated.slcan_server import SlcanServer

        interface, channel, at = bench.interface or UNIX, bench.channel, ""
        if isinstance(server, SlcanServer):
            interface, channel, at = SLCAN, server.path, f" --bitrate {bitrate}"
        note(f"serving {channel}; use it with --interface {interface} --channel {channel}{at}")

    def _paths(self, bench: BenchFlags, config: "BusConfig") -> tuple[Path, ...]:
        """Socket files to serve, or links to terminals, one a channel; none where none are asked.

        Raises:
            ConfigError: it is not one path for each channel that drives hang on.
        """
        slcan = self.serve == SLCAN
        if bench.interface not in (None, UNIX) or (slcan and bench.channel is None):
            return ()
        channel = bench.channel or ""
        if len(config.channels) == 1:
            return (Path(channel),)
        given = channel.split(",")
        if len(given) != len(config.channels) or len(set(filter(None, given))) != len(given):
            kind = "link" if slcan else "socket file"
            example = ",".join(f"{name}.{'tty' if slcan else 'sock'}" for name in config.channels)
            raise ConfigError(
                f"the bus file's drives hang on {len(config.channels)} channels, "
                f"{', '.join(map(str, config.channels))}; each is a wire of its own: give a "
                f"{kind} for each, --channel {example}"
            )
        return tuple(map(Path, given))

    def _leg(self, bench: BenchFlags) -> "tuple[tuple[float, ...], Body]":
        """Motor positions at power-on [rad], and what hangs on the shafts."""
        from legbench.control import JumpConfig
        from legbench.drives.emulated.body import stiff_body
        from legbench.experiment import Experiment, start_of
        from legbench.plant.emulated_leg import EmulatedLeg

        chosen = Experiment(design=bench.leg(), controller=JumpConfig())
        start = start_of(chosen)
        bare = self.bare or self.only is not None
        body = stiff_body if bare else EmulatedLeg(chosen.design, chosen.options, start)
        return tuple(start.motor_pos.tolist()), body

    def _check_way(self, bench: BenchFlags) -> None:
        from legbench.drives.transport.system import require_linux

        require_linux("serving an emulated leg to other processes")
        if self.patience < 1:
            raise ConfigError(f"patience is {self.patience}; it must be 1 period or more")
        if self.serve == SLCAN and bench.interface is not None:
            raise ConfigError(
                f"--serve slcan makes a terminal of its own, --interface {bench.interface} is "
                "another bus: give one of the two"
            )
        if self.serve != SLCAN and bench.channel is None:
            raise ConfigError(
                "emulate needs --channel: a socket file, or a bus with --interface; or --serve "
                "slcan, which makes a terminal"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Monitor:
    """Listen beside a master without sending anything, and print what the drives report."""

    seconds: float = math.inf
    """Time after which the command ends [s]."""
    every: float = 0.2
    """Time between two looks [s]."""

    def run(self, bench: BenchFlags) -> int:
        """Print a line a drive, in place on a terminal, until ^C."""
        from legbench.commissioning.monitor import monitor

        _check_time("seconds", self.seconds)
        _check_time("every", self.every)
        in_place = sys.stdout.isatty() and not bench.json
        with bench.session(leads=False) as session:
            seconds = min(self.seconds, 1e9)
            for count, (at, lines) in enumerate(
                monitor(session, seconds=seconds, every=self.every)
            ):
                if bench.json:
                    print_json({"time": at, "drives": lines})
                    continue
                if in_place and count:
                    print(f"\x1b[{len(lines)}F", end="")
                for line in lines:
                    print(f"{at:9.3f} s  {line}" + ("\x1b[K" if in_place else ""))
                sys.stdout.flush()
        return 0
