import fcntl
import os
import subprocess
import sys
from pathlib import Path

import pytest
import recorded_rows
from recorded_rows import append_rows

from legbench.errors import RecordingError
from legbench.recording.disk import Disk
from legbench.recording.files import Appender, append_to
from legbench.recording.manifest import new_manifest, read_manifest
from legbench.recording.reader import load
from legbench.recording.repair import recover
from legbench.recording.rows import BATCH_ROWS
from legbench.recording.stream import schema_for
from legbench.recording.writer import RunWriter


def writer_onto(run: Path, samples: Appender, events: Appender) -> RunWriter:
    manifest = new_manifest({}, id="x", created="now")
    return RunWriter(run, manifest, Disk(samples, events, schema_for(manifest)))


def check_starved(run: Path, appended: int, message: str) -> None:
    """What every run whose disk filled up must have kept."""
    found = load(run)
    rows = len(found.time)
    assert rows % BATCH_ROWS == 0
    assert 0 < rows < appended
    assert f"{rows} rows are safe on disk; make room, then `legbench recover" in message
    assert "--out" in message
    assert found["t"].tolist() == [row / 1000 for row in range(rows)]
    assert not found.complete


@pytest.mark.parametrize("kind", ["loop", "process"])
def test_a_file_that_may_not_grow(tmp_path: Path, kind: str) -> None:
    command = [sys.executable, recorded_rows.__file__, "starved", str(tmp_path), kind]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
    appended, message = done.stdout.splitlines()
    (run,) = tmp_path.iterdir()
    assert "File too large [EFBIG]" in message
    check_starved(run, int(appended), message)
    manifest = load(run).manifest
    assert (manifest["status"], manifest["cause"]) == ("fault", "recording")
    assert manifest["recording_error"] == "File too large [EFBIG]"
    assert manifest["rows_lost"] == int(appended) - manifest["rows"]


def test_a_full_disk(small_disk: Path, capfd: pytest.CaptureFixture[str]) -> None:
    writer = RunWriter.create(small_disk, {})
    recorded_rows.until_full(writer)
    appended, message = capfd.readouterr().out.splitlines()
    assert "No space left on device [ENOSPC]" in message
    check_starved(writer.path, int(appended), message)
    assert '"format": 2' in (writer.path / "run.json").read_text()
    rows = len(load(writer.path).time)
    subprocess.run(["mount", "-o", "remount,size=4m", str(small_disk)], check=True)
    assert recover(writer.path).rows_kept == rows
    assert len(load(writer.path).time) == rows
    assert not (writer.path / "samples.arrows").exists()


def seal(descriptor: int) -> None:
    """Let a file in memory take nothing any more: every write is refused with EPERM."""
    add_seals, write_and_grow = 1033, 0x8 | 0x4  # fcntl(2); the module lacks the names in 3.11
    fcntl.fcntl(descriptor, add_seals, write_and_grow)


@pytest.mark.parametrize("told_by_append", [True, False])
def test_an_error_is_told_once_by_append_or_else_by_close(
    tmp_path: Path, told_by_append: bool
) -> None:
    samples = os.memfd_create("samples", os.MFD_ALLOW_SEALING)
    writer = writer_onto(tmp_path, Appender(samples), append_to(tmp_path / "events.jsonl"))
    append_rows(writer, 49)
    seal(samples)
    append_rows(writer, 1)
    if told_by_append:
        with pytest.raises(RecordingError, match=r"not permitted \[EPERM\]; 0 rows are safe"):
            append_rows(writer, 1)
        with pytest.raises(RecordingError, match="EPERM"):
            append_rows(writer, 1)
        writer.close("fault", "recording")
    else:
        with pytest.raises(RecordingError, match=r"EPERM\]; 0 rows are safe"):
            writer.close()
    manifest = read_manifest(tmp_path)
    assert manifest is not None
    assert (manifest["status"], manifest["cause"]) == ("fault", "recording")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_events_that_cannot_be_written_end_no_run_and_are_told_at_its_end(tmp_path: Path) -> None:
    full = Appender(os.open("/dev/full", os.O_WRONLY))
    writer = writer_onto(tmp_path, append_to(tmp_path / "samples.arrows"), full)
    append_rows(writer, 60)
    writer.event(0.06, "touchdown")
    append_rows(writer, 200, start=60)
    with pytest.raises(
        RecordingError, match=r"events were lost: No space left .* \[ENOSPC\]; its 260 rows"
    ):
        writer.close()
    found = load(tmp_path)
    assert found.manifest["status"] == "complete"
    assert found.manifest["events_error"] == "No space left on device [ENOSPC]"
    assert len(found.time) == 260


def test_a_batch_is_with_the_system_before_the_next_row(tmp_path: Path) -> None:
    writer = RunWriter.create(tmp_path, {})
    for row in range(4 * BATCH_ROWS):
        append_rows(writer, 1, start=row)
        kept = len(load(writer.path).time) if row % 7 == 0 or row % BATCH_ROWS > 47 else None
        assert kept in (None, (row + 1) // BATCH_ROWS * BATCH_ROWS)
    writer.close()


def test_a_short_write_is_cut_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = append_to(tmp_path / "x")
    file.append(b"whole")
    write = os.write

    def half(fd: int, data: memoryview) -> int:
        if len(data) < 4:
            raise OSError(28, "full")
        return write(fd, data[: len(data) // 2])

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", half)
        with pytest.raises(OSError, match="full"):
            file.append(memoryview(b"12345678"))
    assert (tmp_path / "x").read_bytes() == b"whole"
    file.append(b" again")
    assert (tmp_path / "x").read_bytes() == b"whole again"
    assert file.size == 11
    file.close()
