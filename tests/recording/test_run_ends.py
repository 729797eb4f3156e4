"""Streams whose opening is torn, and runs that end while nobody has said why."""

from datetime import UTC, datetime
from pathlib import Path

import pytest
from recorded_rows import append_rows, cycle

from legbench.errors import PlantFault, RecordingError
from legbench.recording.reader import load
from legbench.recording.rows import BATCH_ROWS
from legbench.recording.stream import WholeBatches, encode_schema, schema_for
from legbench.recording.writer import RunWriter


@pytest.mark.parametrize("missing", [1, 8, 10_000_000])
def test_a_torn_opening_is_told_with_nothing_before_it(tmp_path: Path, missing: int) -> None:
    opening = bytes(encode_schema(schema_for({})))
    path = tmp_path / "samples.arrows"
    path.write_bytes(opening[: max(0, len(opening) - missing)])
    stream = WholeBatches(path)
    assert list(stream) == []
    assert stream.schema is None
    assert stream.tear == "samples.arrows is torn before its first row"
    assert (stream.rows, stream.end, stream.size) == (0, 0, path.stat().st_size)


def test_rows_are_counted_as_they_are_appended(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        for row in range(2 * BATCH_ROWS + 3):
            assert writer.rows == row
            writer.append(*cycle(row))
        assert writer.rows == 2 * BATCH_ROWS + 3
    assert writer.rows == 2 * BATCH_ROWS + 3


def test_a_run_lasts_from_its_first_to_its_last_row(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        append_rows(writer, 120, start=7_300)
    manifest = load(writer.path).manifest
    assert manifest["duration"] == pytest.approx(0.119, abs=1e-12)
    assert manifest["rows"] == 120
    unknown = {"recording_error", "rows_lost", "events_error", "archive_error"}
    assert not unknown & manifest.keys()


def test_a_run_without_rows_lasts_for_no_time(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        pass
    manifest = load(writer.path).manifest
    assert (manifest["duration"], manifest["rows"]) == (0.0, 0)


def test_an_interruption_says_how_much_was_kept(tmp_path: Path) -> None:
    for error in (KeyboardInterrupt(), GeneratorExit()):
        writer = RunWriter.create(tmp_path, {})
        append_rows(writer, 60)
        with pytest.raises(type(error)), writer:
            raise error
        assert error.__notes__ == [f"{writer.path} holds 60 rows"]
        manifest = load(writer.path).manifest
        assert (manifest["status"], manifest["cause"]) == ("interrupted", type(error).__name__)


def test_the_fault_below_any_number_of_errors_is_the_cause(tmp_path: Path) -> None:
    writer = RunWriter.create(tmp_path, {})

    def fail() -> None:
        try:
            try:
                raise PlantFault("leg-crossed", "the leg is crossed")
            except PlantFault:
                raise ValueError("first") from None
        except ValueError as error:
            raise KeyError("second") from error

    with pytest.raises(KeyError), writer:
        fail()
    manifest = load(writer.path).manifest
    assert (manifest["status"], manifest["cause"]) == ("fault", "leg-crossed")


def test_a_manifest_that_cannot_be_updated_is_told_and_leaves_the_stream(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = RunWriter.create(tmp_path, {})
    append_rows(writer, 60)

    def refuse(run: Path, manifest: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("legbench.recording.writer.write_manifest", refuse)
    with pytest.raises(RecordingError, match=r"run\.json was not updated: No space .*; 60 rows"):
        writer.close()
    assert (writer.path / "samples.arrows").exists()
    assert len(load(writer.path).time) == 60
    assert load(writer.path).manifest["status"] == "running"
    writer.close()


def test_an_archive_of_other_rows_than_were_written_replaces_no_stream(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for found in (59, 61):
        writer = RunWriter.create(tmp_path, {})
        append_rows(writer, 60)
        with monkeypatch.context() as patch:
            patch.setattr("legbench.recording.writer.write_archive", lambda *_, n=found: n)
            writer.close()
        assert (writer.path / "samples.arrows").exists()
        assert len(load(writer.path).time) == 60


def test_a_name_that_is_taken_gets_the_next_number(tmp_path: Path) -> None:
    first = RunWriter.create(tmp_path, {}, name="x")
    first.close()
    stem = first.path.name
    start = datetime.strptime(stem[:15], "%Y%m%d-%H%M%S").replace(tzinfo=UTC)
    (tmp_path / f"{stem}-2").write_text("a file")
    (tmp_path / f"{stem}-4").mkdir()
    made = [RunWriter.create(tmp_path, {}, name="x", created=start) for _ in range(2)]
    assert [writer.path.name for writer in made] == [f"{stem}-3", f"{stem}-5"]
    for writer in made:
        writer.close()
        assert writer.path.is_dir()
