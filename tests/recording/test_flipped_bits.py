"""Single flipped bits in Parquet files: told in one line, or without effect on a value."""

import random
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet
from recorded_rows import append_rows

from legbench.campaign import read_table
from legbench.campaign.shards import read_shard, shard_bytes, told_of
from legbench.campaign.table import FORMAT_KEY
from legbench.errors import CampaignError, RecordingError
from legbench.recording import reader
from legbench.recording.archive import count_rows
from legbench.recording.layout import ARCHIVE
from legbench.recording.reader import load
from legbench.recording.repair import recover
from legbench.recording.saved import save_recording
from legbench.recording.sealed import MARK, sealed_bytes
from legbench.recording.writer import RunWriter

ROWS = 100
"""Length of a run: two batches of a stream."""
FLIPS = 120
"""Number of flips in a file, half of them in its footer."""
Values = dict[str, Any]


def footer_of(content: bytes) -> int:
    return len(content) - 8 - int.from_bytes(content[-8:-4], "little")


def flipped(content: bytes, count: int = FLIPS) -> Iterator[bytes]:
    """Yield a file with one bit flipped each, in pages and in the footer alike often."""
    draw, footer = random.Random(7), footer_of(content)
    for first, stop in ((0, footer), (footer, len(content))):
        for bit in draw.sample(range(8 * first, 8 * stop), count // 2):
            other = bytearray(content)
            other[bit // 8] ^= 1 << bit % 8
            yield bytes(other)


def rows_of(run: Path) -> Values:
    recording = load(run)
    return {name: recording.columns[name] for name in recording.columns}


def table_of(path: Path) -> Values:
    return read_table(path).to_pydict()


def shard_of(path: Path) -> Values:
    told_of(path)
    return read_shard(path).to_pydict()


@pytest.fixture
def run(tmp_path: Path) -> Path:
    with RunWriter.create(tmp_path, {}) as writer:
        append_rows(writer, ROWS)
    return writer.path


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "table.parquet"
    values = {"row": ["run", "period"] * 20, "figure": np.sqrt(np.arange(40.0)), "n": range(40)}
    path.write_bytes(sealed_bytes(pa.table(values).replace_schema_metadata({FORMAT_KEY: b"1"})))
    return path


@pytest.fixture
def shard(tmp_path: Path) -> Path:
    path = tmp_path / "shard.parquet"
    row = {"experiment": "a", "row": "run"}
    rows = [row | {"index": place, "apex": 0.1 * place} for place in range(20)]
    path.write_bytes(shard_bytes("a", rows))
    return path


def equal(ours: Values, theirs: Values) -> bool:
    """Whether all values are the same; what is no number is itself here."""
    texts = [{name: repr(list(each)) for name, each in values.items()} for values in (ours, theirs)]
    return texts[0] == texts[1]


def judged(path: Path, whole: Values, read: Callable[[], Values]) -> tuple[list[str], int]:
    """What was told of flips, and how many changed a value in silence."""
    content, silent = path.read_bytes(), 0
    told: list[str] = []
    for damaged in flipped(content):
        path.write_bytes(damaged)
        try:
            values = read()
        except (RecordingError, CampaignError) as error:
            told.append(str(error))
            continue
        silent += not equal(values, whole)
    path.write_bytes(content)
    return told, silent


def assert_noticed(path: Path, whole: Values, read: Callable[[], Values]) -> None:
    """Most flips are told, in a line each; none changes a value in silence."""
    told, silent = judged(path, whole, read)
    assert silent == 0
    assert len(told) > 0.8 * FLIPS
    assert all(" is damaged: " in each and "; " in each and "\n" not in each for each in told)


@pytest.mark.parametrize("long_rows", [reader.LONG_ROWS, 10])
def test_samples(run: Path, monkeypatch: pytest.MonkeyPatch, long_rows: int) -> None:
    """Runs that are read at once, and long ones that are read column by column."""
    whole = rows_of(run)
    monkeypatch.setattr(reader, "LONG_ROWS", long_rows)
    assert_noticed(run / ARCHIVE, whole, lambda: rows_of(run))


def test_saved_recordings_are_as_safe(run: Path, tmp_path: Path) -> None:
    saved = tmp_path / "saved"
    save_recording(load(run), saved)
    assert_noticed(saved / ARCHIVE, rows_of(saved), lambda: rows_of(saved))


def test_tables_of_campaigns(table: Path) -> None:
    assert_noticed(table, table_of(table), lambda: table_of(table))


def test_shards_of_campaigns(shard: Path) -> None:
    assert_noticed(shard, shard_of(shard), lambda: shard_of(shard))


def test_recover_tells_damage_as_reading_does(run: Path) -> None:
    path, told = run / ARCHIVE, []
    for damaged in flipped(path.read_bytes(), 40):
        path.write_bytes(damaged)
        with suppress(RecordingError):
            assert recover(run).rows_kept == ROWS
            continue
        told.append(damaged)
    assert len(told) >= 30


def test_rows_that_end_at_a_page_of_no_kind_are_not_counted_as_all(table: Path) -> None:
    """The first page of a column says of which kind it is in its second byte."""
    content, told = table.read_bytes(), 0
    assert count_rows(table) == 40
    for bit in range(8 * 5, 8 * 6):
        damaged = bytearray(content)
        damaged[bit // 8] ^= 1 << bit % 8
        table.write_bytes(damaged)
        try:
            assert count_rows(table) == 40
        except (OSError, pa.ArrowException) as error:
            told += "it gave back 0 of 40 rows" in str(error)
    assert told > 0


def test_a_damaged_archive_beside_its_stream_is_written_anew(tmp_path: Path) -> None:
    writer = RunWriter.create(tmp_path, {})
    append_rows(writer, ROWS)
    writer._disk.finish()
    stream = (writer.path / "samples.arrows").read_bytes()
    writer._disk.close()
    recover(writer.path)
    whole = rows_of(writer.path)
    path = writer.path / ARCHIVE
    for damaged in flipped(path.read_bytes(), 2):
        path.write_bytes(damaged)
        (writer.path / "samples.arrows").write_bytes(stream)
        assert recover(writer.path).rows_kept == ROWS
        assert equal(rows_of(writer.path), whole)


def test_files_without_checksums_are_read(run: Path) -> None:
    whole = rows_of(run)
    stored = parquet.read_table(run / ARCHIVE)
    assert MARK in (run / ARCHIVE).read_bytes()
    parquet.write_table(stored, run / ARCHIVE)
    assert MARK not in (run / ARCHIVE).read_bytes()
    assert equal(rows_of(run), whole)


def test_a_column_of_an_older_file_whose_name_is_no_text_is_damage(run: Path) -> None:
    path = run / ARCHIVE
    parquet.write_table(parquet.read_table(path), path)
    content = path.read_bytes()
    name = content.index(b"command_pos_1", footer_of(content))
    path.write_bytes(content[:name] + b"\xe3" + content[name + 1 :])
    with pytest.raises(RecordingError, match=r"samples\.parquet is damaged: 'utf-8'"):
        load(run)
