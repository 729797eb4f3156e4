"""Publishing a run while it is being written: one slice a look, until it ends."""

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa

from legbench.errors import RecordingError
from legbench.metrics.summary import summarise
from legbench.recording.description import describe
from legbench.recording.layout import ARCHIVE, STREAM
from legbench.recording.manifest import read_manifest
from legbench.recording.reader import load
from legbench.viz.facts import facts_of
from legbench.viz.live._rerun import rr
from legbench.viz.live.publish import Publisher
from legbench.viz.live.tail import Tail, rows_of

CLOSING_LOOKS = 40
"""Largest number of looks for the writer's archive after the last row."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pace:
    """Timing of the looks at a growing run, and the condition that ends them."""

    wait: Callable[[], None]
    """Waits until it is time for the next look."""
    over: Callable[[], bool]
    """Tells whether the writer has gone, which a truncated stream does not show."""


def follow(folder: Path, stream: rr.RecordingStream, pace: Pace) -> int:
    """Publish a run from its first row to its last, and what only a finished run has.

    Returns:
        The number of rows that were published while the run was being written.

    Raises:
        RecordingError: there is no run in the folder, or it describes no leg.
    """
    manifest = read_manifest(folder)
    if manifest is None:
        raise RecordingError(f"{folder} is no run folder: it has no manifest")
    description = describe(manifest, folder.name)
    publisher = Publisher(stream, facts_of(description), live=True)
    count = 0
    try:
        tail = Tail(folder / STREAM)
    except FileNotFoundError:
        publisher.push(load(folder))
    else:
        with closing(tail):
            for batches in _looks(tail, folder, pace):
                rows = rows_of(batches, description, folder)
                count += len(rows.time)
                publisher.push(rows)
    _conclude(folder, publisher, pace)
    return count


def _looks(tail: Tail, folder: Path, pace: Pace) -> Iterator[list[pa.RecordBatch]]:
    """New batches at each look that finds some, until the run has ended."""
    while not tail.ended:
        last = pace.over() or (folder / ARCHIVE).is_file()
        if batches := tail.read():
            yield batches
        if last:
            return
        pace.wait()


def _conclude(folder: Path, publisher: Publisher, pace: Pace) -> None:
    """Show ratings and final manifest, once the writer has closed the run or given up."""
    for _ in range(CLOSING_LOOKS):
        if pace.over() or (folder / ARCHIVE).is_file():
            break
        pace.wait()
    recording = load(folder)
    publisher.finish()
    publisher.describe(facts_of(recording.description), summarise(recording))
