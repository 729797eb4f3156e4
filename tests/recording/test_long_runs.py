"""A run too long to be kept in memory gives what it gives in memory, column by column."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from recorded_rows import append_rows

from legbench.errors import RecordingError
from legbench.recording import archive_columns, reader
from legbench.recording.archive_columns import (
    ArchiveColumns,
    ArchiveRows,
    column_windows,
    rows_of,
)
from legbench.recording.reader import Recording, load
from legbench.recording.writer import RunWriter

ROWS = 730


@pytest.fixture(params=["closed", "torn"])
def run(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    writer = RunWriter.create(tmp_path, {})
    append_rows(writer, ROWS // 2)
    append_rows(writer, ROWS - ROWS // 2, start=ROWS // 2, truth=False)
    if request.param == "closed":
        writer.close()
    else:
        # As a killed process leaves it.
        writer._disk.close()
    return writer.path


@pytest.fixture
def both(run: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Recording, Recording]:
    """The run in memory, and as a long one is read."""
    short = load(run)
    monkeypatch.setattr(reader, "LONG_ROWS", 100)
    return short, load(run)


def test_columns_are_read_from_the_file_and_the_same(both: tuple[Recording, Recording]) -> None:
    short, long = both
    assert isinstance(long.columns, ArchiveColumns)
    assert not isinstance(short.columns, ArchiveColumns)
    assert list(long.columns) == list(short.columns)
    assert len(long.columns) == len(short.columns)
    for name, values in short.columns.items():
        assert long.columns[name].dtype == values.dtype
        np.testing.assert_array_equal(long.columns[name], values)
    assert long.signals == short.signals
    assert (long.torn, long.has_truth, long.manifest) == (short.torn, False, short.manifest)
    np.testing.assert_array_equal(long["joint_pos"], short["joint_pos"])
    assert long.to_arrow().equals(short.to_arrow()) or np.isnan(short["trunk_pos"]).any()
    with pytest.raises(ValueError, match="read-only"):
        long.columns["joint_pos_1"][0] = 1.0
    with pytest.raises(KeyError):
        long.columns["no_such"]


@pytest.mark.parametrize("rows", [1, 64, ROWS, 10 * ROWS])
def test_windows_are_the_rows_in_order(both: tuple[Recording, Recording], rows: int) -> None:
    for recording in both:
        parts = list(recording.windows(rows))
        assert max(len(part.time) for part in parts) <= rows
        np.testing.assert_array_equal(np.concatenate([p.time for p in parts]), recording.time)
        for name in ("joint_pos", "contact_force", "phase", "contact"):
            joined = np.concatenate([part[name] for part in parts])
            np.testing.assert_array_equal(joined, recording[name])


@pytest.mark.parametrize("rows", [slice(0, ROWS), slice(65, 400), slice(600, 900), slice(5, 5)])
def test_some_rows_of_a_long_run_stay_in_its_file(
    both: tuple[Recording, Recording], rows: slice
) -> None:
    short, long = (rows_of(each.columns, rows) for each in both)
    assert isinstance(long, ArchiveRows)
    assert (list(long), len(long)) == (list(short), len(short))
    assert "joint_pos_1" in long
    assert "no_such" not in long
    inner = slice(10, 40)
    few = ("joint_pos_1", "trunk_pos_x", "phase", "contact")
    for part, mine, theirs, names in (
        (slice(None), long, short, list(short)),
        (inner, rows_of(long, inner), rows_of(short, inner), few),
    ):
        for name in names:
            values = theirs[name]
            assert mine[name].base is None  # keeps no column of the whole run
            np.testing.assert_array_equal(mine[name], values)
            windows = [each[name] for each in column_windows(mine, 64)]
            joined = np.concatenate(windows) if windows else values[:0]
            np.testing.assert_array_equal(joined, short[name][part])
            assert max(map(len, windows), default=0) <= 64


def test_the_temporary_file_of_a_torn_run_goes_with_it(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reader, "LONG_ROWS", 100)
    spool = tmp_path / "spool"
    spool.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(spool))
    recording = load(run)
    torn = recording.torn is not None
    assert len(list(spool.iterdir())) == torn
    del recording
    assert list(spool.iterdir()) == []


def test_damage_is_named_where_it_is_met(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = RunWriter.create(tmp_path, {})
    append_rows(writer, ROWS)
    writer.close()
    monkeypatch.setattr(reader, "LONG_ROWS", 100)
    path = writer.path / "samples.parquet"
    content = bytearray(path.read_bytes())
    middle = content.index(pa.py_buffer(b"PAR1").to_pybytes()) + 4
    content[middle : len(content) // 2] = bytes(len(content) // 2 - middle)
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r"samples\.parquet is damaged"):
        load(writer.path)["joint_pos"]


def test_a_run_is_long_after_four_minutes_at_a_kilohertz() -> None:
    assert archive_columns.LONG_ROWS == 262_144
    assert archive_columns.WINDOW_ROWS == 65_536


def test_rows_of_rows_are_counted_and_read_only(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        append_rows(writer, 130)
    whole = ArchiveColumns(writer.path / "samples.parquet")
    assert whole.rows == 130
    for rows, count in ((slice(30, 90), 60), (slice(100, 500), 30), (slice(90, 20), 0)):
        part = ArchiveRows(whole, rows)
        assert part.rows == len(part["t_ns"]) == count
        inner = ArchiveRows(part, slice(10, 20))
        assert inner.rows == min(10, max(0, count - 10))
        np.testing.assert_array_equal(inner["t_ns"], part["t_ns"][10:20])
        for columns in (whole, part, inner):
            for name in ("t_ns", "contact"):
                with pytest.raises(ValueError, match="read-only"):
                    columns[name][:] = 1


def test_an_archive_that_cannot_be_spooled_says_why_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    for goes in (False, True):

        def refuse(folder: Path, *_: object, goes: bool = goes) -> int:
            if goes:
                folder.rmdir()
            raise RecordingError("no room")

        monkeypatch.setattr(archive_columns, "write_archive", refuse)
        stream: Any = None
        with pytest.raises(RecordingError, match="no room"):
            archive_columns.spooled(stream, {})
        assert list(tmp_path.iterdir()) == []
