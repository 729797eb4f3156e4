"""Columns from what is declared: one leg as ever, several with a prefix, own signals."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import ipc
from recorded_rows import cycle

from legbench.errors import ConfigError
from legbench.phases import ControllerDescription, PhaseInfo, Role
from legbench.recording.columns import ONE_LEG, PER_CYCLE, Layout
from legbench.recording.controller_table import controller_table
from legbench.recording.layout import TIME
from legbench.recording.reader import UnknownSignalError, load
from legbench.recording.rows import RowBlock, RowLayout
from legbench.recording.stream import BatchEncoder, encode_schema, schema_for
from legbench.recording.writer import RunWriter
from legbench.signals import SIGNALS, Command, Floats, Observation, Signal, Truth

TARGET = Signal("target", ("hip", "knee"), "rad", "set point of the law")
GAIN = Signal("gain", (), "N m/rad", "stiffness that the law asks for")
OWN = (TARGET, GAIN)
SAYING = {
    "controller": controller_table(
        "mine",
        ControllerDescription(
            phases=(PhaseInfo(code=0, name="swing", role=Role.ACTING),), signals=OWN
        ),
    )
}


def test_one_leg_has_no_prefix_and_every_signal_in_order() -> None:
    assert ONE_LEG.names == tuple(column for signal in SIGNALS for column in signal.columns)
    assert ONE_LEG.units["joint_vel_2"] == "rad/s"
    assert ONE_LEG.units[TIME] == "ns"


def test_own_signals_follow_those_of_every_run() -> None:
    layout = Layout(own=OWN)
    assert layout.names == (*ONE_LEG.names, "target_hip", "target_knee", "gain")
    assert layout.units["gain"] == "N m/rad"


@pytest.mark.parametrize("legs", [2, 4])
def test_several_legs_have_a_prefix_but_one_cycle(legs: int) -> None:
    layout = Layout(own=OWN, legs=legs)
    per_leg = [name for name in Layout(own=OWN).names if name not in PER_CYCLE]
    assert len(layout.names) == legs * len(per_leg) + len(PER_CYCLE)
    assert len(set(layout.names)) == len(layout.names)
    for leg in range(legs):
        assert {f"leg{leg + 1}_{name}" for name in per_leg} <= set(layout.names)
    assert set(layout.names) >= PER_CYCLE
    assert layout.columns_of(GAIN) == tuple((f"leg{leg + 1}_gain",) for leg in range(legs))
    assert layout.columns_of(SIGNALS[-1]) == (("late_us",),)


def test_two_legs_go_through_rows_and_stream() -> None:
    """Each column holds what its leg did, by hand and by name."""
    layout = Layout(own=OWN, legs=2)
    rng = np.random.default_rng(3)
    block, pairs = RowBlock(RowLayout(layout)), rng.normal(size=(12, 2, 2))
    truth = Truth(
        trunk_pos=pairs[6],
        trunk_vel=pairs[7],
        foot_pos=pairs[8],
        contact_force=pairs[9],
        energy=pairs[10],
        loop_gap=pairs[11],
        contact=np.array([True, False]),
    )
    seen = Observation(
        time=0.25,
        applied_pos=pairs[1],
        motor_pos=pairs[2],
        joint_pos=pairs[3],
        joint_vel=pairs[4],
        spring_torque=pairs[5],
        truth=truth,
    )
    own = rng.normal(size=(2, 3))
    block.put(Command(motor_pos=pairs[0], phase=np.array([3, 7]), signals=own), seen, 90.0, 2.0)
    columns = block.columns()
    schema = _schema(layout)
    messages = [encode_schema(schema), BatchEncoder(columns, schema).encode(columns)]
    (batch,) = ipc.open_stream(b"".join(map(bytes, messages)))
    found = {name: values[0] for name, values in batch.to_pydict().items()}
    assert (found[TIME], found["cycle_us"], found["late_us"]) == (250_000_000, 90.0, 2.0)
    for leg in range(2):
        at = f"leg{leg + 1}_"
        assert found[f"{at}command_pos_2"] == pairs[0, leg, 1]
        assert found[f"{at}joint_vel_1"] == pairs[4, leg, 0]
        assert found[f"{at}loop_gap_foot"] == pairs[11, leg, 1]
        assert found[f"{at}target_knee"] == own[leg, 1]
        assert found[f"{at}gain"] == own[leg, 2]
        assert (found[f"{at}phase"], found[f"{at}contact"]) == ((3, 1), (7, 0))[leg]


def _schema(layout: Layout) -> pa.Schema:
    """Schema as `schema_for` makes it, of a layout that no manifest asks for yet."""
    known = {field.name: field.type for field in schema_for({})}
    kinds = {True: pa.int8(), False: pa.float64()}
    fields = [pa.field(TIME, known[TIME], nullable=False)]
    return pa.schema([*fields, *(pa.field(c.name, kinds[c.small]) for c in layout.columns)])


def test_two_legs_refuse_the_arrays_of_one() -> None:
    command, seen, *_ = cycle(0)
    with pytest.raises(ConfigError, match=r"records 2 legs, shapes \(2, 2\), not \[\(2,\)\]"):
        RowBlock(RowLayout(Layout(legs=2))).put(command, seen, 0.0, 0.0)


def said(row: int, signals: Floats | None) -> tuple[Command, Observation, float, float]:
    """A cycle whose controller has something of its own to tell."""
    command, seen, cycle_us, late_us = cycle(row)
    told = Command(motor_pos=command.motor_pos, phase=command.phase, signals=signals)
    return told, seen, cycle_us, late_us


def test_own_signals_come_back_by_name_and_gaps_are_nan(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, SAYING) as writer:
        for row in range(120):
            signals = None if row == 7 else np.array([row, -row, 0.5 * row])
            writer.append(*said(row, signals))
    run, rows = load(writer.path), np.arange(120.0)
    rows[7] = np.nan
    # The manifest describes no leg, so the columns are known by their own names alone.
    np.testing.assert_array_equal(run["target_knee"], -rows)
    np.testing.assert_array_equal(run["gain"], 0.5 * rows)
    assert run.manifest["units"]["target_hip"] == "rad"


@pytest.mark.parametrize("shape", [(2,), (4,), (1, 3), ()])
def test_signals_of_another_number_than_declared_are_refused(
    tmp_path: Path, shape: tuple[int, ...]
) -> None:
    with RunWriter.create(tmp_path, SAYING) as writer:
        writer.append(*said(0, np.zeros(3)))
        with pytest.raises(ConfigError, match=r"own signals have shape .*; it declared \(3,\)"):
            writer.append(*said(1, np.zeros(shape)))
    assert len(load(writer.path).time) == 1


def test_signals_that_nobody_declared_are_refused(tmp_path: Path) -> None:
    with (
        RunWriter.create(tmp_path, {}) as writer,
        pytest.raises(ConfigError, match=r"have shape \(1,\); it declared \(0,\)"),
    ):
        writer.append(*said(0, np.zeros(1)))
    with pytest.raises(UnknownSignalError):
        load(writer.path)["gain"]


@pytest.mark.parametrize(
    ("signal", "message"),
    [
        (Signal("joint_pos", (), "rad", ""), "is called joint_pos, which every run has"),
        (Signal("joint", ("x", "x"), "m", ""), "is called joint_x"),
        (Signal("time", (), "s", ""), "is called time"),
        (Signal("motor", ("pos_1",), "rad", ""), "cannot name columns"),
        (Signal("a b", (), "-", ""), "cannot name columns"),
        (Signal("", (), "-", ""), "cannot name columns"),
    ],
)
def test_names_that_no_column_can_have_are_refused(signal: Signal, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        Layout(own=(signal,))


def test_a_robot_has_a_leg() -> None:
    with pytest.raises(ConfigError, match="at least one leg, not 0"):
        Layout(legs=0)
