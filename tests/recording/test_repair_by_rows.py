"""What a repair says of a run, against the rows that went into it."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from recorded_rows import append_rows

from legbench.recording.archive import count_rows
from legbench.recording.reader import load
from legbench.recording.repair import recover
from legbench.recording.writer import RunWriter

BATCH = 50
"""Rows that reach the disk together."""
FIRST = 7_300
"""Row with which the recordings here begin, after 7.3 s."""


def unclosed(folder: Path, rows: int, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A run as it was at the moment before its archive: a whole stream, status running."""
    writer = RunWriter.create(folder, {"seed": 5})
    append_rows(writer, rows, start=FIRST)
    with monkeypatch.context() as patch:
        patch.setattr("legbench.recording.archive.count_rows", lambda path: 0)
        writer.close()
    manifest = json.loads((writer.path / "run.json").read_text())
    left = {key: value for key, value in manifest.items() if key not in ("rows", "duration")}
    (writer.path / "run.json").write_text(json.dumps(left | {"status": "running"}))
    return writer.path


def tear(run: Path, dropped: int) -> None:
    """Cut bytes off the stream."""
    stream = run / "samples.arrows"
    os.truncate(stream, stream.stat().st_size - dropped)


@pytest.mark.parametrize("batches", [1, 2, 3, 5])
@pytest.mark.parametrize("torn", [False, True])
def test_a_recovered_run_lasted_from_its_first_to_its_last_whole_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, batches: int, torn: bool
) -> None:
    run = unclosed(tmp_path, BATCH * batches, monkeypatch)
    # Nine bytes are the end mark and one byte of the last batch.
    tear(run, 9 if torn else 0)
    kept = BATCH * (batches - torn)
    report = recover(run)
    manifest = load(run).manifest
    assert (report.status, report.rows_kept) == ("recovered", kept)
    assert manifest["rows"] == kept
    assert manifest["duration"] == pytest.approx(max(0, kept - 1) * 1e-3, abs=1e-12)
    times = load(run)["t"]
    np.testing.assert_array_equal(times, (FIRST + np.arange(kept)) / 1000)
    cause = "killed while closing, no row torn"
    if torn:
        assert report.bytes_dropped > 0
        cause = f"torn: samples.arrows has no end mark after {kept} rows, but "
        cause += f"{report.bytes_dropped} bytes of an unfinished batch"
    assert report.cause == manifest["cause"] == cause
    assert str(report) == (
        f"{run} is recovered: {kept} rows kept, {report.bytes_dropped} bytes and 0 events torn"
    )


@pytest.mark.parametrize(
    ("archived", "kept"),
    [(150, True), (200, True), (100, False), (149, False)],
)
def test_an_archive_that_holds_every_row_of_the_stream_is_not_written_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, archived: int, kept: bool
) -> None:
    run = unclosed(tmp_path / "torn", 150, monkeypatch)
    with RunWriter.create(tmp_path / "other", {"seed": 6}) as writer:
        append_rows(writer, archived, start=FIRST)
    (writer.path / "samples.parquet").rename(run / "samples.parquet")
    before = (run / "samples.parquet").stat()
    recover(run)
    after = (run / "samples.parquet").stat()
    assert (before.st_ino, before.st_mtime_ns) == (after.st_ino, after.st_mtime_ns) or not kept
    assert count_rows(run / "samples.parquet") == (archived if kept else 150)
    assert not (run / "samples.arrows").exists()


def test_a_run_that_was_closed_keeps_its_duration(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = unclosed(tmp_path, 100, monkeypatch)
    manifest = json.loads((run / "run.json").read_text())
    closed = {"status": "interrupted", "cause": "SIGINT", "duration": 12.5, "rows": 3}
    (run / "run.json").write_text(json.dumps(manifest | closed))
    recover(run)
    found = load(run).manifest
    assert {key: found[key] for key in closed} == closed


def test_a_run_left_running_with_its_archive_alone_says_its_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        append_rows(writer, 120, start=FIRST)
    path = writer.path / "run.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"status": "running", "rows": 0}))
    report = recover(writer.path)
    assert (report.bytes_dropped, report.events_dropped) == (0, 0)
    assert load(writer.path).manifest["rows"] == 120


def test_unreadable_events_alone_are_a_reason_to_repair(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        append_rows(writer, 60)
        writer.event(0.01, "touchdown")
    with (writer.path / "events.jsonl").open("a") as file:
        file.write('{"time": 0.0')
    report = recover(writer.path)
    assert (report.changed, report.status, report.events_dropped) == (True, "complete", 1)
    assert not recover(writer.path).changed
