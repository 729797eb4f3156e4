"""A run folder that is written at once: the older one stays until the new one is whole."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyarrow import parquet
from recorded_rows import append_rows

from legbench.errors import RecordingError
from legbench.recording import saved
from legbench.recording.reader import Recording, load
from legbench.recording.saved import save_recording
from legbench.recording.writer import RunWriter


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    with RunWriter.create(tmp_path / "first", {}) as writer:
        append_rows(writer, 70)
        writer.event(0.01, "touchdown", foot=1)
        writer.event(0.02, "liftoff")
    return load(writer.path)


def test_a_run_is_saved_under_its_new_name_with_its_events(
    recording: Recording, tmp_path: Path
) -> None:
    path = tmp_path / "cells" / "0042"
    save_recording(recording, path)
    assert [entry.name for entry in path.parent.iterdir()] == ["0042"]
    assert {entry.name for entry in path.iterdir()} == {
        "run.json",
        "samples.parquet",
        "events.jsonl",
    }
    found = load(path)
    assert found.manifest == {**recording.manifest, "id": "0042"}
    assert found.events == recording.events
    for name, values in recording.columns.items():
        np.testing.assert_array_equal(found.columns[name], values)
    with parquet.ParquetFile(path / "samples.parquet") as file:
        assert {file.metadata.row_group(0).column(n).compression for n in range(3)} == {"ZSTD"}


def test_an_older_run_is_replaced_with_all_that_it_held(
    recording: Recording, tmp_path: Path
) -> None:
    path = tmp_path / "cell"
    path.mkdir()
    (path / "older.txt").write_text("older")
    left = tmp_path / ".cell.draft"
    left.mkdir()
    (left / "events.jsonl").write_text("left by a process that was killed")
    save_recording(recording, path)
    assert not left.exists()
    assert not (path / "older.txt").exists()
    assert load(path).events == recording.events


def test_what_cannot_be_written_leaves_the_older_run_and_no_draft(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "cell"
    save_recording(replace(recording, events=()), path)

    def refuse(draft: Path, path: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(saved, "put_in_place", refuse)
    with pytest.raises(RecordingError, match="cell was not written: No space left on device"):
        save_recording(recording, path)
    assert not (tmp_path / ".cell.draft").exists()
    assert load(path).events == ()


def test_the_torques_of_a_long_run_are_written_as_all_else(
    recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(saved, "derivable", lambda columns, described: ("spring_torque_1",))
    for rows, left_out in ((70, ("spring_torque_1",)), (69, ())):
        monkeypatch.setattr(saved, "LONG_ROWS", rows)
        assert saved._left_out(recording) == left_out
