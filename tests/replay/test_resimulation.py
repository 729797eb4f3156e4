"""Recorded commands and motors move the leg as it moved, to the bit or to the encoders' counts."""

import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from replay_runs import BUS

from legbench.drives.setup.bus_file import load_bus
from legbench.errors import ConfigError, PlantFault, RecordingError
from legbench.metrics import summarise
from legbench.recording.reader import Recording, load
from legbench.replay.comparison import Replayed, same_bits
from legbench.replay.moved import MotionSource, Moved
from legbench.replay.recorded import recorded_leg
from legbench.replay.resimulation import resimulate

COUNT = load_bus(BUS).nodes[0].link_units.resolution
"""One count of the link encoders [rad]."""


def worst(signals: Replayed, name: str) -> float:
    """Largest difference of a signal over both components."""
    found = [each.max for each in signals.deviations() if each.signal.startswith(name)]
    assert len(found) == 2
    return max(found)


@pytest.mark.parametrize("source", list(MotionSource))
@pytest.mark.parametrize("name", ["sim_jump", "analytic_run", "limited_run", "guest_plant"])
def test_what_was_simulated_repeats_itself_to_the_bit(
    name: str, source: MotionSource, request: pytest.FixtureRequest
) -> None:
    run: Recording = request.getfixturevalue(name)
    found = resimulate(run, recorded_leg(run), source)
    assert found.signals.identical
    assert (found.fault, found.notes) == (None, ())
    compared = {"joint_pos_1", "joint_vel_2"}
    compared |= {"contact", "energy_kinetic"} if run.has_truth else set()
    assert compared <= found.signals.units.keys()
    again = found.recording
    assert again.complete
    np.testing.assert_array_equal(again["command_pos"], run["command_pos"])
    np.testing.assert_array_equal(again["phase"], run["phase"])
    if run.description.jumps:
        assert summarise(again).rating_stance == summarise(run).rating_stance


def test_measured_motors_jump_as_the_leg_did(can_jump: Recording) -> None:
    found = resimulate(can_jump, recorded_leg(can_jump), MotionSource.MOTORS)
    assert worst(found.signals, "joint_pos") < 5e-4


def test_commands_to_drives_are_followed_a_cycle_late(can_swing: Recording) -> None:
    """A cycle is 0.03 rad in a step of these motors, and their loop is a few milliradians slow."""
    found = resimulate(can_swing, recorded_leg(can_swing), MotionSource.COMMANDS)
    assert worst(found.signals, "motor_pos") < 5e-3
    assert worst(found.signals, "joint_pos") < 1e-3


def test_measured_motors_move_a_pinned_leg_to_within_a_count(can_swing: Recording) -> None:
    """A missing answer is left out and told.

    An answer is taken away, as a lost frame takes it: the row repeats the one before."""
    columns = {name: values.copy() for name, values in can_swing.columns.items()}
    row = int(np.argmax(np.abs(columns["joint_vel_2"])))
    for name in ("motor_pos_2", "joint_pos_2", "joint_vel_2"):
        columns[name][row] = columns[name][row - 1]
    lost = replace(can_swing, columns=columns)
    stale = Moved(lost, MotionSource.MOTORS).stale
    before = Moved(can_swing, MotionSource.MOTORS).stale
    assert stale[row, 1]
    assert stale.sum() == before.sum() + (not before[row, 1])
    found = resimulate(lost, recorded_leg(lost), MotionSource.MOTORS)
    assert found.fault is None
    assert found.recording.description.plant == "sim"
    assert worst(found.signals, "motor_pos") < 1e-12
    assert worst(found.signals, "joint_pos") < 1.0 * COUNT
    assert f"and {int(stale[:, 1].sum())} rows, which are left out" in found.notes[0]
    assert math.isnan(found.signals.replayed["joint_pos_2"][row])


def test_a_run_that_begins_in_motion_says_so(can_swing: Recording) -> None:
    fast = int(np.argmax(np.abs(can_swing["joint_vel"][:, 0])))
    columns = {name: values[fast : fast + 20] for name, values in can_swing.columns.items()}
    part = replace(can_swing, time=can_swing.time[fast : fast + 20], columns=columns)
    found = resimulate(part, recorded_leg(part), MotionSource.MOTORS)
    assert any("begins in motion" in note for note in found.notes)


