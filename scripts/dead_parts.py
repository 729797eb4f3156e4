"""Let motors and encoders die in mid-run, and print how soon each death is found.

Every part dies on both drives, in jump, bang-bang, and a jump that sways, at seeded moments. Exit
status 1 if one is found too late, or not at all. `scripts/false_alarms.py` tries healthy legs.
"""

import argparse
import random
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import product
from multiprocessing import get_context
from pathlib import Path

from legbench.commissioning.broken_plant import Part
from legbench.commissioning.dead_part_stage import Bench, Death, Emulation
from legbench.commissioning.dead_parts import BOUND, DRIFT_BOUND, TrialOutcome, try_dead_part
from legbench.design import load_design
from legbench.servo import ServoConfig

ROOT = Path(__file__).parents[1]
EARLIEST, LATEST = 0.3, 4.0
"""When a part dies, after the beginning of a run [s]."""
BANDWIDTHS = (None, 30.0, 15.0)
"""Bandwidths of the position loops; none is ideal [Hz]."""
COUNTS = (4096, 1 << 20)
"""Counts of the encoders per turn."""
LEAN = 0.08
"""Angle by which a leg leans as it starts; it then sways as others do after minutes [rad]."""
SWAYING_EARLIEST, SWAYING_LATEST = 1.1, 2.5
"""When a part of a leg that sways dies, while it still does and has done so for a second [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One line of the table of dead parts: the moments at which one part dies."""

    part: Part
    drive: int
    controller: str
    emulation: Emulation
    sways: bool
    deaths: tuple[tuple[float, ServoConfig], ...]


def bench(*, sways: bool) -> Bench:
    """Return the bench's own files, with a leg that sways or does not."""
    return Bench(
        design=load_design(ROOT / "models" / "optimal.toml"),
        bus_file=ROOT / "hardware" / "leg.toml",
        lean=LEAN if sways else 0.0,
    )


LEGS = (("jump", False), ("bang-bang", False), ("jump", True))
"""Controllers, and whether the leg sways."""


def rows(emulations: list[Emulation], onsets: int, seed: int, *, all_legs: bool) -> Iterator[Row]:
    """Yield the trials of all lines, or of those of a leg that sways."""
    dice = random.Random(seed)
    legs = LEGS if all_legs else LEGS[-1:]
    for emulation, (controller, sways), part, drive in product(emulations, legs, Part, (0, 1)):
        yield Row(
            part=part,
            drive=drive,
            controller=controller,
            emulation=emulation,
            sways=sways,
            deaths=tuple(drawn(dice, sways=sways) for _ in range(onsets)),
        )


def drawn(dice: random.Random, *, sways: bool) -> tuple[float, ServoConfig]:
    """Draw a moment of death [s] and the servo of that trial."""
    onset = dice.uniform(*(SWAYING_EARLIEST, SWAYING_LATEST) if sways else (EARLIEST, LATEST))
    servo = ServoConfig(
        bandwidth=dice.choice(BANDWIDTHS),
        encoder_counts=dice.choice(COUNTS),
    )
    return round(onset, 3), servo


def try_row(row: Row) -> list[TrialOutcome]:
    """Let the part of a line die at every moment."""
    where = bench(sways=row.sways)
    return [
        try_dead_part(
            where,
            row.emulation,
            row.controller,
            Death(part=row.part, drive=row.drive, onset=onset),
            servo,
        )
        for onset, servo in row.deaths
    ]


def line(row: Row, found: list[TrialOutcome]) -> str:
    """Return one line of the table."""
    times = [one.time for one in found if one.time is not None]
    since = [one.since_death for one in found if one.since_death is not None]
    missed = sum(not one.within(row.part) for one in found)
    causes = ", ".join(sorted({str(one.cause) for one in found}))
    controller = f"{row.controller}, sways" if row.sways else row.controller
    return (
        f"| {row.part} | {row.drive + 1} | {controller} | {row.emulation} | {len(found)} | "
        f"{1e3 * max(times, default=0.0):.0f} | {1e3 * max(since, default=0.0):.0f} | {causes} | "
        f"{missed} |"
    )


def arguments() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--onsets", type=int, default=5, help="deaths a line")
    parser.add_argument("--seed", type=int, default=0, help="of the moments of death")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument(
        "--emulation",
        type=Emulation,
        choices=list(Emulation),
        action="append",
        help="only this one; may be given again",
    )
    parser.add_argument("--sways", action="store_true", help="only the leg that sways")
    return parser.parse_args()


def main() -> int:
    """Print the table; 1 if a part is missed."""
    chosen = arguments()
    failed = 0
    emulations = chosen.emulation or list(Emulation)
    lines = list(rows(emulations, chosen.onsets, chosen.seed, all_legs=not chosen.sways))
    with ProcessPoolExecutor(chosen.jobs, mp_context=get_context("spawn")) as pool:
        print(
            "| part | drive | controller | emulation | deaths | worst [ms] | since death [ms]"
            " | ended by | missed |\n|---|---|---|---|---|---|---|---|---|"
        )
        for row, found in zip(lines, pool.map(try_row, lines), strict=True):
            failed += sum(not one.within(row.part) for one in found)
            print(line(row, found), flush=True)
    print(f"\nbound: {1e3 * BOUND:.0f} ms, of a drift {1e3 * DRIFT_BOUND:.0f} ms")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
