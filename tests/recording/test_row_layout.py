"""Places of every number of a row, for each number of legs and of own signals."""

from dataclasses import replace

import numpy as np
import pytest

from legbench.errors import ConfigError
from legbench.recording.columns import Layout
from legbench.recording.rows import BATCH_ROWS, LegRows, RowBlock, RowLayout
from legbench.signals import Command, Observation, Signal, Truth

Cycle = tuple[Command, Observation]
OWN = (Signal("gain", (), "-", ""), Signal("aim", ("x", "y", "z"), "m", ""))


@pytest.mark.parametrize("own", [(), OWN])
@pytest.mark.parametrize("legs", [1, 2, 4])
def test_every_column_has_one_place_and_no_place_is_left(
    legs: int, own: tuple[Signal, ...]
) -> None:
    layout = Layout(own=own, legs=legs)
    rows = RowLayout(layout)
    assert rows.size == 1 + len(layout.names)
    assert sorted(rows.disk_order) == list(range(rows.size))
    assert rows.shape == ((2,) if legs == 1 else (legs, 2))
    assert rows.own == (4 if own else 0)
    assert RowBlock(rows).values.shape == (BATCH_ROWS, rows.size)


@pytest.mark.parametrize("legs", [1, 3])
def test_what_is_not_known_of_a_row_is_no_number(legs: int) -> None:
    """A real leg that tells nothing of its own: exactly the columns of truth and its own."""
    layout = Layout(own=OWN, legs=legs)
    block = RowBlock(RowLayout(layout))
    pair = np.ones((2,) if legs == 1 else (legs, 2))
    seen = Observation(
        time=0.5,
        applied_pos=pair,
        motor_pos=pair,
        joint_pos=pair,
        joint_vel=pair,
        spring_torque=pair,
        truth=None,
    )
    phase = np.full(() if legs == 1 else legs, 4)
    for count in (1, 2):
        block.put(Command(motor_pos=pair, phase=phase), seen, 90.0, 2.0)
        assert block.count == count
    columns = dict(zip(("t", *layout.names), block.columns(), strict=True))
    unknown = {name for name, values in columns.items() if np.isnan(values).any()}
    hidden = ("trunk", "foot", "contact", "energy", "loop_gap", "gain", "aim")
    wanted = {name for name in columns if any(word in name for word in hidden)}
    assert unknown == wanted
    assert all(np.isnan(columns[name]).all() for name in unknown)
    for name in columns.keys() - unknown:
        value = {"t": 0.5, "cycle_us": 90.0, "late_us": 2.0}.get(name, 1.0)
        np.testing.assert_array_equal(columns[name], 4.0 if "phase" in name else value)


def test_each_own_signal_is_looked_at_not_the_first_alone() -> None:
    for bad in (Signal("a-b", (), "-", ""), Signal("ok", ("x", "y z"), "-", "")):
        with pytest.raises(ConfigError, match="cannot name columns"):
            Layout(own=(OWN[0], bad))
    with pytest.raises(ConfigError, match="is called gain, which every run has or another"):
        Layout(own=(OWN[0], OWN[1], OWN[0]))


def seen_by(pairs: np.ndarray, row: int, legs: int | slice, *, signals: bool) -> Cycle:
    """A cycle of one of three legs, or of all of them, from pairs (12, legs, 2)."""
    contact, phase = np.arange(3) % 2 == 0, np.arange(3) + 3
    own = np.arange(12.0).reshape(3, 4) + row
    part = pairs[:, legs]
    command = Command(motor_pos=part[0], phase=phase[legs], signals=own[legs] if signals else None)
    truth = Truth(
        trunk_pos=part[6],
        trunk_vel=part[7],
        foot_pos=part[8],
        contact_force=part[9],
        energy=part[10],
        loop_gap=part[11],
        contact=contact[legs],
    )
    seen = Observation(
        time=0.25 * row,
        applied_pos=part[1],
        motor_pos=part[2],
        joint_pos=part[3],
        joint_vel=part[4],
        spring_torque=part[5],
        truth=truth,
    )
    return command, seen


@pytest.mark.parametrize("own", [(), OWN])
def test_rows_of_many_legs_are_those_of_each_leg_alone(own: tuple[Signal, ...]) -> None:
    layout, every = RowLayout(Layout(own=own)), slice(None)
    together, alone = LegRows(3, layout), [RowBlock(layout) for _ in range(3)]
    pairs = np.random.default_rng(5).normal(size=(4, 12, 3, 2))
    for row in range(4):
        signals = bool(own) and row % 2 == 1
        together.put(*seen_by(pairs[row], row, every, signals=signals), 80.0 + row)
        for leg, block in enumerate(alone):
            block.put(*seen_by(pairs[row], row, leg, signals=signals), 80.0 + row, 0.0)
    assert together.count == 4
    for rows in (4, 2):
        for leg, block in enumerate(alone):
            np.testing.assert_array_equal(together.columns(leg, rows), block.columns()[:, :rows])
    command, seen = seen_by(pairs[0], 4, every, signals=False)
    with pytest.raises(ConfigError, match="these lack its truth"):
        together.put(command, replace(seen, truth=None), 80.0)
    assert together.count == 4
