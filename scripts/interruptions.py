"""Interrupt commands on the emulated leg at every kind of moment: drives end without power.

python scripts/interruptions.py --points 3000

A point is one command, from its start to its end in virtual time, with one or two signals in it: at
a call of the bus or of its clock, at a source line of ours, or as a KeyboardInterrupt that a driver
itself raises. Afterwards no drive that had no power may have got any, no target may have moved
except that of the row that had begun, and no drive may have power 50 ms later, nor when the
command has ended. `script` is a program of a user's own, with Python's own handler of ^C.
"""

import argparse
import contextlib
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from interruption_points import Injector, Point
from interruption_trial import TrialBench

from legbench.interrupts import STOP_SIGNALS, stop_on_interrupt

WEIGHTS = {
    "run": 4,
    "rest": 4,
    "jog": 9,
    "home": 9,
    "script": 4,
    "zero": 1,
    "configure": 2,
    "jitter": 2,
}
"""Share of each command among the points."""
KINDS = ("call",) * 9 + ("line",) * 9 + ("driver",) * 2
"""Where a signal comes from, and how often."""
PHASES = ("start-up", "run", "stop")
FOLLOWS = 60
"""A second signal comes at most so many calls after the first."""


def points(found: dict[str, Injector], count: int, seed: int) -> Iterator[Point]:
    """Draw moments: every phase of a command, and every line, is as likely as another."""
    chance = random.Random(seed)
    for _ in range(count):
        (command,) = chance.choices(list(found), [WEIGHTS[name] for name in found])
        injector, kind = found[command], chance.choice(KINDS)
        # A user's own program has Python's handler for ^C, and none for the others.
        number = STOP_SIGNALS[-1] if command == "script" else chance.choice(STOP_SIGNALS)
        point = Point(
            command=command,
            kind=kind,
            number=0,
            sent=number,
            second=chance.choice((0, chance.randint(1, FOLLOWS))),
        )
        if kind == "line":
            places = sorted(injector.lines, key=lambda place: (place[0].co_filename, place[1]))
            code, line = chance.choice(places)
            passes = chance.randint(1, injector.lines[code, line])
            yield replace(point, code=code, line=line, number=passes)
            continue
        phase = chance.choice(sorted(set(injector.phases)))
        calls = [at for at, there in enumerate(injector.phases, start=1) if there == phase]
        yield replace(point, number=chance.choice(calls))


def describe(point: Point) -> str:
    """A point in words, to find it again."""
    where = f"call {point.number}"
    if point.code is not None:
        name = f"{Path(point.code.co_filename).name}:{point.line}"
        where = f"{name} ({point.code.co_qualname}), pass {point.number}"
    second = f", again {point.second} calls later" if point.second else ""
    return f"{point.command}, {point.kind}, {point.sent.name} at {where}{second}"


def table(seen: Counter[tuple[str, str, bool]]) -> str:
    """Points by command and phase, single and double."""
    lines = [f"{'command':<12}" + "".join(f"{phase:>20}" for phase in PHASES) + f"{'all':>8}"]
    for command in WEIGHTS:
        cells = [(seen[command, phase, False], seen[command, phase, True]) for phase in PHASES]
        text = "".join(f"{f'{one} + {two}':>20}" for one, two in cells)
        lines.append(f"{command:<12}{text}{sum(map(sum, cells)):>8}")
    return "\n".join([*lines, "single + double interruptions"])


def main() -> int:
    """Interrupt, and tell what was found; 1 if anything was."""
    parser = argparse.ArgumentParser(
        description=__doc__, allow_abbrev=False, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--points", type=int, default=3000, help="how many")
    parser.add_argument("--seed", type=int, default=0, help="of the choice of moments")
    parser.add_argument(
        "--commands", nargs="+", choices=list(WEIGHTS), default=list(WEIGHTS), help="which; all"
    )
    chosen = parser.parse_args()
    seen, bad, missed = Counter[tuple[str, str, bool]](), 0, 0
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as name:
        bench = TrialBench(Path(name))
        found: dict[str, Injector] = {}
        for command in chosen.commands:
            bench.play(command)  # What is imported late is there afterwards.
            found[command] = bench.play(command, lines=True).injector
        with stop_on_interrupt() as stop, contextlib.suppress(KeyboardInterrupt):
            for count, point in enumerate(points(found, chosen.points, chosen.seed), start=1):
                if stop.is_set:
                    break
                trial = bench.play(point.command, point)
                if not trial.injector.struck:
                    missed += 1
                else:
                    seen[point.command, trial.phase, point.second > 0] += 1
                if trial.faults:
                    bad += 1
                    found_here = "; ".join(trial.faults)
                    print(f"{describe(point)} [{trial.phase}]: {found_here}", flush=True)
                if count % 50 == 0:
                    print(f"{count} of {chosen.points}, {bad} bad", file=sys.stderr, flush=True)
    print(table(seen))
    print(
        f"{sum(seen.values())} interruptions, {missed} moments not reached, {bad} violations, "
        f"{time.monotonic() - began:.0f} s"
    )
    return 1 if bad or sum(seen.values()) < chosen.points else 0


if __name__ == "__main__":
    sys.exit(main())
