"""Let motors and encoders die in mid-run, and let healthy legs run for long; print both tables.

Every part dies on both drives, in jump and bang-bang, at seeded moments. Exit status 1 if one is
found too late, or not at all, or if a healthy leg is taken for a broken one.
"""

import argparse
import random
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from legbench.commissioning.broken_plant import Part
from legbench.commissioning.dead_parts import (
    BOUND,
    CONTROLLERS,
    DRIFT_BOUND,
    Bench,
    Death,
    Emulation,
    TrialOutcome,
    try_dead_part,
    watch_healthy,
)
from legbench.design import load_design
from legbench.servo import ServoConfig

ROOT = Path(__file__).parents[1]
EARLIEST, LATEST = 0.3, 4.0
"""When a part dies, after the beginning of a run [s]."""
BANDWIDTHS = (None, 30.0, 15.0)
"""Of the position loops; none is ideal [Hz]."""
COUNTS = (4096, 1 << 20)
"""Of the encoders, in a turn."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One line of the table of dead parts: the moments at which one part dies."""

    part: Part
    drive: int
    controller: str
    emulation: Emulation
    deaths: tuple[tuple[float, ServoConfig], ...]


def bench() -> Bench:
    """Return the bench's own files."""
    return Bench(
        design=load_design(ROOT / "models" / "optimal.toml"),
        bus_file=ROOT / "hardware" / "leg.toml",
    )


def rows(emulations: list[Emulation], onsets: int, seed: int) -> Iterator[Row]:
    """Yield the trials of all lines."""
    dice = random.Random(seed)
    for emulation in emulations:
        for controller in ("jump", "bang-bang"):
            for part in Part:
                for drive in (0, 1):
                    deaths = tuple(
                        (
                            round(dice.uniform(EARLIEST, LATEST), 3),
                            ServoConfig(
                                bandwidth=dice.choice(BANDWIDTHS),
                                encoder_counts=dice.choice(COUNTS),
                            ),
                        )
                        for _ in range(onsets)
                    )
                    yield Row(
                        part=part,
                        drive=drive,
                        controller=controller,
                        emulation=emulation,
                        deaths=deaths,
                    )


def try_row(row: Row) -> list[TrialOutcome]:
    """Let the part of a line die at every moment."""
    where = bench()
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
    return (
        f"| {row.part} | {row.drive + 1} | {row.controller} | {row.emulation} | {len(found)} | "
        f"{1e3 * max(times, default=0.0):.0f} | {1e3 * max(since, default=0.0):.0f} | {causes} | "
        f"{missed} |"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Healthy:
    """One run of a leg that is well."""

    emulation: Emulation
    controller: str
    servo: ServoConfig
    seconds: float


def healthy(emulations: list[Emulation], seconds: float) -> Iterator[Healthy]:
    """Yield the runs of legs that are well."""
    for emulation in emulations:
        for counts in COUNTS:
            for controller in CONTROLLERS:
                for bandwidth in BANDWIDTHS:
                    servo = ServoConfig(bandwidth=bandwidth, encoder_counts=counts)
                    yield Healthy(
                        emulation=emulation, controller=controller, servo=servo, seconds=seconds
                    )


def try_healthy(run: Healthy) -> str | None:
    """Run a leg that is well; what ended the run before its time."""
    return watch_healthy(bench(), run.emulation, run.controller, run.servo, run.seconds)


def arguments() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--seconds", type=float, default=600.0, help="virtual time of each healthy run; 0: none"
    )
    parser.add_argument("--onsets", type=int, default=5, help="deaths a line; 0: none")
    parser.add_argument("--seed", type=int, default=0, help="of the moments of death")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument(
        "--emulation",
        type=Emulation,
        choices=list(Emulation),
        action="append",
        help="only this one; may be given again",
    )
    return parser.parse_args()


def main() -> int:
    """Print the tables; 1 if a part is missed or a healthy leg is not."""
    chosen = arguments()
    emulations = chosen.emulation or list(Emulation)
    failed = 0
    with ProcessPoolExecutor(chosen.jobs, mp_context=get_context("spawn")) as pool:
        if chosen.onsets:
            lines = list(rows(emulations, chosen.onsets, chosen.seed))
            print(
                "| part | drive | controller | emulation | deaths | worst [ms] | since death [ms]",
                end="",
            )
            print(" | ended by | missed |\n|---|---|---|---|---|---|---|---|---|")
            for row, found in zip(lines, pool.map(try_row, lines), strict=True):
                failed += sum(not one.within(row.part) for one in found)
                print(line(row, found), flush=True)
            print(f"\nbound: {1e3 * BOUND:.0f} ms, of a drift {1e3 * DRIFT_BOUND:.0f} ms\n")
        if chosen.seconds > 0.0:
            runs = list(healthy(emulations, chosen.seconds))
            print("| emulation | controller | servo [Hz] | counts | virtual time [s] | alarm |")
            print("|---|---|---|---|---|---|")
            for run, alarm in zip(runs, pool.map(try_healthy, runs), strict=True):
                failed += alarm is not None
                print(
                    f"| {run.emulation} | {run.controller} | {run.servo.bandwidth or 'ideal'} | "
                    f"{run.servo.encoder_counts} | {run.seconds:g} | {alarm or 'none'} |",
                    flush=True,
                )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
