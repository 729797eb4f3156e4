"""A run that was exported and read back is the same run, number by number."""

import csv
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from mcap.reader import make_reader
from pyarrow import parquet
from scipy.io import loadmat

from legbench.export.formats import Format, export
from legbench.recording.reader import Recording


def phases_of(run: Recording) -> set[str]:
    return {phase.name for phase in run.description.phases}


def written(run: Recording, folder: Path, kind: Format) -> Path:
    told: list[tuple[int, int]] = []
    file = folder / "new" / f"run.{kind.value}"
    path = export(run, file, kind, lambda done, of: told.append((done, of)))
    assert told[-1][0] == told[-1][1] > 0
    assert [each.name for each in path.parent.iterdir()] == [path.name]
    return path


def columns_of(table: pa.Table) -> dict[str, np.ndarray]:
    """Columns of a table as a recording has them."""
    return {
        name: (table[name].fill_null(-1) if name == "contact" else table[name]).to_numpy()
        for name in table.column_names
    }


def assert_same_bits(found: Mapping[str, np.ndarray], run: Recording) -> None:
    assert list(found) == list(run.columns)
    for name, values in run.columns.items():
        assert found[name].dtype == values.dtype, name
        # NaN has many bit patterns, and one meaning.
        both = [np.where(np.isnan(each), np.nan, each) for each in (found[name], values)]
        assert both[0].tobytes() == both[1].tobytes(), name


def test_parquet_is_bit_exact_and_plain(run: Recording, tmp_path: Path) -> None:
    path = written(run, tmp_path, Format.PARQUET)
    table = parquet.read_table(path)
    assert_same_bits(columns_of(table), run)
    metadata = table.schema.metadata
    assert table.schema.field("joint_vel_1").metadata == {b"unit": b"rad/s"}
    assert json.loads(metadata[b"units"])["contact_force_z"] == "N"
    assert set(json.loads(metadata[b"phases"]).values()) == phases_of(run)
    assert json.loads(metadata[b"legbench"])["id"] == run.manifest["id"]
    with parquet.ParquetFile(path) as file:
        columns = file.metadata.row_group(0)
        kinds = {columns.column(n).encodings for n in range(columns.num_columns)}
    assert {each for kind in kinds for each in kind} <= {"PLAIN", "RLE"}


def test_mat_is_bit_exact(run: Recording, tmp_path: Path) -> None:
    content = loadmat(written(run, tmp_path, Format.MAT))
    about = content["legbench"][0, 0]
    units = json.loads(about["units"][0])
    assert units["spring_torque_1"] == "N m"
    assert set(json.loads(about["phases"][0]).values()) == phases_of(run)
    assert json.loads(about["run_json"][0]) == run.manifest
    assert_same_bits({name: content[name][:, 0] for name in units}, run)


def test_csv_keeps_every_number(run: Recording, tmp_path: Path) -> None:
    with written(run, tmp_path, Format.CSV).open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert header[0] == "t [s]"
    assert header[header.index("phase [-]") + 1] == "phase_name"
    texts = dict(zip(header, zip(*rows, strict=True), strict=True))
    names = texts.pop("phase_name")
    assert {"rest", "99"} < set(names) <= phases_of(run) | {"99"}
    time = np.array(texts.pop("t [s]"), dtype=np.float64)
    assert np.rint(1e9 * time).astype(np.int64).tolist() == run.columns["t_ns"].tolist()
    for column, units in run.layout.units.items():
        if column != "t_ns":
            cells = texts.pop(f"{column} [{units}]")
            found = np.array([float(cell) if cell else np.nan for cell in cells])
            values = run.columns[column]
            wanted = np.where(values < 0, np.nan, values) if column == "contact" else values
            np.testing.assert_array_equal(found, wanted)
            assert np.array_equal(np.signbit(found), np.signbit(wanted)) or column == "contact"
    assert not texts


