"""`legbench drives configure|zero|home|jog`: writing to drives, moving them a little."""

from dataclasses import asdict, dataclass
from pathlib import Path

from legbench.cli.drives_reading import BenchFlags
from legbench.cli.output import note, print_json
from legbench.cli.waived import note_waived
from legbench.drives.master.session import Session
from legbench.drives.setup.config import NodeConfig
from legbench.drives.transport.realtime import Granted
from legbench.errors import ConfigError
from legbench.plants import LIMITS_NAME, limits_for


def note_granted(granted: Granted | None) -> None:
    """Say on stderr what real-time scheduling was granted; in virtual time none was asked for."""
    if granted is not None:
        note(f"SCHED_FIFO {granted.fifo}; locked memory {granted.mlockall}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Configure:
    """Compare what the drives hold with the bus file; write it only with --write."""

    write: bool = False
    """Write the whole configuration and read every object back."""

    def run(self, bench: BenchFlags) -> int:
        """Print the differences; 1 if there are any left."""
        from legbench.commissioning.configure import differences, write

        written = None
        with bench.session(leads=self.write) as session:
            if self.write:
                written = write(session)
            known = frozenset[tuple[str, str]]() if written is None else written.held
            different = [
                entry for entry in differences(session) if (entry.node, entry.object) not in known
            ]
        lines = () if written is None else written.lines
        if bench.json:
            print_json(
                {
                    "written": 0 if written is None else written.objects,
                    "not_protected": list(lines),
                    "differences": [asdict(entry) for entry in different],
                }
            )
        else:
            if written is not None:
                print(f"wrote {written.objects} objects, read every one back")
            for line in lines:
                print(line)
            for entry in different:
                print(f"{entry.node}: {entry.object} holds {entry.holds}, wanted {entry.wanted}")
            print(f"{len(different)} objects differ from {bench.bus}")
        return 1 if different else 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Zero:
    """Offsets of both encoders from a leg that is held in a known posture; nothing is enabled."""

    posture: tuple[float, float]
    """Angles q1 and q2 of the leg as it stands, springs unloaded [rad]."""
    out: Path | None = None
    """Bus file to write; by default the one that is read."""
    dry_run: bool = False
    """Whether to print the offsets without writing them."""

    def run(self, bench: BenchFlags) -> int:
        """Measure, print, write the offsets into the bus file."""
        from legbench.commissioning.zero import measure, write

        with bench.session(leads=True) as session:
            zeros = measure(session, self.posture)
        path = None if self.dry_run else write(bench.bus, zeros, self.out)
        if bench.json:
            print_json({"zeros": [asdict(zero) for zero in zeros], "out": path and str(path)})
            return 0
        for zero in zeros:
            print(
                f"{zero.node}: motor offset_counts = {zero.motor_offset}, "
                f"link offset_counts = {zero.link_offset}"
            )
        if path is not None:
            note(f"wrote {path}")
        return 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Home:
    """Home one drive by its own procedure; with methods that search, IT MOVES."""

    node: str
    """Name of the drive in the bus file."""
    method: int = 37
    """Homing method (6098h): 35 and 37 call the present position zero, all others search and MOVE:
    1 to 34 limit switch, home switch or index pulse (CiA 402), -1 to -128 are the maker's own."""
    timeout: float = 20.0
    """Longest duration of the search [s]."""

    def run(self, bench: BenchFlags) -> int:
        """Home and print the counts before and after."""
        from legbench.commissioning.home import home

        with bench.session(leads=True) as session:
            granted = session.request_realtime()
            homed = home(session, _node(session, self.node), self.method, timeout=self.timeout)
        if bench.json:
            print_json({**asdict(homed), "granted": granted and asdict(granted)})
        else:
            note_granted(granted)
            print(
                f"{homed.node}: method {homed.method}, {homed.before_counts} counts before, "
                f"{homed.after_counts} after"
            )
        return 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Jog:
    """Move one motor a little and slowly, under all limits; both drives are enabled."""

    node: str
    """Name of the drive in the bus file."""
    by: float = 0.05
    """Angle by which the motor moves, at most 0.3 rad [rad]."""
    speed: float = 0.2
    """Speed of the motion, at most 1 rad/s [rad/s]."""
    stay: bool = False
    """Whether to stay at the end of the motion instead of going back."""

    def run(self, bench: BenchFlags) -> int:
        """Jog the motor and print the positions of motors and links."""
        from legbench.commissioning.jog import jog

        design = bench.leg()
        bench.config()  # A bus file that is wrong is named before the limits beside it.
        path = bench.limits or bench.choice.bus_file.parent / LIMITS_NAME
        limits = limits_for(path, design)
        note_waived(None, limits)
        with bench.session(leads=True) as session:
            granted = session.request_realtime()
            jogged = jog(
                session,
                limits,
                design.stiffness,
                self.node,
                by=self.by,
                speed=self.speed,
                back=not self.stay,
            )
        if bench.json:
            print_json({**asdict(jogged), "granted": granted and asdict(granted)})
            return 0
        note_granted(granted)
        note("enabled where they stood; quick stop at the end")
        for place, (before, after) in enumerate(
            zip(jogged.before_pos, jogged.after_pos, strict=True), start=1
        ):
            link, torque = jogged.link_pos[place - 1], jogged.spring_torque[place - 1]
            print(
                f"motor {place}: {before:+.4f} -> {after:+.4f} rad, link {link:+.4f} rad, "
                f"spring {torque:+.4f} N m"
            )
        return 0


def nodes_named(session: Session, name: str | None) -> tuple[NodeConfig, ...]:
    """The node of a name, or all of the bus file without one; raises ConfigError."""
    return session.config.nodes if name is None else (_node(session, name),)


def _node(session: Session, name: str) -> NodeConfig:
    for node in session.config.nodes:
        if node.name == name:
            return node
    names = ", ".join(node.name for node in session.config.nodes)
    raise ConfigError(f"no node '{name}' in the bus file; there are {names}")
