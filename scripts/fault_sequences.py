"""Strike runs on the emulated leg with random sequences of faults: they end safe, and say why.

python scripts/fault_sequences.py --sequences 2000 --jobs 2

A sequence is one run of a controller, and one to three faults in it, of all that the emulated bus
can do, in random windows of virtual time: while the bus is opened and drives are configured, while
they are enabled and go to the start posture, in the run, on the way to rest, and in the stop.
Afterwards no drive may have power: as it is in the drive, not as the master believes. A drive that
hears its master has lost it 50 ms after the stop began, one that does not by its own watchdogs and
150 ms after. No drive may get power once the stop has begun. The first cause is named, and is one
that something can have that has struck; or the faults were bridged, and the run has all its rows.
No command goes beyond the limits, the recording is whole and says the same as the run.
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Generator, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing, suppress
from dataclasses import dataclass
from multiprocessing import get_context

from sequence_draw import PHASES, Schedule, Sequence, describe, draw, name_of
from sequence_judge import judge
from sequence_trial import CONTROLLERS, MS, healthy, play

from legbench.interrupts import ignore_interrupts, stop_on_interrupt

ENDS = ("complete", "fault", "refused", "interrupted")


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What has become of one sequence."""

    sequence: Sequence
    status: str
    cause: str | None
    message: str | None
    struck: tuple[tuple[str, str], ...]
    """Name and phase of every fault that has come."""
    violations: tuple[str, ...]
    deaf_ms: float | None
    """How long after the beginning of its stop a drive had power [ms], if it had any by the end."""
    stop_ms: float
    """How long after the beginning of the stop a drive had power [ms]."""
    alone_ms: int
    """For how long one drive had power and the other had none, since the first row [ms]."""


def strike(sequence: Sequence) -> Verdict:
    """Play a sequence and judge it."""
    seen = play(sequence)
    places = [(name_of(each), seen.phase_at(each.start_ns)) for each in sequence.strikes]
    stop_ns = seen.stop_ns()
    stop_ms = max(0.0, (seen.power_ns - stop_ns) / MS) if stop_ns is not None else 0.0
    return Verdict(
        sequence=sequence,
        status=seen.status,
        cause=seen.cause,
        message=seen.message,
        struck=tuple(place for place in places if place[1] in PHASES),
        violations=tuple(judge(sequence, seen)),
        deaf_ms=stop_ms if any(seen.left) else None,
        stop_ms=stop_ms,
        alone_ms=seen.alone_ms,
    )


def table(verdicts: list[Verdict]) -> str:
    """Faults by kind: in which phase they struck, and how their runs have ended."""
    counts, sums = Counter[tuple[str, str]](), Counter[str]()
    for verdict in verdicts:
        for name, phase in verdict.struck:
            counts[name, phase] += 1
            counts[name, verdict.status] += 1
            sums.update((phase, verdict.status))
    columns = (*PHASES, *ENDS)
    lines = [f"{'fault':<28}" + "".join(f"{column:>12}" for column in columns)]
    for name in sorted({name for name, _ in counts}):
        lines.append(f"{name:<28}" + "".join(f"{counts[name, one]:>12}" for one in columns))
    lines.append(f"{'all':<28}" + "".join(f"{sums[one]:>12}" for one in columns))
    ends = Counter(one.status + (f": {one.cause}" if one.cause else "") for one in verdicts)
    lines += ["", *(f"{count:>6}  {end}" for end, count in ends.most_common())]
    return "\n".join(lines)


def sequences(chosen: argparse.Namespace) -> Iterator[Sequence]:
    """Draw the sequences that the flags ask for."""
    schedules: dict[tuple[str, bool], Schedule] = healthy(chosen.controllers)
    numbers = range(chosen.sequences) if chosen.only is None else [chosen.only]
    for number in numbers:
        yield draw(number, chosen.seed, schedules)


def played(chosen: argparse.Namespace) -> Generator[Verdict, None, None]:
    """Play all sequences, in processes of their own where there are to be several."""
    if chosen.jobs == 1:
        yield from map(strike, sequences(chosen))
        return
    spawn = get_context("spawn")
    with ProcessPoolExecutor(chosen.jobs, spawn, initializer=ignore_interrupts) as pool:
        yield from pool.map(strike, sequences(chosen), chunksize=4)


def main() -> int:
    """Play, and tell what was found; 1 if anything was."""
    parser = argparse.ArgumentParser(
        description=__doc__, allow_abbrev=False, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--sequences", type=int, default=2000, help="how many")
    parser.add_argument("--seed", type=int, default=0, help="of the faults")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--only", type=int, help="this one of them alone, and what came of it")
    parser.add_argument(
        "--controllers",
        nargs="+",
        choices=list(CONTROLLERS),
        default=list(CONTROLLERS),
        help="of the runs; all",
    )
    chosen = parser.parse_args()
    began = time.monotonic()
    verdicts: list[Verdict] = []
    bad = 0
    wanted = chosen.sequences if chosen.only is None else 1
    with (
        stop_on_interrupt(raises=True),
        suppress(KeyboardInterrupt),
        closing(played(chosen)) as found_so_far,
    ):
        for verdict in found_so_far:
            verdicts.append(verdict)
            if verdict.violations:
                bad += 1
                found = "; ".join(verdict.violations)
                print(f"{describe(verdict.sequence)} -> {found}", flush=True)
            if chosen.only is not None:
                print(f"{describe(verdict.sequence)} -> {verdict}")
            if len(verdicts) % 50 == 0:
                print(f"{len(verdicts)} of {wanted}, {bad} bad", file=sys.stderr, flush=True)
    print(table(verdicts))
    deaf = [verdict.deaf_ms for verdict in verdicts if verdict.deaf_ms is not None]
    print(
        "longest power after the beginning of a stop: "
        f"{max((verdict.stop_ms for verdict in verdicts), default=0.0):.1f} ms; "
        f"{len(deaf)} runs ended with power in a drive that its own watchdogs took"
    )
    alone = max(verdicts, key=lambda verdict: verdict.alone_ms, default=None)
    if alone is not None:
        print(
            f"longest power in one drive alone after the first row: {alone.alone_ms} ms; "
            f"{describe(alone.sequence)}"
        )
    print(f"{len(verdicts)} sequences, {bad} violations, {time.monotonic() - began:.0f} s")
    return 1 if bad or len(verdicts) < wanted else 0


if __name__ == "__main__":
    sys.exit(main())
