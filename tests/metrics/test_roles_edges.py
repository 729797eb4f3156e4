"""Codes at the ends of their range, and how far a late phase reaches back."""

import numpy as np
import pytest
from metrics_runs import clock, guest

from legbench.metrics.analysis import Analysis
from legbench.metrics.roles import FLIGHT, STANCE, UNKNOWN, first_action, foot_states, resting
from legbench.phases import LARGEST_CODE, PhaseInfo, Role

FALL = PhaseInfo(code=0, name="fall", role=Role.FLIGHT)
STAND = PhaseInfo(code=LARGEST_CODE, name="stand", role=Role.STANCE, late=0.02)
WAIT = PhaseInfo(code=LARGEST_CODE, name="wait", role=Role.REST)


def test_the_smallest_and_the_largest_code_are_phases_and_their_neighbours_are_not() -> None:
    phase = np.array([-1, 0, 1, LARGEST_CODE - 1, LARGEST_CODE, LARGEST_CODE + 1, -129, 10_000])
    on_time = PhaseInfo(code=LARGEST_CODE, name="stand", role=Role.STANCE)
    states = foot_states(phase, clock(8), (FALL, on_time))
    wanted = [UNKNOWN, FLIGHT, UNKNOWN, UNKNOWN, STANCE, UNKNOWN, UNKNOWN, UNKNOWN]
    assert states.tolist() == wanted
    rests = resting(phase, (WAIT,))
    assert np.flatnonzero(rests).tolist() == [4]
    rests = resting(phase, (PhaseInfo(code=0, name="rest", role=Role.REST), WAIT))
    assert np.flatnonzero(rests).tolist() == [1, 4]


@pytest.mark.parametrize("rows", [5, 19, 20, 21, 60])
def test_a_late_phase_began_its_lateness_ago_or_with_the_phase_before_it(rows: int) -> None:
    """A clock of quarters of a second, so that the instant is a row's to the bit."""
    stand = PhaseInfo(code=2, name="stand", role=Role.STANCE, late=5.0)
    phase = np.repeat([1, 0, 2], [7, rows, 9])
    time = 0.25 * np.arange(len(phase), dtype=np.float64)
    states = foot_states(phase, time, (FALL, stand))
    began = max(7, 7 + rows - 20)
    assert np.flatnonzero(states == STANCE).tolist() == list(range(began, len(phase)))
    assert np.flatnonzero(states == UNKNOWN).tolist() == list(range(7))


def test_a_phase_that_a_run_begins_with_is_told_by_nobody() -> None:
    phase = np.repeat([LARGEST_CODE, 0, LARGEST_CODE], [30, 50, 30])
    states = foot_states(phase, clock(110), (FALL, STAND))
    assert np.flatnonzero(states == FLIGHT).tolist() == list(range(30, 60))


def test_a_phase_of_one_row_is_told_and_every_late_phase_is() -> None:
    phases = (FALL, STAND, PhaseInfo(code=3, name="rise", role=Role.FLIGHT, late=0.005))
    phase = np.repeat([0, LARGEST_CODE, 3, LARGEST_CODE, 0], [40, 1, 30, 30, 9])
    states = foot_states(phase, clock(110), phases)
    # The second stance reaches 20 ms back into the rise, the rise all of one row back.
    wanted = [FLIGHT] * 20 + [STANCE] * 20 + [FLIGHT] * 11 + [STANCE] * 50 + [FLIGHT] * 9
    assert states.tolist() == wanted


def acting(commands: dict[int, tuple[float, float]], phase: int = LARGEST_CODE) -> int:
    """First action of thirty rows that rest, with a command that is changed in some of them."""
    command = np.tile([-0.7, 0.7], (30, 1))
    for row, value in commands.items():
        command[row] = value
    run = guest(np.full(30, phase), (WAIT,), signals={"command_pos": command})
    return first_action(run)


@pytest.mark.parametrize("value", [(-0.6, 0.7), (-0.7, 0.6)])
def test_a_rest_ends_where_either_command_moves(value: tuple[float, float]) -> None:
    assert acting({12: value, 20: (0.0, 0.0)}) == 12
    assert acting({29: value}) == 29
    assert acting({}) == 30
    assert acting({12: value}, phase=3) == 0


def test_a_run_without_rows_has_no_action() -> None:
    run = guest(np.zeros(0, dtype=np.int64), (WAIT,))
    assert first_action(run) == 0
    assert len(Analysis(run).states) == 0
