from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pyarrow import parquet
from recorded_rows import append_rows, cycle

from legbench.recording.columns import ONE_LEG
from legbench.recording.reader import load
from legbench.recording.rows import ONE_LEG_ROWS
from legbench.recording.writer import RunWriter
from legbench.signals import SIGNALS, Command, Observation, Truth

NUMBERS = st.floats(width=64, allow_nan=True, allow_infinity=True, allow_subnormal=True)


def bits(values: np.ndarray) -> list[int]:
    return np.ascontiguousarray(values, dtype=np.float64).view(np.int64).ravel().tolist()


def test_every_signal_has_a_place_in_a_row() -> None:
    order = ONE_LEG_ROWS.disk_order
    assert len(order) == 1 + len(ONE_LEG.names)
    assert sorted(order) == list(range(ONE_LEG_ROWS.size))


@pytest.mark.parametrize("count", [1, 49, 50, 51, 237])
def test_rows_come_back(tmp_path: Path, count: int) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        append_rows(writer, count)
    run = load(writer.path)
    cycles = [cycle(row) for row in range(count)]
    expected = {
        "t": [seen.time for _, seen, _, _ in cycles],
        "command_pos": [command.motor_pos for command, _, _, _ in cycles],
        "phase": [int(command.phase) for command, _, _, _ in cycles],
        "cycle_us": [cost for _, _, cost, _ in cycles],
        "late_us": [late for _, _, _, late in cycles],
    }
    for name in ("applied_pos", "motor_pos", "joint_pos", "joint_vel", "spring_torque"):
        expected[name] = [getattr(seen, name) for _, seen, _, _ in cycles]
    for name in ("trunk_pos", "trunk_vel", "foot_pos", "contact_force", "energy", "loop_gap"):
        expected[name] = [getattr(seen.truth, name) for _, seen, _, _ in cycles]
    expected["contact"] = [row % 3 == 0 for row in range(count)]
    assert set(expected) == {"t", *(signal.name for signal in SIGNALS)} == set(run.signals)
    for name, values in expected.items():
        np.testing.assert_array_equal(run[name], np.array(values), err_msg=name, strict=True)
    assert run.complete
    assert run.has_truth
    assert run.torn is None
    assert run.manifest["rows"] == count
    assert run.manifest["duration"] == pytest.approx((count - 1) * 1e-3)


@settings(
    max_examples=20,
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(numbers=st.lists(NUMBERS, min_size=26, max_size=26))
def test_every_float_survives_to_the_bit(tmp_path: Path, numbers: list[float]) -> None:
    pairs = np.array(numbers[:24]).reshape(12, 2)
    names = ("applied_pos", "motor_pos", "joint_pos", "joint_vel", "spring_torque")
    truths = ("trunk_pos", "trunk_vel", "foot_pos", "contact_force", "energy", "loop_gap")
    truth = Truth(**dict(zip(truths, pairs[6:], strict=True)), contact=np.array(True))
    seen = Observation(time=0.25, truth=truth, **dict(zip(names, pairs[1:6], strict=True)))
    with RunWriter.create(tmp_path, {}) as writer:
        writer.append(Command(motor_pos=pairs[0], phase=np.array(8)), seen, *numbers[24:])
    run = load(writer.path)
    for name, pair in zip(("command_pos", *names, *truths), pairs, strict=True):
        assert bits(run[name]) == bits(pair), name
    assert bits(np.array([run["cycle_us"][0], run["late_us"][0]])) == bits(np.array(numbers[24:]))


def test_without_truth_it_is_nan_and_contact_is_unknown(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        append_rows(writer, 60, truth=False)
    run = load(writer.path)
    assert not run.has_truth
    assert np.isnan(run["energy"]).all()
    assert run["contact"].tolist() == [False] * 60
    assert run.columns["contact"].tolist() == [-1] * 60
    stored = parquet.read_table(str(writer.path / "samples.parquet"))
    assert stored["contact"].null_count == 60
    assert stored["phase"].null_count == 0


def test_arrays_are_copied_when_appended(tmp_path: Path) -> None:
    command, seen, cost, late = cycle(7)
    with RunWriter.create(tmp_path, {}) as writer:
        writer.append(command, seen, cost, late)
        seen.joint_pos[:] = 99.0
    assert load(writer.path)["joint_pos"].tolist() == [cycle(7)[1].joint_pos.tolist()]


def test_events_come_back_in_order(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        writer.event(0.1, "touchdown", foot=np.float64(0.02), force=np.array([1.0, 2.0]))
        writer.event(
            0.2, "fault", reading=float("nan"), name_of="drive 1 \N{GREEK SMALL LETTER MU}"
        )
    assert load(writer.path).events == (
        {"time": 0.1, "name": "touchdown", "foot": 0.02, "force": [1.0, 2.0]},
        {"time": 0.2, "name": "fault", "reading": "nan", "name_of": "drive 1 \u03bc"},
    )


def test_a_run_with_no_rows_is_empty_arrays(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {}) as writer:
        pass
    run = load(writer.path)
    assert run.complete
    assert not run.has_truth
    assert run["joint_pos"].shape == (0, 2)
    assert run["t"].shape == run["contact"].shape == (0,)


def test_archive_has_a_flat_time_and_the_final_manifest(tmp_path: Path) -> None:
    start = datetime(2030, 1, 2, 3, 4, 5, tzinfo=UTC)
    with RunWriter.create(tmp_path, {"seed": 3}, name="bang bang/sim", created=start) as writer:
        append_rows(writer, 120)
    assert writer.path.name == "20300102-030405_bang-bang-sim"
    assert {path.name for path in writer.path.iterdir()} == {
        "run.json",
        "samples.parquet",
        "events.jsonl",
    }
    (writer.path / "run.json").unlink()
    run = load(writer.path)
    assert run.columns["t_ns"].dtype == np.int64
    assert run.columns["t_ns"].tolist() == [row * 1_000_000 for row in range(120)]
    assert run.manifest["seed"] == 3
    assert run.manifest["status"] == "complete"
    assert run.manifest["rows"] == 120
    assert run.manifest["created"] == "2030-01-02T03:04:05+00:00"
