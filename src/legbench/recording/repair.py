"""Making a torn run whole: every whole batch kept, every torn byte set aside, nothing lost."""

import os
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa

from legbench.errors import RecordingError
from legbench.recording.archive import count_rows, read_schema, write_archive
from legbench.recording.events import drop_torn_events, read_events
from legbench.recording.files import lock
from legbench.recording.layout import ARCHIVE, COMPLETE, RECOVERED, RUNNING, STREAM, TIME, TORN
from legbench.recording.manifest import Manifest, read_manifest, write_manifest
from legbench.recording.reader import run_folder
from legbench.recording.sealed import UNREADABLE
from legbench.recording.stream import WholeBatches, carried_manifest
from legbench.writing import reason

HANDED_OVER = 2.0
"""Longest wait for a recording process that writes what its killed master handed over [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoveryReport:
    """What `recover` found and did; its `str` is one sentence."""

    path: Path
    """The run folder."""
    changed: bool
    """Whether anything was done."""
    status: str
    """Status of the run now."""
    cause: str | None
    """Why it ended."""
    rows_kept: int
    """Rows in `samples.parquet`."""
    bytes_dropped: int
    """Bytes of damaged batches and after the last whole one, kept in `samples.arrows.torn`."""
    events_dropped: int
    """Unreadable event lines, kept in `events.jsonl.torn`."""

    def __str__(self) -> str:
        head = f"{self.path} is {self.status}: {self.rows_kept} rows"
        if not self.changed:
            return f"{head}; nothing to recover"
        return f"{head} kept, {self.bytes_dropped} bytes and {self.events_dropped} events torn"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Finding:
    """What the samples of a run hold, wherever they are."""

    schema: pa.Schema | None
    rows: int
    duration: float | None = None
    bytes_torn: int = 0
    opening_damaged: bool = False
    tear: str | None = None


def recover(path: Path) -> RecoveryReport:
    """Make the torn run at `path` whole: an archive of every whole batch, an honest `run.json`.

    A run that was left "running" becomes "recovered", with what was torn as its cause; one that
    was closed keeps its status and gets the archive that it lacks. Doing it twice, or on a run
    that lacks nothing, changes nothing. If it fails, the run is as readable as it was before.

    Raises:
        RecordingError: there is no run, it is still being written, or the disk refuses.
        FormatError: a newer version wrote it.
    """
    run = run_folder(path)
    with ExitStack() as held:
        try:
            if (run / STREAM).is_file():
                fd = os.open(run / STREAM, os.O_RDWR)
                held.callback(os.close, fd)
                lock(fd, run, patience=HANDED_OVER)
            return _recover(run)
        except RecordingError:
            raise
        except UNREADABLE as error:
            raise RecordingError(f"{run} could not be recovered: {reason(error)}") from error


def _recover(run: Path) -> RecoveryReport:
    streamed = (run / STREAM).is_file()
    found = _scan_stream(run) if streamed else _scan_archive(run)
    manifest = read_manifest(run)
    lost = manifest is None
    manifest = carried_manifest(found.schema, run) if manifest is None else manifest
    _, bad_events = read_events(run)
    changed = streamed or lost or bad_events > 0 or manifest.get("status") == RUNNING
    if changed:
        manifest = _ended(manifest, found)
        if streamed:
            _archive(run, found, manifest)
        drop_torn_events(run)
        write_manifest(run, manifest)
        _put_stream_away(run, found)
    return RecoveryReport(
        path=run,
        changed=changed,
        status=manifest.get("status", COMPLETE),
        cause=manifest.get("cause"),
        rows_kept=found.rows,
        bytes_dropped=found.bytes_torn,
        events_dropped=bad_events,
    )


def _scan_stream(run: Path) -> _Finding:
    stream = WholeBatches(run / STREAM)
    times: list[int] = []
    for batch in stream:
        column = batch.column(TIME)
        times = [*times[:1], column[0].as_py(), column[-1].as_py()]
    return _Finding(
        schema=stream.schema,
        rows=stream.rows,
        duration=(times[-1] - times[0]) / 1e9 if times else 0.0,
        bytes_torn=stream.torn,
        opening_damaged=stream.opening_damaged,
        tear=stream.tear,
    )


def _scan_archive(run: Path) -> _Finding:
    path = run / ARCHIVE
    if not path.is_file():
        raise RecordingError(f"{run} has no samples: no {ARCHIVE}, no {STREAM}")
    return _Finding(schema=read_schema(run), rows=count_rows(path))


def _ended(manifest: Manifest, found: _Finding) -> Manifest:
    """Return the manifest as it is after the recovery."""
    kept = {key: value for key, value in manifest.items() if key != "archive_error"}
    if kept.get("status") == RUNNING:
        why = f"torn: {found.tear}" if found.tear else "killed while closing, no row torn"
        kept |= {"status": RECOVERED, "cause": why, "rows": found.rows}
        if found.duration is not None:
            kept["duration"] = found.duration
    return kept


def _archive(run: Path, found: _Finding, manifest: Manifest) -> None:
    """Write the archive, unless a whole one with every row of the stream is there already."""
    path = run / ARCHIVE
    with suppress(*UNREADABLE):  # A damaged one is written anew.
        if path.is_file() and count_rows(path) >= found.rows:
            return
    write_archive(run, WholeBatches(run / STREAM), manifest)


def _put_stream_away(run: Path, found: _Finding) -> None:
    """Remove a stream that the archive replaces; keep a damaged one under another name."""
    stream = run / STREAM
    if found.bytes_torn or found.opening_damaged:
        stream.replace(run / (STREAM + TORN))
    else:
        stream.unlink(missing_ok=True)
