"""`legbench drives scan|status|budget`: looking, never enabling."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from legbench.cli.output import note, print_json
from legbench.cli.waived import note_waived
from legbench.design import LegDesign, load_design
from legbench.drives.master.session import Session
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.config import BusConfig
from legbench.errors import ConfigError
from legbench.plant.can_choice import CanChoice
from legbench.plant.can_open import open_session
from legbench.shipped import locate

if TYPE_CHECKING:
    from legbench.drives.setup.wire import LoadEntry


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchFlags:
    """Flags of every action on a bus: which bus it is, and how results are printed."""

    bus: Path = Path("hardware/leg.toml")
    """Bus file, which describes the drives."""
    interface: str | None = None
    """Name of the interface in python-can; by default the bus file's."""
    channel: str | None = None
    """Channel of the interface, such as can0; by default the bus file's."""
    bitrate: int | None = None
    """Bitrate of interfaces that set their own; by default the bus file's [bit/s]."""
    design: Path = Path("models/optimal.toml")
    """Design file: springs, and the limits that no limits file may exceed."""
    limits: Path | None = None
    """Safety limits; by default limits.toml beside the bus file."""
    json: bool = False
    """Print one JSON object on stdout."""

    @property
    def choice(self) -> CanChoice:
        """Plant choice that these flags make."""
        return CanChoice(
            bus=self.bus, interface=self.interface, channel=self.channel, bitrate=self.bitrate
        )

    def config(self) -> BusConfig:
        """Drives of the bus file; raises ConfigError."""
        return load_bus(self.choice.bus_file)

    def leg(self) -> LegDesign:
        """Design of the leg; raises DesignError."""
        return load_design(self.design)

    def session(self, *, leads: bool, read_only: bool = False) -> AbstractContextManager[Session]:
        """Open the bus; whoever leads drives locks its channel; raises ConfigError, BusError."""
        if leads:
            note_waived(self.choice.bus_file, None)
        choice = replace(self.choice, read_only=read_only)
        return open_session(self.config(), choice, leads=leads)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scan:
    """List the nodes on the bus; nothing is written."""

    last: int = 127
    """Highest node id to ask."""

    def run(self, bench: BenchFlags) -> int:
        """Print every node; 1 if a node of the bus file is not there, or two drives share an id."""
        from legbench.commissioning.scan import scan
        from legbench.drives.protocol.frame import LAST_NODE

        if not 1 <= self.last <= LAST_NODE:
            raise ConfigError(f"last is {self.last}; node ids are 1 to {LAST_NODE}")
        with bench.session(leads=False) as session:
            found = list(scan(session, self.last))
            names = {f"'{node.name}' of the bus file" for node in session.config.nodes}
        if bench.json:
            print_json({"nodes": [asdict(node) for node in found]})
        else:
            for node in found:
                print(
                    f"node {node.node_id:3d}  vendor {node.vendor:#010x}  product "
                    f"{_told(node.product, '#010x')}  serial {_told(node.serial)}  revision "
                    f"{_told(node.revision)}  "
                    f"{node.verdict}"
                )
        double = [node for node in found if node.answers > 1]
        for node in double:
            note(
                f"{node.answers} drives answer as node {node.node_id}: disconnect all but one, "
                "give it another node id with `legbench drives node-id`, then connect the next"
            )
        missing = sorted(names - {node.verdict for node in found})
        for verdict in missing:
            note(
                f"not there: {verdict}; look at its power, its wiring and the bitrate, "
                f"{session.config.bitrate_text}"
            )
        return 1 if missing or double else 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Status:
    """Print what the drives say of themselves, in words."""

    def run(self, bench: BenchFlags) -> int:
        """Print state, mode, error and encoders of every drive."""
        from legbench.commissioning.status import status

        with bench.session(leads=False) as session:
            nodes = status(session)
        if bench.json:
            print_json({"nodes": [asdict(node) for node in nodes]})
            return 0
        for node in nodes:
            heat = "" if node.temperature is None else f", {node.temperature:.1f} deg C"
            print(f"{node.name} (node {node.node_id}): {node.statusword}")
            homed = {None: "", True: ", homed", False: ", NOT HOMED"}[node.homed]
            print(f"  mode {node.mode}, error {node.error}{heat}{homed}")
            second = ", no second encoder"
            if node.link_pos is not None:
                second = f", link {node.link_pos:+.4f} rad ({node.link_counts} counts)"
            print(f"  {node.side} {node.motor_pos:+.4f} rad ({node.motor_counts} counts){second}")
        return 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """Compute the worst bus load of the schedule in the bus file; no bus is opened.

    It also says how soon every drive stands when its master is gone, and checks bus and limits
    files against each other.
    """

    def run(self, bench: BenchFlags) -> int:
        """Print every frame; raises ConfigError where a channel or the files do not fit."""
        from legbench.commissioning.learn import known_means
        from legbench.drives.setup.checks import check_together
        from legbench.drives.setup.exchange import check_budget, exchanges
        from legbench.drives.setup.wire import MAX_LOAD, bus_load, schedule
        from legbench.plants import LIMITS_NAME, joint_ranges, limits_for

        bench = replace(bench, bus=locate(bench.bus))
        config = bench.config().at(bench.bitrate)
        limits = limits_for(bench.limits or bench.bus.parent / LIMITS_NAME, bench.leg())
        means = known_means(config, speed=limits.command_speed)
        entries = [(one, entry) for one in config.channels for entry in schedule(config, one)]
        load = max(bus_load(config, one) for one in config.channels)
        if bench.json:
            print_json(
                {
                    "bitrate": config.bitrate,
                    "load": load,
                    "limit": MAX_LOAD,
                    "frames": [asdict(entry) | {"channel": one} for one, entry in entries],
                    "exchanges": [asdict(one) for one in exchanges(config)],
                    "deadline_us": config.deadline_us,
                    "period_us": config.period_us,
                    "master_watch": {
                        name: [asdict(one) | {"stop_ms": one.stop_ms} for one in found]
                        for name, found in means.items()
                    },
                }
            )
        else:
            _print_budget(config, entries, load)
            for name, found in means.items():
                texts = [f"{one.stop_ms:.0f} ms by {one.name}" for one in found]
                stands = f"stands after {' or '.join(texts)}" if texts else "is not known to stop"
                print(f"without master, {name} {stands}")
        check_budget(config)
        check_together(config, limits, stops=joint_ranges(bench.leg()))
        return 0


def _told(number: int | None, form: str = "d") -> str:
    """A number of the identity object, or that a drive tells none."""
    return "not told" if number is None else format(number, form)


def _print_budget(
    config: BusConfig, entries: "Sequence[tuple[str | None, LoadEntry]]", load: float
) -> None:
    """Print what every frame takes of its wire, one of several by name, and when the last come."""
    from legbench.drives.setup.exchange import exchanges
    from legbench.drives.setup.wire import MAX_LOAD

    several = len(config.channels) > 1
    for channel, entry in entries:
        share = 100 * entry.bits * entry.rate / config.bitrate
        of = f" of {channel}" if several else ""
        print(f"{entry.what:<24} {entry.bits:4d} bits  {entry.rate:7.1f} /s  {share:5.1f} %{of}")
    print(
        f"{'worst load':<24} {100 * load:.1f} % of {config.bitrate} bit/s, the limit is "
        f"{100 * MAX_LOAD:.0f} %"
    )
    for one in exchanges(config):
        where = f"exchange {one.channel or ''}".strip()
        print(
            f"{where:<24} last answer {one.answers_us:.0f} us after SYNC, the deadline is "
            f"{config.deadline_us}; last command {one.commands_us:.0f} of {config.period_us} us"
        )
