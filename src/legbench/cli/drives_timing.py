"""`legbench drives jitter`: how punctual this computer is, with a recording and without."""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import arg

from legbench.cli.drives_reading import BenchFlags
from legbench.cli.output import note, print_json
from legbench.errors import ConfigError

if TYPE_CHECKING:
    from legbench.commissioning.jitter import Timing
    from legbench.drives.master.session import Session
    from legbench.recording.writer import RunWriter

WITH, WITHOUT = "with", "without"


@dataclass(frozen=True, slots=True, kw_only=True)
class Jitter:
    """Measure how punctual the cycle is; SYNC and process data flow, no drive is enabled."""

    cycles: int = 5000
    """Number of cycles."""
    cpu: int | None = None
    """Processor that the cycle stays on."""
    recording: Literal["with", "without", "both"] = WITH
    """Whether every cycle is recorded, as in a run; both measures twice."""
    out: Path | None = None
    """Folder in which the recording is kept; by default it goes to a temporary one."""
    plot: Annotated[Path | None, arg(metavar="FILE")] = None
    """Draw both distributions: .png, .svg or .pdf."""

    def run(self, bench: BenchFlags) -> int:
        """Measure and print a table, with what the system granted."""
        from legbench.commissioning.jitter import measure

        if self.cycles < 1:
            raise ConfigError(f"cycles is {self.cycles}; it must be 1 or more")
        count = os.cpu_count() or 1
        if self.cpu is not None and not 0 <= self.cpu < count:
            raise ConfigError(f"cpu is {self.cpu}; this computer has 0 to {count - 1}")
        if self.plot is not None:
            from legbench.viz.print.save import check_suffix

            check_suffix(self.plot)
        stiffness = bench.leg().stiffness
        found: dict[str, Timing] = {}
        with (
            bench.session(leads=True, read_only=True) as session,
            self._writer(session) as writer,
        ):
            granted = session.request_realtime(self.cpu)
            if writer is not None:
                found[WITH] = measure(session, stiffness, self.cycles, writer)
            if self.recording != WITH:
                found[WITHOUT] = measure(session, stiffness, self.cycles)
        if self.plot is not None:
            self._draw(next(iter(found.values())), self.plot)
        content = {
            "cycles": self.cycles,
            "time": "virtual" if granted is None else "wall",
            "granted": None if granted is None else asdict(granted),
        }
        if bench.json:
            tables = {name: timing.table() | timing.counts() for name, timing in found.items()}
            print_json(content | next(iter(tables.values())) | {"recording": tables})
            return 0
        print(f"{self.cycles} cycles in {content['time']} time")
        _print_granted(content["granted"] or {})
        for name, timing in found.items():
            _print_timing(name, timing)
        return 0

    @contextmanager
    def _writer(self, session: "Session") -> "Iterator[RunWriter | None]":
        """A recording like that of a run, before anything is asked of the system: its process
        must not stay on the processor of the loop.
        """
        from legbench.recording.writer import RunWriter

        if self.recording == WITHOUT:
            yield None
            return
        with TemporaryDirectory(prefix="legbench-jitter-") as folder:
            parent = Path(folder) if self.out is None else self.out
            manifest = {"plant": "can", "measurement": "jitter"}
            realtime = not session.virtual
            with RunWriter.create(parent, manifest, name="jitter", realtime=realtime) as writer:
                yield writer
            if self.out is not None:
                note(f"wrote {writer.path}")

    def _draw(self, timing: "Timing", path: Path) -> None:
        from legbench.viz.print.timing import draw_timing

        draw_timing(timing.late_us, timing.exchange_us, path)
        note(f"wrote {path}")


def _print_granted(granted: Mapping[str, Any]) -> None:
    for name, words in granted.items():
        print(f"  {name:<11} {words}")


def _print_timing(name: str, timing: "Timing") -> None:
    table = timing.table()
    print(f"{name} a recording")
    print(f"{'[us]':<13}" + "".join(f"{word:>9}" for word in table["late_us"]))
    for label, row in (("wake-up", "late_us"), ("exchange", "exchange_us")):
        print(f"{label:<13}" + "".join(f"{value:9.0f}" for value in table[row].values()))
    print(
        f"skipped {timing.skipped} ticks, late {timing.late}, left out {timing.silent}; "
        f"lost process data in {timing.lost} cycles"
    )
