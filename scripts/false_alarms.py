"""Let healthy legs run for long, one row after the other, and print which were taken for broken.

    python scripts/false_alarms.py                        # all rows that have no result yet
    python scripts/false_alarms.py 'can/jump/*' sim/bang-bang/30/4096
    python scripts/false_alarms.py --list                 # names of the rows, and nothing else

A row is named emulation/controller/servo/counts: bandwidth of the position loops [Hz] or `ideal`,
counts of both encoders in a turn. Results are appended to a text file as they come, so that a
script that is stopped loses only the row that it was at. They hold for the watch that they were
made with: once its source or its limits change, rows run again. Exit status 1 if a healthy leg
was taken for a broken one.
"""

import argparse
import csv
import hashlib
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import product
from pathlib import Path
from typing import NamedTuple

from legbench.commissioning.dead_part_stage import CONTROLLERS, Bench, Emulation
from legbench.commissioning.dead_parts import watch_healthy
from legbench.design import load_design
from legbench.servo import ServoConfig

ROOT = Path(__file__).parents[1]
DESIGN, BUS = ROOT / "models" / "optimal.toml", ROOT / "hardware" / "leg.toml"
RESULTS = ROOT / ".cache" / "false_alarms.csv"
BANDWIDTHS = {"ideal": None, "30": 30.0, "15": 15.0}
"""Name of a servo -> bandwidth of its position loops [Hz]."""
COUNTS = (4096, 1 << 20)
"""Counts of the encoders per turn."""
EMULATIONS = (Emulation.SIM, Emulation.CAN)
"""Emulations that are tried; the equations hop as MuJoCo does, at the price of the bus."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A healthy leg that runs for long."""

    emulation: Emulation
    controller: str
    servo: str
    counts: int

    @property
    def name(self) -> str:
        """How the command line calls it."""
        return f"{self.emulation}/{self.controller}/{self.servo}/{self.counts}"

    def run(self, seconds: float) -> str | None:
        """Run it for a virtual time [s]; what ended it early, if anything did."""
        servo = ServoConfig(bandwidth=BANDWIDTHS[self.servo], encoder_counts=self.counts)
        bench = Bench(design=load_design(DESIGN), bus_file=BUS)
        return watch_healthy(bench, self.emulation, self.controller, servo, seconds)


class Result(NamedTuple):
    """A line of the file of results."""

    row: str
    seconds: str
    """Virtual time that the row was to last [s]."""
    watch: str
    """Digest of the watch that looked on."""
    cpu: str
    """Time of the processor that it took [s]."""
    alarm: str
    """Fault that ended it, or `none`."""


def rows() -> Iterator[Row]:
    """Yield all rows: ideal and slowest servos first, which are the extremes."""
    for servo, emulation, controller, counts in product(
        ("ideal", "15", "30"), EMULATIONS, CONTROLLERS, COUNTS
    ):
        yield Row(emulation=emulation, controller=controller, servo=servo, counts=counts)


def watch_digest() -> str:
    """Return what tells one watch from another: its source, its limits and the leg it watches."""
    source, digest = ROOT / "src" / "legbench", hashlib.sha256()
    watch = (*sorted((source / "limits").glob("*.py")), source / "plant" / "leg_momentum.py")
    for path in (*watch, BUS.parent / "limits.toml", BUS, DESIGN):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def results(file: Path, seconds: float, watch: str) -> dict[str, Result]:
    """Return the results of this watch over at least so long [s], by row."""
    if not file.exists():
        return {}
    with file.open(newline="") as lines:
        found = [Result(*fields) for fields in csv.reader(lines) if len(fields) == 5]
    return {one.row: one for one in found if one.watch == watch and float(one.seconds) >= seconds}


def run_row(row: Row, seconds: float, watch: str, file: Path) -> None:
    """Run a row and append its result."""
    began = time.process_time()
    alarm = row.run(seconds) or "none"
    cpu = f"{time.process_time() - began:.0f}"
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("a", newline="") as lines:
        csv.writer(lines).writerow(Result(row.name, f"{seconds:g}", watch, cpu, alarm))


def print_table(found: dict[str, Result]) -> None:
    """Print one line a row that has a result."""
    print("| emulation | controller | servo [Hz] | counts | virtual time [s] | CPU [s] | alarm |")
    print("|---|---|---|---|---|---|---|")
    for name, one in found.items():
        print(f"| {' | '.join(name.split('/'))} | {one.seconds} | {one.cpu} | {one.alarm} |")


def main() -> int:
    """Run what is missing, print the table; 1 if there was a false alarm."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("rows", nargs="*", default=["*"], help="names, or patterns of names")
    parser.add_argument("--seconds", type=float, default=600.0, help="virtual time of each row")
    parser.add_argument("--results", type=Path, default=RESULTS, help="file of the results")
    parser.add_argument("--list", action="store_true", help="print the names of the rows")
    chosen = parser.parse_args()
    wanted = [row for row in rows() if any(fnmatchcase(row.name, one) for one in chosen.rows)]
    if not wanted:
        parser.error(f"no row is called {', '.join(chosen.rows)}; --list prints their names")
    if chosen.list:
        print("\n".join(row.name for row in wanted))
        return 0
    watch = watch_digest()
    for row in wanted:
        if row.name not in results(chosen.results, chosen.seconds, watch):
            run_row(row, chosen.seconds, watch, chosen.results)
            print(f"{row.name} has run", file=sys.stderr, flush=True)
    done = results(chosen.results, chosen.seconds, watch)
    print_table({row.name: done[row.name] for row in wanted})
    return int(any(done[row.name].alarm != "none" for row in wanted))


if __name__ == "__main__":
    sys.exit(main())