def test_another_leg_moves_otherwise(sim_jump: Recording, models: object) -> None:
    leg = recorded_leg(sim_jump, {"design": f"{models}/table2.toml"})
    found = resimulate(sim_jump, leg, MotionSource.COMMANDS)
    assert found.recording.description.design == leg.design
    assert found.recording.description.design != sim_jump.description.design
    first = found.signals.first()
    assert first is not None
    assert first.cycle == 0
    assert worst(found.signals, "motor_pos") == 0.0


def test_another_plant_and_another_setting_move_otherwise(sim_jump: Recording) -> None:
    leg = recorded_leg(sim_jump, {"imperfections.stiffness_error": [0.01, 0.0]}, plant="analytic")
    found = resimulate(sim_jump, leg, MotionSource.COMMANDS)
    assert found.recording.description.plant == "analytic"
    assert found.recording.description.imperfections.stiffness_error == (0.01, 0.0)
    assert 1e-4 < worst(found.signals, "joint_pos") < 1.0


def test_a_plant_that_cannot_go_on_ends_it_there(sim_jump: Recording) -> None:
    columns = {name: values.copy() for name, values in sim_jump.columns.items()}
    for name, motor in (("command_pos_1", 1.2), ("command_pos_2", -1.2)):
        columns[name][300:] = motor
    folded = replace(sim_jump, columns=columns)
    found = resimulate(folded, recorded_leg(folded), MotionSource.COMMANDS)
    assert found.fault is not None
    assert "no longer on the branch" in found.fault
    assert 300 < len(found.recording.time) < len(sim_jump.time)
    assert len(found.signals.time) == len(found.recording.time)
    assert found.recording.description.status == "fault"


def test_what_cannot_be_resimulated_is_refused(can_swing: Recording, sim_jump: Recording) -> None:
    manifest = {**can_swing.manifest, "plant": {"kind": "can", "bus": {"read_only": True}}}
    read_only = replace(
        can_swing,
        manifest=manifest,
        described=replace(can_swing.description, looks_only=True),
    )
    with pytest.raises(ConfigError, match="was read only: its commands moved nothing"):
        resimulate(read_only, recorded_leg(read_only), MotionSource.COMMANDS)
    with pytest.raises(ConfigError, match="moves no drives"):
        resimulate(sim_jump, recorded_leg(sim_jump, plant="can"), MotionSource.COMMANDS)
    with pytest.raises(ConfigError, match="needs plant 'mine'"):
        recorded_leg(sim_jump, plant="mine")
    columns = {**can_swing.columns, "motor_pos_1": np.full(len(can_swing.time), np.nan)}
    with pytest.raises(RecordingError, match="does not know its motors"):
        Moved(replace(can_swing, columns=columns), MotionSource.MOTORS)


def test_bits_are_compared_and_not_values() -> None:
    ours = np.array([0.0, 0.0, np.nan, np.inf, 1.0])
    theirs = np.array([0.0, -0.0, -np.nan, np.inf, np.nextafter(1.0, 2.0)])
    assert same_bits(ours, theirs).tolist() == [True, False, True, True, False]
    assert same_bits(np.array([1, 2], np.int8), np.array([1, 3])).tolist() == [True, False]


def test_the_error_of_a_signal_is_that_of_its_definition() -> None:
    recorded = np.array([1.0, 2.0, np.nan, 4.0, np.nan])
    replayed = np.array([1.0, 2.5, 3.0, 3.0, np.nan])
    both = Replayed(
        time=np.arange(5, dtype=np.float64) * 0.5,
        recorded={"x": recorded},
        replayed={"x": replayed},
        units={"x": "rad"},
    )
    (all_of_them,) = both.deviations()
    assert all_of_them.rms == pytest.approx(math.sqrt((0.25 + 1.0) / 3))
    assert (all_of_them.max, all_of_them.max_time) == (1.0, 1.5)
    assert (all_of_them.rows, all_of_them.first_cycle, all_of_them.first_time) == (3, 1, 0.5)
    # What only one of both knows is beyond any bound.
    (large,) = both.deviations(0.7)
    assert (large.rows, large.first_cycle) == (2, 2)


def test_a_plant_that_fails_before_its_first_row_says_why(
    guest_plant: Recording, tmp_path: Path
) -> None:
    shutil.copytree(guest_plant.path, tmp_path / "run")
    copy = tmp_path / "run" / "plant_still.py"
    copy.write_text(
        copy.read_text().replace("self.cycle, self", "self.cycle = 1 / 0\n        self.cycle, self")
    )
    run = load(tmp_path / "run")
    with pytest.raises(PlantFault, match="the plant failed in a resimulation after t = 0") as told:
        resimulate(run, recorded_leg(run), MotionSource.COMMANDS)
    assert "1 / 0" in str(told.value)
