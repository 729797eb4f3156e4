"""The index: what was measured of the runs below a folder, kept as long as they do not change."""

import hashlib
import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final

from legbench import __version__
from legbench.guests import load_text
from legbench.interrupts import shielded
from legbench.reading import UnreadableError, parse_json, read_file
from legbench.runs.find import find_runs
from legbench.writing import write_whole

INDEX: Final = ".legbench-runs.json"
"""Name of the index in the folder of the runs."""
FORMAT: Final = 2
LARGEST: Final = 1 << 30
"""Largest index that is read [bytes]; a run takes some 5 kB."""
MANY: Final = 100
"""Number of runs above which processes of their own share the work."""

Known = dict[str, dict[str, Any]]
"""Run by its path in the folder -> its `stamp` and its `row`."""
Progress = Callable[[int, int], None]


def rows_of(directory: Path, progress: Progress | None = None) -> list[dict[str, Any]]:
    """What is known of every run below a folder; runs that are new or have changed are measured.

    The index lies in the folder itself or, where that may not be written, among the user's cached
    files; where neither may, every call measures anew.

    Args:
        directory: the folder.
        progress: called with the number of runs that have been measured, and of all to measure.

    Returns:
        One row a run, in the order of their paths, with `run`, the path within the folder.

    Raises:
        RecordingError: there is no such folder, or it cannot be read.
    """
    stamps = find_runs(directory)
    places = _places(directory)
    known = _read(places)
    stale = [run for run, stamp in stamps.items() if known.get(run, {}).get("stamp") != stamp]
    measured = dict(_measured(directory, stale, progress))
    current: dict[str, dict[str, Any]] = {
        run: {"stamp": stamp, "row": measured[run]} if run in measured else known[run]
        for run, stamp in stamps.items()
    }
    if stale or known.keys() - current.keys():
        _write(places, current)
    return [{"run": run, **each["row"]} for run, each in current.items()]


def _measured(
    directory: Path, runs: list[str], progress: Progress | None
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Measure runs, many of them in as many processes as there are processors."""
    paths = [directory / run for run in runs]
    for done, pair in enumerate(zip(runs, _rows(paths), strict=True), start=1):
        yield pair
        if progress is not None:
            progress(done, len(runs))


def _rows(paths: list[Path]) -> Iterator[dict[str, Any]]:
    if not paths:
        return
    measure: Callable[[Path], dict[str, Any]] = load_text("legbench.runs.entry:measure")
    workers = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count()
    if len(paths) < MANY or workers == 1:
        yield from map(measure, paths)
        return
    with shielded():  # A ^C in the middle would leave semaphores behind, with a warning of them.
        made = ProcessPoolExecutor(workers, mp_context=get_context("spawn"))
    with made as pool:
        yield from pool.map(measure, paths, chunksize=16)


def _places(directory: Path) -> tuple[Path, Path]:
    """Files that may hold the index of a folder, the better one first."""
    cache = os.environ.get("XDG_CACHE_HOME", "") or "~/.cache"
    name = hashlib.sha256(str(directory.resolve()).encode("utf-8", "surrogateescape")).hexdigest()
    return directory / INDEX, Path(cache).expanduser() / "legbench" / f"runs-{name[:16]}.json"


def _read(places: Iterable[Path]) -> Known:
    """What an index knows; nothing where there is none, it is damaged, or another version's."""
    for place in places:
        with suppress(OSError, UnreadableError):
            content = parse_json(read_file(place, LARGEST))
            if isinstance(content, dict) and content.get("version") == [FORMAT, __version__]:
                return _sound(content.get("runs"))
    return {}


def _sound(runs: Any) -> Known:
    """Entries that can be what this module wrote; the others are measured again."""
    if not isinstance(runs, dict):
        return {}
    return {
        str(run): each
        for run, each in runs.items()
        if isinstance(each, dict)
        and isinstance(each.get("row"), dict)
        and isinstance(each.get("stamp"), list)
    }


def _write(places: Iterable[Path], known: Known) -> None:
    content = {"version": [FORMAT, __version__], "runs": known}
    text = json.dumps(content, allow_nan=False).encode()
    for place in places:
        with suppress(OSError):
            place.parent.mkdir(parents=True, exist_ok=True)
            write_whole(place, text)
            return
