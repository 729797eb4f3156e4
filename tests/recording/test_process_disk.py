"""Rows that go to a process of their own, and what becomes of them when one of the two ends."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import recorded_rows
from recorded_rows import append_rows, cycle

from legbench.errors import RecordingError
from legbench.recording.abstract_disk import MAX_WAITING
from legbench.recording.files import lock
from legbench.recording.process_disk import ProcessDisk, longest_packet
from legbench.recording.reader import load
from legbench.recording.repair import recover
from legbench.recording.rows import BATCH_ROWS
from legbench.recording.stream import schema_for
from legbench.recording.writer import RunWriter

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="sequenced packets are Linux's")
PATIENCE = 30.0
"""Longest that a process may take to end on a busy machine [s]."""


def writing(parent: Path) -> tuple[RunWriter, ProcessDisk]:
    writer = RunWriter.create(parent, {"seed": 3}, realtime=True)
    disk = writer._disk
    assert isinstance(disk, ProcessDisk)
    return writer, disk


def running(pid: int) -> bool:
    """Whether a process is there, and no zombie."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def append_for_long(writer: RunWriter, pause: float | None = None) -> None:
    """Append twice as many rows as may wait, with a pause after each [s] or without."""
    row = cycle(0)
    for _ in range(2 * MAX_WAITING * BATCH_ROWS):
        writer.append(*row)
        if pause is not None:
            time.sleep(pause)


def await_end(pid: int) -> None:
    deadline = time.monotonic() + PATIENCE
    while running(pid):
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_a_run_is_the_same_by_thread_and_by_process(tmp_path: Path) -> None:
    long = "x" * (2 * longest_packet(schema_for({})))
    tables, events = [], []
    for realtime in (False, True):
        with RunWriter.create(tmp_path / str(realtime), {}, realtime=realtime) as writer:
            append_rows(writer, 120)
            writer.event(0.1, "touchdown", text=long)
            append_rows(writer, 333, start=120, truth=False)
            writer.event(0.2, "liftoff")
        assert load(writer.path).complete
        tables.append(pq.read_table(writer.path / "samples.parquet").replace_schema_metadata(None))
        events.append((writer.path / "events.jsonl").read_bytes())
        assert {path.name for path in writer.path.iterdir()} == {
            "run.json",
            "samples.parquet",
            "events.jsonl",
        }
    assert events[0] == events[1]
    assert tables[0].schema == tables[1].schema
    for name in tables[0].column_names:
        ours, theirs = (table[name].to_numpy() for table in tables)
        assert ours.tobytes() == theirs.tobytes(), name


def test_the_process_ends_with_the_run(tmp_path: Path) -> None:
    writer, disk = writing(tmp_path)
    append_rows(writer, 10)
    assert running(disk.pid)
    assert os.getsid(disk.pid) != os.getsid(0)
    writer.close()
    assert not running(disk.pid)
    assert load(writer.path).complete


def test_a_run_that_ends_at_once_waits_for_its_process(tmp_path: Path) -> None:
    writer, _ = writing(tmp_path)
    writer.close()
    assert load(writer.path).complete
    assert len(load(writer.path).time) == 0


def test_what_was_handed_over_outlives_the_master(tmp_path: Path) -> None:
    """The process is frozen while rows come, so all of them are in the kernel's queue."""
    pid = 0
    command = [sys.executable, recorded_rows.__file__, "paced", str(tmp_path), "process"]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as master:
        assert master.stdout is not None
        children = Path(f"/proc/{master.pid}/task/{master.pid}/children")
        for line in master.stdout:
            if int(line) == 60:
                (pid,) = map(int, children.read_text().split())
                os.kill(pid, signal.SIGSTOP)
            if int(line) == 260:
                break
        master.kill()
        told = [int(line) for line in master.stdout.read().split()[:-1]]
    appended = max([260, *told]) + 1
    (run,) = tmp_path.iterdir()
    with pytest.raises(RecordingError, match="is still being written by another process"):
        recover(run)
    os.kill(pid, signal.SIGCONT)
    await_end(pid)
    report = recover(run)
    assert report.status == "recovered"
    assert report.bytes_dropped == 0
    assert appended - BATCH_ROWS < report.rows_kept <= appended
    np.testing.assert_array_equal(load(run)["t"], np.arange(report.rows_kept) / 1000)
    assert [event["name"] for event in load(run).events] == ["touchdown"]


def test_a_recording_process_that_is_killed_ends_the_run_and_keeps_its_rows(
    tmp_path: Path,
) -> None:
    writer, disk = writing(tmp_path)
    append_rows(writer, 200)
    deadline = time.monotonic() + PATIENCE
    while disk.kept.rows < 200:
        disk._listen()
        assert time.monotonic() < deadline
    os.kill(disk.pid, signal.SIGKILL)
    with pytest.raises(RecordingError, match="recording process ended early; 200 rows are safe"):
        append_for_long(writer, pause=1e-4)
    writer.close("fault", "recording")
    found = load(writer.path)
    assert (found.manifest["status"], found.manifest["cause"]) == ("fault", "recording")
    assert len(found.time) == 200


def test_a_process_that_is_stuck_never_holds_up_the_loop_but_ends_the_run(tmp_path: Path) -> None:
    writer, disk = writing(tmp_path)
    os.kill(disk.pid, signal.SIGSTOP)
    try:
        with pytest.raises(RecordingError, match="too slow, 60 s of rows wait"):
            append_for_long(writer)
        assert len(disk._waiting) == MAX_WAITING + 1
    finally:
        os.kill(disk.pid, signal.SIGCONT)
    writer.close("fault", "recording")
    rows = load(writer.path).manifest["rows"]
    assert rows > MAX_WAITING * BATCH_ROWS
    assert len(load(writer.path).time) == rows


def test_modules_in_the_present_folder_are_not_the_recordings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "socket.py").write_text("raise SystemExit(3)\n")
    (tmp_path / "numpy.py").write_text("raise SystemExit(3)\n")
    monkeypatch.chdir(tmp_path)
    with RunWriter.create(tmp_path / "runs", {}, realtime=True) as writer:
        append_rows(writer, 75)
    assert len(load(writer.path).time) == 75


def test_the_lock_is_the_runs_until_it_is_closed(tmp_path: Path) -> None:
    writer, _ = writing(tmp_path)
    append_rows(writer, 60)
    with (
        (writer.path / "samples.arrows").open("rb") as samples,
        pytest.raises(RecordingError, match="is still being written"),
    ):
        lock(samples.fileno(), writer.path)
    writer.close()
