"""`legbench compare`: recorded runs side by side, laid over each other at an event."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional

from legbench.cli.output import note, print_json
from legbench.cli.parse import parse, wrong_usage
from legbench.metrics import Analysis, Summary
from legbench.metrics.events import CommonEvent
from legbench.metrics.rating_text import shown
from legbench.metrics.side_by_side import SPAN, SideBySide, side_by_side
from legbench.recording.reader import load

NAMED = 4
"""Largest number of entries in which experiments differ that are named."""
Cell = Callable[[Analysis, Summary], str]


@dataclass(frozen=True, slots=True, kw_only=True)
class CompareArguments:
    """Put the ratings and figures of runs side by side, and lay them over each other at an event.

    A touchdown, or a switch of the bang-bang controller, comes earlier in one run than in another:
    by the clock they would seem to differ in everything after it.
    """

    runs: Annotated[tuple[Path, ...], Positional]
    """Run folders, two or more; distances are from the first."""
    align: CommonEvent | None = None
    """Event at which the runs are laid over each other; by default the first of touchdown, switch
    and action that all runs have."""
    number: int = 1
    """Which of these events, from 1; -1 is the last."""
    span: float = SPAN
    """Time after the event over which the distances are measured [s]."""
    figure: Path | None = None
    """Draw the runs over each other: .png, .svg or .pdf."""
    json: bool = False
    """Print one JSON object on stdout."""


def main(arguments: list[str]) -> int:
    """Run `legbench compare`."""
    chosen = parse(CompareArguments, "compare", arguments)
    if len(chosen.runs) < 2:
        return wrong_usage("compare", "one run has nothing to be compared with; name two or more")
    if not 0.0 < chosen.span < math.inf:
        told = f"--span is {chosen.span:g} s; it must be more than 0 s, and finite"
        return wrong_usage("compare", told)
    if chosen.figure is not None:
        from legbench.viz.print.save import check_suffix

        check_suffix(chosen.figure)
    runs = [_analysed(path) for path in chosen.runs]
    found = side_by_side(runs, event=chosen.align, number=chosen.number, span=chosen.span)
    for line in unlike_lines(runs, found):
        note(f"legbench: {line}")
    if chosen.figure is not None:
        from legbench.viz.print.aligned import aligned_figure
        from legbench.viz.print.save import save_figure

        figure = aligned_figure(runs, found, chosen.span)
        note(f"wrote {save_figure(figure, chosen.figure)}")
    if chosen.json:
        print_json(found.to_json())
    else:
        print_table(runs, found)
    return 0


def _analysed(path: Path) -> Analysis:
    recording = load(path)
    if recording.torn is not None:
        note(f"legbench: {path} is torn ({recording.torn}); read as far as it goes")
    return Analysis(recording)


def unlike_lines(runs: Sequence[Analysis], found: SideBySide) -> list[str]:
    """Sentences on runs that are of another leg, or of another experiment, than the first."""
    lines = []
    for run, apart in zip(runs[1:], found.apart, strict=True):
        ours, theirs = runs[0].description.design.name, run.description.design.name
        if apart.other_leg:
            both = f"{theirs} and not {ours}" if theirs != ours else f"another {ours}"
            listed = _listed(apart.other_leg)
            lines.append(f"{run.path} is a different leg, {both}: it differs in {listed}")
        if apart.otherwise_unlike:
            listed = _listed(apart.otherwise_unlike)
            lines.append(f"{run.path} is another experiment: it differs in {listed}")
    return lines


def _listed(entries: Sequence[str]) -> str:
    more = f" and {len(entries) - NAMED} more entries" if len(entries) > NAMED else ""
    return ", ".join(entries[:NAMED]) + more


def print_table(runs: Sequence[Analysis], found: SideBySide) -> None:
    """Print one column a run, then the distances; rows that no run shows are left out."""
    columns = [dict(_cells(*pair)) for pair in zip(runs, found.summaries, strict=True)]
    table = [(label, [column[label] for column in columns]) for label in columns[0]]
    event = f"{found.event.value} [s]" if found.event is not CommonEvent.CLOCK else "from [s]"
    table.append((event, [f"{time:.5g}" for time in found.times]))
    for label, values in (
        ("|dq|, max [rad]", [each.joint_max for each in found.apart]),
        ("|dz2|, max [rad]", [each.z2_max for each in found.apart]),
        ("|dx1|, max [rad]", [each.x1_max for each in found.apart]),
        ("compared over [s]", [each.duration for each in found.apart]),
    ):
        table.append((label, ["", *(_number(value) for value in values)]))
    kept = [(label, cells) for label, cells in table if any(cell.strip("-") for cell in cells)]
    widths = [max(len(cells[place]) for _, cells in kept) for place in range(len(runs))]
    left = max(len(label) for label, _ in kept)
    for label, cells in kept:
        line = "  ".join(cell.rjust(width) for cell, width in zip(cells, widths, strict=True))
        print(f"{label:<{left}}  {line}".rstrip())


def _cells(run: Analysis, summary: Summary) -> list[tuple[str, str]]:
    """Labels and texts of a run's column."""
    described = run.description
    about = "motor", "equilibrium"
    ratings = [
        (f"P^r {kind}, {reference}", _mean(getattr(summary, f"rating_{kind}_{reference}")))
        for kind in ("stance", "flight", "periods")
        for reference in about
    ]
    return [
        ("run", run.path.resolve().name),
        ("leg", described.design.name),
        ("plant", " / ".join(filter(None, (described.plant, described.linkage)))),
        ("setup", described.setup.kind.value),
        ("controller", described.controller),
        ("z2 [rad]", _number(described.z2)),
        ("dz2 [rad]", _number(described.dz2)),
        ("ended", summary.status or "unknown"),
        ("duration [s]", _number(summary.duration)),
        ("judged about the", summary.rating_reference),
        *ratings,
        ("jumps", str(summary.jumps) if summary.jumps else "-"),
        ("trunk excursion [mm]", _number(1e3 * summary.trunk_excursion)),
        ("foot clearance [mm]", _number(1e3 * summary.foot_clearance)),
        ("foot travel [mm]", _number(1e3 * summary.foot_travel)),
        ("drift, 3 jumps [mm]", _number(1e3 * summary.drift)),
        ("hopping [Hz]", _number(summary.hop_freq)),
        ("flight [ms]", _number(1e3 * summary.flight_time)),
        ("stance [ms]", _number(1e3 * summary.stance_time)),
        ("polar angle, max [rad]", _number(summary.polar_max)),
        ("energy residual [-]", _number(summary.energy_residual)),
    ]


def _mean(ratings: list[float]) -> str:
    """Mean of the ratings that are known, to the digits that tell it from one."""
    known = [value for value in ratings if math.isfinite(value)]
    return f"{shown(sum(known) / len(known))} of {len(known)}" if known else "-"


def _number(value: float | None) -> str:
    return "-" if value is None or math.isnan(value) else f"{value:.4g}"
