import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import recorded_rows
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recorded_rows import append_rows

from legbench.errors import RecordingError
from legbench.recording.columns import ONE_LEG
from legbench.recording.files import lock
from legbench.recording.reader import load
from legbench.recording.repair import recover
from legbench.recording.stream import (
    END_MARK,
    BatchEncoder,
    WholeBatches,
    encode_schema,
    schema_for,
)
from legbench.recording.writer import RunWriter

SLOW = settings(
    max_examples=30,
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of 150 rows as it is the moment before it is closed: no end mark, no archive."""
    writer = RunWriter.create(tmp_path_factory.mktemp("live"), {"seed": 5})
    append_rows(writer, 150)
    writer.event(0.1, "touchdown")
    writer.event(0.2, "liftoff")
    writer._disk.finish()
    copy = tmp_path_factory.mktemp("whole") / "run"
    shutil.copytree(writer.path, copy)
    writer._disk.close()
    return copy


def boundaries(run: Path) -> list[int]:
    """Offsets after the schema and after each batch, each batch's size being the same."""
    size = (run / "samples.arrows").stat().st_size - len(END_MARK)
    rows = np.zeros((1 + len(ONE_LEG.names), 50))
    batch = len(BatchEncoder(rows, schema_for({})).encode(rows))
    return [size - batch * left for left in (3, 2, 1, 0)]


def cut(whole: Path, target: Path, size: int) -> Path:
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(whole, target)
    os.truncate(target / "samples.arrows", size)
    return target


def test_a_stream_cut_at_every_byte_keeps_its_whole_batches(tmp_path: Path) -> None:
    schema = schema_for({})
    parts = [encode_schema(schema)]
    rows = [np.full((1 + len(ONE_LEG.names), 1), value) for value in (1.0, 2.0)]
    parts += [BatchEncoder(row, schema).encode(row) for row in rows]
    ends = np.cumsum([len(part) for part in parts])
    path = tmp_path / "samples.arrows"
    path.write_bytes(b"".join(parts) + END_MARK)
    size = path.stat().st_size
    for length in range(size, -1, -1):
        os.truncate(path, length)
        stream = WholeBatches(path)
        rows = [batch["trunk_pos_x"][0].as_py() for batch in stream]
        assert rows == [1.0, 2.0][: int(np.sum(ends[1:] <= length))], length
        assert (stream.tear is None) == (length == size), length
        assert stream.end == max([0, *ends[ends <= length]]), length


def test_load_of_a_cut_run_keeps_every_whole_batch(whole: Path, tmp_path: Path) -> None:
    ends = boundaries(whole)
    size = (whole / "samples.arrows").stat().st_size
    lengths = {end + shift for end in ends for shift in (-9, -8, -1, 0, 1, 4, 7)}
    for length in sorted(lengths | set(range(0, size, 911))):
        run = load(cut(whole, tmp_path / "run", length))
        rows = 50 * sum(end <= length for end in ends[1:])
        assert run["t"].tolist() == [row / 1000 for row in range(rows)], length
        assert run["joint_pos"].shape == (rows, 2)
        assert run.torn is not None
        assert run.manifest["seed"] == 5
        assert len(run.events) == 2


@SLOW
@given(data=st.data())
def test_recover_of_a_cut_run_loses_nothing(
    whole: Path, tmp_path: Path, data: st.DataObject
) -> None:
    ends = boundaries(whole)
    exact = st.sampled_from([0, *ends, ends[-1] + len(END_MARK)])
    length = data.draw(exact | st.integers(0, ends[-1] + len(END_MARK)))
    run = cut(whole, tmp_path / "run", length)
    rows = 50 * sum(end <= length for end in ends[1:])
    clean = length == ends[-1] + len(END_MARK)
    report = recover(run)
    last = max([0, *(end for end in ends if end <= length)])
    assert report.changed
    assert report.rows_kept == rows
    assert report.bytes_dropped == (0 if clean else length - last)
    assert report.status == "recovered"
    kept = run / "samples.arrows.torn"
    assert kept.exists() == (report.bytes_dropped > 0)
    assert not kept.exists() or kept.stat().st_size == length
    found = load(run)
    assert found.torn is None
    assert found["t"].tolist() == [row / 1000 for row in range(rows)]
    assert found.manifest["rows"] == rows
    assert str(found.manifest["cause"]).startswith("killed" if clean else "torn: samples.arrows")
    again = recover(run)
    assert not again.changed
    assert (again.rows_kept, again.status) == (rows, "recovered")


@SLOW
@given(tail=st.binary(max_size=300) | st.integers(1, 40_000).map(bytes), batches=st.integers(0, 3))
def test_any_tail_keeps_the_batches_before_it(
    whole: Path, tmp_path: Path, tail: bytes, batches: int
) -> None:
    run = cut(whole, tmp_path / "run", boundaries(whole)[batches])
    with (run / "samples.arrows").open("ab") as file:
        file.write(tail)
    assert load(run)["t"].tolist() == [row / 1000 for row in range(50 * batches)]


def test_a_lost_manifest_comes_from_the_samples(whole: Path, tmp_path: Path) -> None:
    ends = boundaries(whole)
    run = cut(whole, tmp_path / "run", ends[1] + 10)
    (run / "run.json").unlink()
    assert load(run).manifest["seed"] == 5
    assert recover(run).status == "recovered"
    assert load(run).manifest["seed"] == 5
    torn = cut(whole, tmp_path / "torn", ends[0] - 1)
    (torn / "run.json").unlink()
    for read in (load, recover):
        with pytest.raises(RecordingError, match=r"lost its run\.json, and .* no copy"):
            read(torn)


def rows_in(run: Path) -> int:
    """Rows in the whole batches that a run has on disk."""
    stream = WholeBatches(run / "samples.arrows")
    return sum(batch.num_rows for batch in stream)


@pytest.mark.parametrize("kind", ["loop", "process"])
def test_a_killed_process_loses_at_most_50_rows(tmp_path: Path, kind: str) -> None:
    command = [sys.executable, recorded_rows.__file__, "paced", str(tmp_path), kind]
    with subprocess.Popen(command, stdout=subprocess.PIPE, bufsize=0) as process:
        assert process.stdout is not None
        told, row, path = process.stdout.read(1 << 16), 0, next(tmp_path.iterdir())
        # It loses no more while the disk keeps up: on a busy machine that may take a while.
        while row < 520 or row - rows_in(path) > 100:
            told += process.stdout.read(1 << 16)
            row = int(told.split(b"\n")[-2])
            assert row < 50_000
        process.kill()
        while rest := process.stdout.read(1 << 16):
            told += rest
    appended = int(told.split(b"\n")[-2]) + 1
    with (path / "samples.arrows").open("rb") as samples:
        # A process of its own still writes what it was handed.
        lock(samples.fileno(), path, patience=20.0)
    run = load(path)
    rows = len(run.time)
    assert appended - 50 <= rows
    np.testing.assert_array_equal(run["t"], np.arange(rows) / 1000)
    assert run.manifest["status"] == "running"
    assert run.torn == f"samples.arrows has no end mark after {rows} rows"
    assert [event["name"] for event in run.events] == ["touchdown"]
    report = recover(path)
    assert (report.rows_kept, report.status) == (rows, "recovered")
    assert len(load(path).time) == rows


def test_torn_events_are_set_aside(whole: Path, tmp_path: Path) -> None:
    run = cut(whole, tmp_path / "run", boundaries(whole)[3])
    old = (run / "events.jsonl").read_bytes()[:-5]
    (run / "events.jsonl").write_bytes(old)
    assert [event["name"] for event in load(run).events] == ["touchdown"]
    assert "events.jsonl has 1 unreadable lines" in (load(run).torn or "")
    assert recover(run).events_dropped == 1
    assert (run / "events.jsonl.torn").read_bytes() == old
    assert [event["name"] for event in load(run).events] == ["touchdown"]
    assert load(run).torn is None
