"""`legbench runs`: recorded runs as a table, filtered and sorted by any figure or setting."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional

from legbench.cli.output import print_json, timed_progress
from legbench.cli.parse import parse
from legbench.runs.columns import USUAL, column_named, names_in, titled
from legbench.runs.index import rows_of
from legbench.runs.select import select


@dataclass(frozen=True, slots=True, kw_only=True)
class RunsArguments:
    """List the runs below a folder with their settings and figures.

    The first call measures every run and keeps that in an index; later ones measure what is new.
    """

    directory: Annotated[Path, Positional] = Path("runs")
    """Folder whose runs are listed, with those of the folders in it."""
    where: str | None = None
    """Condition on figures and settings, such as 'controller=jump and rating_flight>0.97'."""
    sort: str | None = None
    """Figure or setting to sort by; runs that do not have it come last."""
    descending: bool = False
    """Sort the largest first."""
    columns: tuple[str, ...] = ()
    """Figures and settings to show; `--columns all` lists what there is."""
    json: bool = False
    """Print one JSON object on stdout: all columns, unless some are chosen."""


def main(arguments: list[str]) -> int:
    """Run `legbench runs`; its exit status is 0 also where no run fulfils the condition."""
    chosen = parse(RunsArguments, "runs", arguments)
    rows = rows_of(chosen.directory, timed_progress())
    names = names_in(rows)
    if chosen.columns == ("all",) and not chosen.json:
        print("\n".join(names))
        return 0
    found = select(rows, where=chosen.where, sort=chosen.sort, descending=chosen.descending)
    asked = () if chosen.columns == ("all",) or not names else chosen.columns
    columns = [column_named(name, names) for name in asked]
    if chosen.json:
        shown = [{name: row.get(name) for name in columns} if columns else row for row in found]
        print_json({"directory": str(chosen.directory), "known": len(rows), "runs": shown})
        return 0
    if found:
        print_rows(found, columns or _usual(names))
    print(f"{len(found)} of {len(rows)} runs in {chosen.directory}")
    return 0


def _usual(names: list[str]) -> list[str]:
    """Columns that are shown unless others are asked for, as far as some run has them."""
    ends = {name.rpartition(".settings.")[2]: name for name in reversed(names)}
    return [ends[name] for name in USUAL if name in ends]


def print_rows(rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> None:
    """Print a table: numbers to the right, texts to the left, a dash for what is not known."""
    cells = [[titled(name) for name in columns]]
    cells += [[_text(row.get(name)) for name in columns] for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    texts = [any(isinstance(row.get(name), str) for row in rows) for name in columns]
    for line in cells:
        aligned = [
            cell.ljust(width) if text else cell.rjust(width)
            for cell, width, text in zip(line, widths, texts, strict=True)
        ]
        print("  ".join(aligned).rstrip())


def _text(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.5g}" if isinstance(value, float) else str(value)
