"""Run every command that the documents show, and say which of them print something else.

Commands behind a `$` are run in the order of their document; what they print is compared with what
is shown. The tests do the same, with runs on the emulated leg that end at their last row. With
--others, commands whose output is not shown are run, too, as far as they end by themselves and need
neither a display nor a bus: each is to end with status 0.
"""

import argparse
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from docs_blocks import ROOT, CommandLine, items, pages
from docs_compare import printed_as_shown
from docs_parse import lay_out
from docs_run import Tried, call, on_emulated_leg, play, prepare

from legbench.cli.output import note

ENDLESS = ("emulate", "monitor", "--view", "--serve", "slcan", "legbench_unix", "slurm", "dask")
"""Words of commands that do not end by themselves, or need a display, a device or a cluster."""
LONG = ("explain", "models/campaigns/paper.toml", "runs/paper")
"""Words of commands that take minutes, or need what such a command leaves."""
STATUSES = {"check": (0, 1), "campaign": (0, 1), "identify": (0, 1)}
"""Statuses that are an answer, of commands that judge; of all others it is 0."""


def main() -> int:
    """Try the documents; 1 if one of them shows what is not printed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pages", nargs="*", type=Path, help="documents to try, by default all")
    parser.add_argument("--print", action="store_true", help="print what every command prints")
    parser.add_argument("--update", action="store_true", help="show what is printed instead")
    parser.add_argument("--others", action="store_true", help="run the others, too")
    asked = parser.parse_args()
    tried = wrong = 0
    for page in [path.resolve() for path in asked.pages] or pages():
        with tempfile.TemporaryDirectory() as folder:
            prepare(Path(folder))
            played = list(play(page, Path(folder)))
            count, failed = _run_others(page, Path(folder)) if asked.others else (0, 0)
        tried, wrong = tried + count, wrong + failed
        for each in played:
            _tell(each, whole=asked.print)
        tried, wrong = tried + len(played), wrong + sum(bool(each.problems) for each in played)
        if asked.update:
            _update(page, played)
        note(f"{page.relative_to(ROOT)}: done")
    print(f"{tried} commands run, {wrong} of them print something else or fail")
    return int(wrong > 0)


def _tell(tried: Tried, *, whole: bool) -> None:
    """Print a command whose output is not what is shown, or any with all of its output."""
    if tried.problems or whole:
        print(f"{tried.command.place}: {' '.join(tried.command.words)}")
        shown = tried.printed if whole else ()
        print("\n".join(f"    {line}" for line in (*tried.problems, *shown)))


def _update(page: Path, played: Sequence[Tried]) -> None:
    """Replace what a document shows of the commands that print something else."""
    lines = page.read_text(encoding="utf-8").splitlines()
    for each in reversed(played):
        if each.problems:
            start = int(each.command.place.rpartition(":")[2])
            lines[start : start + len(each.command.shown)] = printed_as_shown(each.printed)
    page.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _lay_out_bench(folder: Path) -> None:
    """Put in place what a maker hands out, and what a run on drives leaves."""
    shutil.copy(folder / "hardware" / "legbench-drive.eds", folder / "drive.eds")
    ran = "legbench run jump --plant can --duration 1.2 --end stop --out bench"
    call(on_emulated_leg(ran.split()), folder)
    for runs in ("runs", "CAMPAIGN/records"):
        shutil.copytree(folder / "RUN", folder / runs / "RUN")
    (log,) = folder.glob("bench/*/bus.log")
    shutil.copy(log, folder / "can0.log")


def _run_others(page: Path, folder: Path) -> tuple[int, int]:
    """Run the commands of a document whose output is not shown: how many, how many failed."""
    count = failed = 0
    lay_out(folder)
    _lay_out_bench(folder)
    for item in items(page):
        if not isinstance(item, CommandLine) or item.prompted or item.words[0] != "legbench":
            continue
        if any(word in (*ENDLESS, *LONG) or "dask" in word for word in item.words):
            note(f"{item.place}: not run: {' '.join(item.words)}")
            continue
        count += 1
        status, printed = call(on_emulated_leg(item.words), folder)
        if status not in STATUSES.get(item.words[1], (0,)):
            failed += 1
            last = printed[-1] if printed else ""
            print(f"{item.place}: {' '.join(item.words)}: status {status}: {last}")
    return count, failed


if __name__ == "__main__":
    sys.exit(main())
