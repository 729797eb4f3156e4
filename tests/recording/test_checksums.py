"""Bytes of samples that rotted on the disk are noticed, wherever they are."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import ipc
from recorded_rows import append_rows

from legbench.errors import LegbenchError
from legbench.recording.checksum import BATCH, CHECKED_KEY
from legbench.recording.reader import load
from legbench.recording.repair import recover
from legbench.recording.stream import END_MARK, BatchEncoder, WholeBatches, encode_schema
from legbench.recording.writer import RunWriter

ROWS, BATCHES = 50, 4


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The stream of a run of four batches that was killed before its end mark."""
    return (torn_run(tmp_path_factory.mktemp("samples")) / "samples.arrows").read_bytes()


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return torn_run(tmp_path)


def torn_run(folder: Path) -> Path:
    writer = RunWriter.create(folder, {})
    append_rows(writer, ROWS * BATCHES)
    # The run ends as a killed process leaves it: no end mark, no archive.
    writer._disk.close()
    return writer.path


def ends_of(samples: bytes) -> list[int]:
    """Offset after the opening, and after each batch."""
    reader = pa.BufferReader(samples)
    ipc.read_message(reader)
    ends = [reader.tell()]
    while ends[-1] < len(samples):
        ipc.read_message(reader)
        ends.append(reader.tell())
    return ends


def test_whole_batches_are_read_by_arrow_itself(samples: bytes) -> None:
    table = ipc.open_stream(pa.BufferReader(samples + END_MARK)).read_all()
    np.testing.assert_array_equal(table["t_ns"].to_numpy(), np.arange(ROWS * BATCHES) * 1_000_000)


def test_flipped_bytes_cost_their_batch_alone(run: Path, samples: bytes) -> None:
    ends = ends_of(samples)
    rotten = bytearray(samples)
    rotten[ends[2] - 777] ^= 0x10
    (run / "samples.arrows").write_bytes(rotten)
    recording = load(run)
    rows = [*range(ROWS), *range(2 * ROWS, 4 * ROWS)]
    np.testing.assert_array_equal(recording["t"], np.array(rows) / 1000)
    said = "samples.arrows has rotten bytes in 1 of its 4 batches, left out"
    assert (recording.torn or "").startswith(said)
    report = recover(run)
    assert (report.rows_kept, report.status) == (3 * ROWS, "recovered")
    assert report.bytes_dropped == ends[2] - ends[1]
    assert said in (report.cause or "")
    assert (run / "samples.arrows.torn").read_bytes() == rotten
    assert load(run).torn is None
    np.testing.assert_array_equal(load(run)["t"], np.array(rows) / 1000)


@pytest.mark.parametrize("kept", [0, 1, 300, 5000])
def test_a_tail_of_zeros_is_no_row(run: Path, samples: bytes, kept: int) -> None:
    """As a power cut leaves a file: as long as it was to be, with zeros in its last blocks."""
    end = ends_of(samples)[3] + kept
    (run / "samples.arrows").write_bytes(samples[:end] + bytes(len(samples) - end))
    recording = load(run)
    np.testing.assert_array_equal(recording["t"], np.arange(3 * ROWS) / 1000)
    assert recording.torn is not None
    assert recover(run).bytes_dropped == len(samples) - ends_of(samples)[3]
    assert len(load(run).time) == 3 * ROWS


def test_bytes_that_rot_before_the_close_are_told_and_kept(tmp_path: Path) -> None:
    writer = RunWriter.create(tmp_path, {})
    append_rows(writer, ROWS * BATCHES)
    path = writer.path / "samples.arrows"
    samples = path.read_bytes()
    with path.open("r+b") as file:
        file.seek(ends_of(samples)[1] - 777)
        file.write(b"rotten")
    writer.close()
    told = load(writer.path).manifest["archive_error"]
    assert told.startswith("150 of 200 rows could be read back: samples.arrows has rotten bytes")
    assert path.exists()
    report = recover(writer.path)
    assert (report.rows_kept, report.status) == (150, "complete")
    assert (writer.path / "samples.arrows.torn").exists()


def test_a_flip_of_any_byte_is_noticed(run: Path, samples: bytes) -> None:
    path = run / "samples.arrows"
    written = np.arange(ROWS * BATCHES) / 1000
    for place in range(0, len(samples), 97):
        rotten = bytearray(samples + END_MARK)
        rotten[place] ^= 1 << place % 8
        path.write_bytes(rotten)
        try:
            recording = load(run)
        except LegbenchError:
            continue
        assert recording.torn is not None, place
        assert np.isin(recording.time, written).all(), place


def test_a_damaged_opening_is_told_and_costs_no_row(run: Path, samples: bytes) -> None:
    rotten = samples.replace(b"rad/s", b"rad/h", 1)
    assert rotten != samples
    (run / "samples.arrows").write_bytes(rotten)
    recording = load(run)
    assert len(recording.time) == ROWS * BATCHES
    assert "the opening of samples.arrows is damaged" in (recording.torn or "")
    assert "the opening of samples.arrows is damaged" in (recover(run).cause or "")
    assert (run / "samples.arrows.torn").read_bytes() == rotten


def test_streams_without_checksums_are_read_as_ever(tmp_path: Path, samples: bytes) -> None:
    reader = ipc.open_stream(pa.BufferReader(samples + END_MARK))
    old = reader.schema.with_metadata({b"legbench": reader.schema.metadata[b"legbench"]})
    path = tmp_path / "samples.arrows"
    with ipc.new_stream(str(path), old) as writer:
        for batch in reader:
            writer.write_batch(batch.replace_schema_metadata(old.metadata))
    stream = WholeBatches(path)
    assert sum(batch.num_rows for batch in stream) == ROWS * BATCHES
    assert stream.tear is None


def test_a_batch_without_its_checksum_is_damaged(tmp_path: Path, samples: bytes) -> None:
    schema = ipc.open_stream(pa.BufferReader(samples)).schema
    assert CHECKED_KEY in schema.metadata
    values = np.zeros((len(schema), 1))
    batch = bytes(BatchEncoder(values, schema).encode(values))
    path = tmp_path / "samples.arrows"
    path.write_bytes(bytes(encode_schema(schema)) + batch.replace(BATCH, b"crc33:") + END_MARK)
    stream = WholeBatches(path)
    assert list(stream) == []
    assert stream.tear == "samples.arrows has rotten bytes in 1 of its 1 batches, left out"