def test_mcap_rows_are_bit_exact(run: Recording, tmp_path: Path) -> None:
    path = written(run, tmp_path, Format.MCAP)
    with path.open("rb") as file:
        reader = make_reader(file)
        messages = [
            (channel.topic, message.log_time, json.loads(message.data))
            for _, channel, message in reader.iter_messages()
        ]
        summary = reader.get_summary()
        assert summary is not None
        schemas = {each.name: json.loads(each.data) for each in summary.schemas.values()}
        (attached,) = reader.iter_attachments()
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    rows = [(time, row) for topic, time, row in messages if topic == "/rows"]
    found = {
        name: np.array([np.nan if row[name] is None else row[name] for _, row in rows]).astype(
            values.dtype
        )
        for name, values in run.columns.items()
    }
    assert_same_bits(found, run)
    assert {"rest", "99"} < {row["phase_name"] for _, row in rows} <= phases_of(run) | {"99"}
    start = rows[0][0]
    assert [time - start for time, _ in rows] == run.columns["t_ns"].tolist()
    assert (attached.name, json.loads(attached.data)) == ("run.json", run.manifest)
    assert metadata["units"]["energy_kinetic"] == "J"
    assert set(metadata["phases"].values()) == phases_of(run)
    assert schemas["legbench.Row"]["properties"]["joint_vel_1"]["description"].startswith("[rad/s]")
    assert "foxglove.JointStates" in schemas
    events = [event for topic, _, event in messages if topic == "/events"]
    assert events == list(run.events)


def test_mcap_joint_states_leave_out_what_is_not_known(run: Recording, tmp_path: Path) -> None:
    with written(run, tmp_path, Format.MCAP).open("rb") as file:
        states = [
            (message.log_time, json.loads(message.data))
            for schema, _, message in make_reader(file).iter_messages(topics=["/joint_states"])
            if schema is not None and schema.name == "foxglove.JointStates"
        ]
    assert len(states) == len(run.time)
    for row, (time, state) in enumerate(states):
        stamp = state["timestamp"]
        assert 10**9 * stamp["sec"] + stamp["nsec"] == time
        joints = {joint.pop("name"): joint for joint in state["joints"]}
        assert list(joints) == ["q1", "q2", "motor1", "motor2"]
        for place, name in enumerate(("1", "2")):
            wanted = {
                "position": run["joint_pos"][row, place],
                "velocity": run["joint_vel"][row, place],
                "effort": run["spring_torque"][row, place],
            }
            known = {key: value for key, value in wanted.items() if np.isfinite(value)}
            assert joints[f"q{name}"] == known
            assert joints[f"motor{name}"] == {"position": run["motor_pos"][row, place]}


@pytest.mark.parametrize("kind", list(Format))
def test_a_run_without_rows_is_exported_as_one(
    run: Recording, tmp_path: Path, kind: Format
) -> None:
    columns = {name: values[:0] for name, values in run.columns.items()}
    empty = Recording(
        path=run.path,
        manifest=run.manifest,
        described=run.described,
        time=run.time[:0],
        columns=columns,
        events=(),
    )
    path = export(empty, tmp_path / f"run.{kind.value}", kind)
    if kind is Format.CSV:
        assert path.read_text(encoding="utf-8").startswith('"t [s]","command_pos_1 [rad]"')
    if kind is Format.PARQUET:
        assert parquet.read_table(path).num_rows == 0


def test_windows_make_the_same_file(
    run: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = {kind: written(run, tmp_path / kind / "whole", kind) for kind in Format}
    windows = Recording.windows
    monkeypatch.setattr(Recording, "windows", lambda self, rows=0: windows(self, 64))
    for kind, path in whole.items():
        parts = written(run, tmp_path / kind / "parts", kind)
        if kind is Format.PARQUET:
            assert_same_bits(columns_of(parquet.read_table(parts)), run)
            with parquet.ParquetFile(parts) as file:
                assert file.num_row_groups == 8
        else:
            assert_same_content(parts, path)


def assert_same_content(ours: Path, theirs: Path) -> None:
    """MAT files begin with their date, in the first of their 128 bytes."""
    skip = 128 if ours.suffix == ".mat" else 0
    assert ours.read_bytes()[skip:] == theirs.read_bytes()[skip:]
