import json
from pathlib import Path

import pytest
from recorded_rows import append_rows

from legbench.errors import RecordingError
from legbench.recording.reader import load
from legbench.recording.repair import recover
from legbench.recording.writer import RunWriter


def contents(run: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in run.iterdir()}


def test_a_complete_run_is_left_alone(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        append_rows(writer, 60)
    before = contents(writer.path)
    report = recover(writer.path / "run.json")
    assert not report.changed
    assert (report.status, report.rows_kept) == ("complete", 60)
    assert str(report) == f"{writer.path} is complete: 60 rows; nothing to recover"
    assert contents(writer.path) == before


def test_a_run_that_is_being_written_is_refused(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        append_rows(writer, 60)
        with pytest.raises(RecordingError, match="is still being written by another process"):
            recover(writer.path)
    assert load(writer.path).complete


def test_a_closed_run_without_its_archive_keeps_its_status(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = RunWriter.create(tmp_path, {})
    append_rows(writer, 60)
    with monkeypatch.context() as patch:
        patch.setattr("legbench.recording.archive.count_rows", lambda path: 0)
        writer.close("interrupted", "SIGINT")
    report = recover(writer.path)
    assert report.changed
    assert (report.status, report.cause, report.rows_kept) == ("interrupted", "SIGINT", 60)
    assert set(contents(writer.path)) == {"run.json", "samples.parquet", "events.jsonl"}
    assert "archive_error" not in load(writer.path).manifest


def test_a_failed_recovery_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = RunWriter.create(tmp_path, {})
    append_rows(writer, 60)
    with monkeypatch.context() as patch:
        patch.setattr("legbench.recording.archive.count_rows", lambda path: 0)
        writer.close()
        before = contents(writer.path)
        with pytest.raises(RecordingError, match="gave back 0 of 60 rows"):
            recover(writer.path)
    assert contents(writer.path) == before


def test_a_manifest_left_running_beside_an_archive(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        append_rows(writer, 60)
    path = writer.path / "run.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"status": "running"}))
    report = recover(writer.path)
    assert (report.status, report.rows_kept) == ("recovered", 60)
    assert not recover(writer.path).changed


def test_a_run_without_samples_cannot_be_recovered(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        pass
    (writer.path / "samples.parquet").unlink()
    with pytest.raises(RecordingError, match=r"no samples: no .*parquet, no .*arrows"):
        recover(writer.path)
