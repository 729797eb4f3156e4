"""What the limits changed of the commands, from rows whose changes are known."""

from typing import Any

import numpy as np
import pytest
from metrics_runs import clock, manifest, recording

from legbench.metrics.limited import limited_commands
from legbench.recording.reader import Recording

READ_ONLY: dict[str, Any] = {"bus": {"read_only": True}}


def run_of(rows: int, changed: dict[int, tuple[float, float]], **entries: Any) -> Recording:
    """A run in which the wish of some rows was changed by so much before it was applied."""
    wishes = np.random.default_rng(7).normal(size=(rows, 2))
    # A wish is applied in the next row; the first row shows what was applied before the run.
    applied = np.concatenate([[[5.0, -5.0]], wishes[:-1]])[:rows]
    for row, change in changed.items():
        applied[row + 1] -= change
    tables = manifest(**entries)
    return recording(clock(rows), tables, command_pos=wishes, applied_pos=applied)


@pytest.mark.parametrize("rows", [0, 1, 2, 9])
def test_a_run_whose_wishes_were_all_applied_is_not_limited(rows: int) -> None:
    assert limited_commands(run_of(rows, {})) == {"limited_cycles": 0, "limited_max": [0.0, 0.0]}


def test_each_cycle_counts_once_and_each_motor_has_its_largest_change() -> None:
    changed = {0: (0.25, 0.0), 3: (-0.5, 0.125), 4: (0.0, -0.0625), 7: (1e-9, 0.0)}
    seen = limited_commands(run_of(9, changed))
    assert seen["limited_cycles"] == 4
    assert seen["limited_max"] == pytest.approx([0.5, 0.125])


def test_two_rows_show_one_wish() -> None:
    seen = limited_commands(run_of(2, {0: (0.5, -1.5)}))
    assert seen["limited_cycles"] == 1
    assert seen["limited_max"] == pytest.approx([0.5, 1.5])


def test_nothing_is_changed_in_a_run_that_only_looks() -> None:
    run = run_of(9, {2: (1.0, 1.0)}, **READ_ONLY)
    assert run.description.looks_only
    assert limited_commands(run) == {"limited_cycles": 0, "limited_max": [0.0, 0.0]}
