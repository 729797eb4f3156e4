"""Row groups of an archive, and archives that cannot be put in place."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import ipc, parquet
from recorded_rows import append_rows

from legbench.errors import RecordingError
from legbench.recording import archive
from legbench.recording.archive import count_rows, read_schema, write_archive
from legbench.recording.reader import load
from legbench.recording.stream import WholeBatches, carried_manifest
from legbench.recording.writer import RunWriter


@pytest.mark.parametrize(
    ("group", "rows", "groups"),
    [
        (100, 250, [100, 100, 50]),
        (100, 200, [100, 100]),
        (101, 250, [150, 100]),
        (149, 300, [150, 150]),
        (151, 400, [200, 200]),
        (50, 150, [50, 50, 50]),
        (1000, 130, [130]),
        (1000, 0, []),
    ],
)
def test_small_batches_are_gathered_until_they_reach_a_group(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, group: int, rows: int, groups: list[int]
) -> None:
    monkeypatch.setattr(archive, "GROUP_ROWS", group)
    with RunWriter.create(tmp_path, {}) as writer:
        append_rows(writer, rows)
    path = writer.path / "samples.parquet"
    with parquet.ParquetFile(path) as file:
        found = [file.metadata.row_group(n).num_rows for n in range(file.num_row_groups)]
    assert found == groups
    assert count_rows(path) == rows
    np.testing.assert_array_equal(load(writer.path)["t"], np.arange(rows) / 1000)


def test_an_hour_at_a_kilohertz_is_compressed_by_the_minute() -> None:
    assert archive.GROUP_ROWS == 2**16


def test_columns_are_encoded_by_what_they_hold(tmp_path: Path) -> None:
    """Whole times by their steps, floats by their bytes: a third of the space is won by it."""
    with RunWriter.create(tmp_path, {}) as writer:
        append_rows(writer, 120)
    with parquet.ParquetFile(writer.path / "samples.parquet") as file:
        group = file.metadata.row_group(0)
        columns = [group.column(n) for n in range(group.num_columns)]
    found = {column.path_in_schema: column for column in columns}
    assert {column.compression for column in columns} == {"ZSTD"}
    assert "DELTA_BINARY_PACKED" in found["t_ns"].encodings
    assert "BYTE_STREAM_SPLIT" in found["joint_pos_1"].encodings
    assert not {"BYTE_STREAM_SPLIT", "DELTA_BINARY_PACKED"} & set(found["phase"].encodings)
    assert not any("DICTIONARY" in name for column in columns for name in column.encodings)


def test_an_archive_has_the_columns_of_its_stream_whatever_the_manifest_says(
    tmp_path: Path,
) -> None:
    load_signal = {"name": "load", "unit": "N", "doc": "Load of the foot."}
    own = {"format": 2, "controller": {"signals": [load_signal]}}
    table = pa.table({"t_ns": pa.array([0, 1_000_000]), "older": pa.array([0.5, 1.5])})
    stream = tmp_path / "samples.arrows"
    with ipc.new_stream(str(stream), table.schema) as writer:
        writer.write_table(table)
    assert write_archive(tmp_path, WholeBatches(stream), own) == 2
    schema = read_schema(tmp_path)
    assert schema.names == ["t_ns", "older"]
    assert carried_manifest(schema, tmp_path) == own
    # A stream without a whole opening has no columns of its own.
    stream.write_bytes(stream.read_bytes()[:40])
    assert write_archive(tmp_path, WholeBatches(stream), own) == 0
    assert read_schema(tmp_path).names[-1] == "load"


def test_a_draft_that_is_left_over_is_written_anew_and_goes(tmp_path: Path) -> None:
    writer = RunWriter.create(tmp_path, {})
    append_rows(writer, 60)
    (writer.path / ".samples.parquet.draft").write_text("left over")
    writer.close()
    assert len(load(writer.path).time) == 60
    assert not (writer.path / ".samples.parquet.draft").exists()


def test_a_refused_archive_leaves_no_draft_and_the_older_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = RunWriter.create(tmp_path, {})
    append_rows(writer, 100)
    writer._disk.finish()
    (writer.path / "samples.parquet").write_bytes(b"older")
    for found in (99, 101):
        monkeypatch.setattr(archive, "count_rows", lambda path, found=found: found)
        with pytest.raises(RecordingError, match=f"gave back {found} of 100 rows"):
            write_archive(writer.path, WholeBatches(writer.path / "samples.arrows"), {})
    assert (writer.path / "samples.parquet").read_bytes() == b"older"
    (writer.path / "folder").mkdir()

    def refuse(draft: Path, path: Path) -> None:
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(archive, "count_rows", lambda path: 100)
    monkeypatch.setattr(archive, "put_in_place", refuse)
    with pytest.raises(RecordingError, match="was not written: Read-only file system"):
        write_archive(writer.path, WholeBatches(writer.path / "samples.arrows"), {})
    assert (writer.path / "samples.parquet").read_bytes() == b"older"
    assert not (writer.path / ".samples.parquet.draft").exists()
    writer._disk.close()
