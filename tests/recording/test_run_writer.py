import errno
import json
import os
import signal
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recorded_rows import append_rows, cycle

from legbench import __version__, writing
from legbench.errors import ConfigError, PlantFault, RecordingError
from legbench.recording import writer as writer_module
from legbench.recording.reader import load
from legbench.recording.writer import RunWriter
from legbench.signals import Command

START = datetime(2030, 1, 2, 3, 4, 5, tzinfo=UTC)


def manifest_of(run: Path) -> dict[str, object]:
    return json.loads((run / "run.json").read_text())


def test_the_manifest_is_there_from_the_start(tmp_path: Path) -> None:
    given = {
        "seed": 1,
        "design": {"m": np.float64(0.2)},
        "provenance": {"versions": {"mujoco": "4.0"}},
    }
    writer = RunWriter.create(tmp_path, given, created=START)
    manifest = manifest_of(writer.path)
    assert manifest["format"] == 2
    assert manifest["legbench"] == __version__
    assert manifest["id"] == writer.path.name == "20300102-030405"
    assert manifest["status"] == "running"
    assert manifest["cause"] is None
    assert manifest["design"] == {"m": 0.2}
    assert manifest["units"]["joint_vel_1"] == "rad/s"  # pyrefly: ignore[bad-index]
    # pyrefly: ignore[bad-index]
    assert set(manifest["provenance"]["versions"]) == {*("python", "numpy", "pyarrow", "mujoco")}
    assert not load(writer.path).complete
    writer.close("interrupted", "SIGINT")
    assert (manifest_of(writer.path) | {"status": "interrupted", "cause": "SIGINT"}) == (
        manifest_of(writer.path)
    )


def test_runs_of_the_same_second_get_their_own_folders(tmp_path: Path) -> None:
    writers = [RunWriter.create(tmp_path, {}, name="x", created=START) for _ in range(3)]
    names = [writer.path.name for writer in writers]
    assert names == ["20300102-030405_x", "20300102-030405_x-2", "20300102-030405_x-3"]
    assert [manifest_of(writer.path)["id"] for writer in writers] == names
    for writer in writers:
        writer.close()


def test_a_parent_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "runs").write_text("")
    with pytest.raises(RecordingError, match=r"runs: File exists \[EEXIST\]; .* --out"):
        RunWriter.create(tmp_path / "runs", {})
    with pytest.raises(RecordingError, match=r"Not a directory \[ENOTDIR\]; .* --out"):
        RunWriter.create(tmp_path / "runs" / "deeper", {})


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_an_unwritable_parent_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o555)
    with pytest.raises(RecordingError, match=r"Permission denied \[EACCES\]; .* --out"):
        RunWriter.create(tmp_path, {})
    tmp_path.chmod(0o755)


def test_a_refused_start_leaves_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(draft: Path, path: Path) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(writing, "put_in_place", refuse)
    with pytest.raises(RecordingError, match=r"Read-only file system \[EROFS\]"):
        RunWriter.create(tmp_path, {})
    assert list(tmp_path.iterdir()) == []


def test_keys_of_the_recording_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="manifest's format, rows are filled in"):
        RunWriter.create(tmp_path, {"rows": 1, "format": 2})
    assert list(tmp_path.iterdir()) == []


def test_close_is_idempotent_and_final(tmp_path: Path) -> None:
    writer = RunWriter.create(tmp_path, {})
    append_rows(writer, 10)
    with pytest.raises(ConfigError, match="cannot end as 'done'; choose from complete, "):
        writer.close("done")
    writer.close()
    before = manifest_of(writer.path)
    writer.close("fault", "late")
    assert manifest_of(writer.path) == before
    with pytest.raises(RecordingError, match="is closed"):
        append_rows(writer, 1)
    with pytest.raises(RecordingError, match="is closed"):
        writer.event(0.0, "late")


@pytest.mark.parametrize(
    ("error", "status", "cause"),
    [
        (PlantFault("bus_off", "the bus is off"), "fault", "bus_off"),
        (ZeroDivisionError(), "fault", "ZeroDivisionError"),
        (KeyboardInterrupt(), "interrupted", "KeyboardInterrupt"),
    ],
)
def test_a_run_ends_as_its_with_block_ends(
    tmp_path: Path, error: BaseException, status: str, cause: str
) -> None:
    writer = RunWriter.create(tmp_path, {})
    append_rows(writer, 70)
    with pytest.raises(type(error)), writer:
        raise error
    run = load(writer.path)
    assert (run.manifest["status"], run.manifest["cause"]) == (status, cause)
    assert len(run.time) == 70
    assert not run.complete


def test_a_fault_stays_the_cause_when_it_is_dealt_with_and_interrupted(tmp_path: Path) -> None:
    writer = RunWriter.create(tmp_path, {})
    append_rows(writer, 70)

    def fail() -> None:
        try:
            raise PlantFault("bus_off", "the bus is off")
        finally:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), writer:
        fail()
    run = load(writer.path)
    assert (run.manifest["status"], run.manifest["cause"]) == ("fault", "bus_off")
    assert len(run.time) == 70


def test_a_signal_while_a_run_is_closed_waits_until_it_is_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = RunWriter.create(tmp_path, {})
    append_rows(writer, 120)
    real = writer_module.write_archive

    def interrupting(*arguments: Any) -> int:
        signal.raise_signal(signal.SIGINT)
        return real(*arguments)

    monkeypatch.setattr(writer_module, "write_archive", interrupting)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    with pytest.raises(KeyboardInterrupt):
        writer.close()
    signal.signal(signal.SIGINT, before)
    run = load(writer.path)
    assert run.complete
    assert len(run.time) == 120
    assert not (writer.path / "samples.arrows").exists()


def test_a_batch_of_legs_is_refused(tmp_path: Path) -> None:
    _, seen, cost, late = cycle(0)
    with RunWriter.create(tmp_path, {}) as writer:
        command = Command(motor_pos=np.zeros((3, 2)), phase=np.zeros(3, dtype=np.int64))
        with pytest.raises(ConfigError, match=r"one leg, shapes \(2,\), not \[\(2,\), \(3, 2\)\]"):
            writer.append(command, seen, cost, late)
        append_rows(writer, 1)
    assert len(load(writer.path).time) == 1


def test_a_failed_archive_leaves_the_stream(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = RunWriter.create(tmp_path, {})
    append_rows(writer, 120)
    with monkeypatch.context() as patch:
        patch.setattr("legbench.recording.archive.count_rows", lambda path: 119)
        writer.close()
    assert not (writer.path / "samples.parquet").exists()
    run = load(writer.path)
    assert run.complete
    assert len(run.time) == 120
    assert "gave back 119 of 120 rows" in run.manifest["archive_error"]
