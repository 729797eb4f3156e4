"""Rows in which a drive had not answered, and what is put in their place."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from legbench.recording.answers import between_answers, unanswered

SIGNALS = ("joint_vel", "joint_pos", "motor_pos")


class Rows:
    """A recording of two drives, every value of which differs from row to row."""

    def __init__(self, plant: str = "can", count: int = 6) -> None:
        self.description = SimpleNamespace(plant=plant)
        rows = 0.25 * np.arange(1.0, count + 1.0)
        self.columns = {name: np.stack([rows, -rows], axis=-1) for name in SIGNALS}

    def __getitem__(self, name: str) -> Any:
        return self.columns[name]

    def repeat(self, row: int, axis: int, *names: str) -> None:
        """Let a row show what the one before it shows."""
        for name in names:
            self.columns[name][row, axis] = self.columns[name][row - 1, axis]

    def unanswered(self) -> list[list[int]]:
        """Rows of each drive."""
        return [np.flatnonzero(axis).tolist() for axis in unanswered(cast(Any, self)).T]


@pytest.mark.parametrize("axis", [0, 1])
def test_a_row_that_repeats_all_three_readings_of_a_moving_drive_is_no_answer(axis: int) -> None:
    rows = Rows()
    assert rows.unanswered() == [[], []]
    for row in (1, 3, 4):
        rows.repeat(row, axis, *SIGNALS)
    found = [[], []]
    found[axis] = [1, 3, 4]
    assert rows.unanswered() == found
    # A simulated leg always answers, whatever it shows.
    rows.description.plant = "sim"
    assert rows.unanswered() == [[], []]


@pytest.mark.parametrize("axis", [0, 1])
def test_a_row_with_one_new_reading_or_of_a_link_that_stands_is_an_answer(axis: int) -> None:
    for fresh in SIGNALS:
        rows = Rows()
        rows.repeat(2, axis, *(name for name in SIGNALS if name != fresh))
        assert rows.unanswered() == [[], []]
    rows = Rows()
    rows.columns["joint_vel"][1:3, axis] = 0.0
    rows.repeat(2, axis, "joint_pos", "motor_pos")
    assert rows.unanswered() == [[], []]


def test_positions_that_were_not_told_are_on_a_line_between_their_neighbours() -> None:
    values = np.array([[0.0, 1.0], [0.0, 2.0], [0.0, 2.0], [3.0, 8.0], [3.0, 9.0]])
    missing = np.array([[0, 0], [1, 0], [1, 1], [0, 0], [1, 0]], dtype=np.bool_)
    kept = values.copy()
    told = between_answers(values, missing)
    assert told.tolist() == [[0.0, 1.0], [1.0, 2.0], [2.0, 5.0], [3.0, 8.0], [3.0, 9.0]]
    assert values.tolist() == kept.tolist()
    assert between_answers(values, np.zeros_like(missing)).tolist() == kept.tolist()
