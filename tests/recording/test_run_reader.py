import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recorded_rows import append_rows

from legbench.errors import FormatError, LegbenchError, RecordingError
from legbench.recording.reader import UnknownSignalError, load
from legbench.recording.repair import recover
from legbench.recording.writer import RunWriter


@pytest.fixture
def run(tmp_path: Path) -> Path:
    with RunWriter.create(tmp_path, {}, name="x") as writer:
        append_rows(writer, 60)
    return writer.path


def test_unknown_signals_list_those_there_are(run: Path) -> None:
    with pytest.raises(UnknownSignalError) as caught:
        load(run)["joint_angle"]
    assert isinstance(caught.value, KeyError)
    assert isinstance(caught.value, LegbenchError)
    assert str(caught.value).startswith(
        f"{run.name} has no signal 'joint_angle'; it has t, command"
    )


def test_columns_and_signals_agree(run: Path) -> None:
    found = load(run)
    np.testing.assert_array_equal(found["joint_pos"][:, 1], found.columns["joint_pos_2"])
    np.testing.assert_array_equal(found["joint_pos_2"], found.columns["joint_pos_2"])
    np.testing.assert_array_equal(found["t"], found["time"])
    assert found["contact"].dtype == np.bool_
    assert found["phase"].dtype == np.int64


def test_a_signal_is_there_with_all_its_columns_or_not_at_all(run: Path) -> None:
    found = load(run)
    fewer = {name: found.columns[name] for name in found.columns if name != "joint_pos_2"}
    partial = replace(found, columns=fewer)
    assert set(found.signals) - set(partial.signals) == {"joint_pos"}
    with pytest.raises(UnknownSignalError, match="no signal 'joint_pos'; it has t,"):
        partial["joint_pos"]


def test_what_was_read_cannot_be_changed_by_accident(run: Path) -> None:
    found = load(run)
    with pytest.raises(ValueError, match="read-only"):
        found.columns["joint_pos_1"][0] = 1.0
    found["joint_pos"][0] = 99.0
    assert load(run)["joint_pos"].tolist() == found["joint_pos"].tolist()


@pytest.mark.parametrize("name", ["", "run.json", "samples.parquet"])
def test_a_run_is_found_by_its_files(run: Path, name: str) -> None:
    assert load(run / name).path == run


def test_a_running_run_can_be_read(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        append_rows(writer, 20)
        found = load(writer.path)
        assert found.torn == "samples.arrows has no end mark after 0 rows"
        assert found["joint_pos"].shape == (0, 2)


def test_a_newer_format_is_refused(run: Path) -> None:
    path = run / "run.json"
    newer = json.loads(path.read_text()) | {"format": 7, "legbench": "9.1"}
    path.write_text(json.dumps(newer))
    for read in (load, recover):
        with pytest.raises(FormatError, match=r"format 7 was written by a newer legbench \(9\.1\)"):
            read(run)


@pytest.mark.parametrize("content", ["[1]", '{"format": "one"}', "{}", '{"format": 0}'])
def test_a_manifest_of_another_kind_is_refused(run: Path, content: str) -> None:
    (run / "run.json").write_text(content)
    with pytest.raises(FormatError, match=r"is no run manifest: its format is .*, not 1\.\.2"):
        load(run)


def test_a_damaged_manifest_is_named_and_can_be_moved_away(run: Path) -> None:
    path = run / "run.json"
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(RecordingError, match=r"run\.json is damaged: .*; move it away"):
        load(run)
    path.unlink()
    assert load(run).complete


def test_damaged_samples_are_named(run: Path) -> None:
    path = run / "samples.parquet"
    path.write_bytes(path.read_bytes()[:-20])
    for read in (load, recover):
        with pytest.raises(RecordingError, match=r"samples\.parquet is damaged|not be recovered"):
            read(run)


def test_missing_samples_are_named(run: Path) -> None:
    (run / "samples.parquet").unlink()
    with pytest.raises(RecordingError, match=r"no samples: no .*parquet, no .*arrows"):
        load(run)


def test_what_is_no_run_is_refused(run: Path) -> None:
    with pytest.raises(RecordingError, match=f"no run folder: .* it holds the runs {run.name}"):
        load(run.parent)
    with pytest.raises(RecordingError, match="nowhere does not exist"):
        load(run.parent / "nowhere")
