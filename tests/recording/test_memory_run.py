"""Runs in memory against the same rows that went through files."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recorded_rows import cycle

from legbench.errors import ConfigError
from legbench.phases import ControllerDescription
from legbench.recording.controller_table import controller_table
from legbench.recording.memory import MemoryRun
from legbench.recording.reader import Recording, load
from legbench.recording.writer import RunWriter
from legbench.signals import Command, Signal

OWN = (Signal("gain", (), "N m/rad", ""), Signal("aim", ("hip", "knee"), "rad", ""))
GIVEN: dict[str, Any] = {
    "controller": controller_table("mine", ControllerDescription(phases=(), signals=OWN)),
    "seed": 3,
}


def filled(run: MemoryRun | RunWriter, count: int, *, truth: bool, start: int = 0) -> None:
    for row in range(start, start + count):
        command, seen, cycle_us, late_us = cycle(row, truth=truth)
        told = np.array([row, 0.5 * row, -row]) if row % 7 else None
        said = Command(motor_pos=command.motor_pos, phase=command.phase, signals=told)
        run.append(said, seen, cycle_us, late_us)
        assert run.rows == row - start + 1
    run.event(0.25, "touchdown", force=np.array([1.0, np.nan]), foot=np.float64(0.5))
    run.event(0.75, "liftoff")


def both(folder: Path, count: int, *, truth: bool = True, start: int = 0) -> list[Recording]:
    memory, writer = MemoryRun(GIVEN, name="a b"), RunWriter.create(folder, GIVEN, name="a b")
    for run in (memory, writer):
        filled(run, count, truth=truth, start=start)
        run.close("fault", "bus_off")
    return [memory.recording(), load(writer.path)]


@pytest.mark.parametrize("truth", [False, True])
@pytest.mark.parametrize("count", [0, 1, 49, 50, 51, 100, 237])
def test_a_run_in_memory_is_the_one_in_files(tmp_path: Path, count: int, truth: bool) -> None:
    memory, filed = both(tmp_path, count, truth=truth, start=7_300)
    assert list(memory.columns) == list(filed.columns)
    for name, column in filed.columns.items():
        mine = memory.columns[name]
        assert mine.dtype == column.dtype, name
        assert mine.tobytes() == column.tobytes(), name
        assert not mine.flags.writeable, name
    np.testing.assert_array_equal(memory.time, filed.time)
    assert memory.events == filed.events
    assert memory.has_truth == filed.has_truth == (truth and count > 0)
    assert memory.signals == filed.signals
    own = ("id", "created", "provenance")
    kept, written = ({**run.manifest} for run in (memory, filed))
    assert kept.pop("duration") == pytest.approx(written.pop("duration"), abs=1e-9)
    assert kept["provenance"] == written["provenance"]
    assert {k: v for k, v in kept.items() if k not in own} == (
        {k: v for k, v in written.items() if k not in own}
    )
    assert (kept["status"], kept["cause"], kept["rows"]) == ("fault", "bus_off", count)
    assert memory.path.name == memory.manifest["id"]
    assert memory.path.name.endswith("_a-b")


def test_rows_can_be_read_while_a_run_goes_on_and_are_not_taken_twice() -> None:
    run = MemoryRun(GIVEN)
    for row in range(130):
        run.append(*cycle(row))
        if row in (3, 70, 71):
            found = run.recording()
            assert len(found.time) == run.rows == row + 1
            assert found.manifest["status"] == "running"
    assert run.recording()["t"].tolist() == [row / 1000 for row in range(130)]


def test_a_run_in_memory_ends_complete_unless_it_is_told_otherwise() -> None:
    run = MemoryRun({})
    run.append(*cycle(0))
    run.close()
    found = run.recording()
    assert found.complete
    assert (found.manifest["cause"], found.manifest["duration"]) == (None, 0.0)


def test_a_run_in_memory_refuses_what_a_run_in_files_does() -> None:
    with pytest.raises(ConfigError, match="manifest's rows are filled in"):
        MemoryRun({"rows": 3})
    run = MemoryRun({})
    command, seen, cycle_us, late_us = cycle(0)
    batch = Command(motor_pos=np.zeros((3, 2)), phase=command.phase)
    with pytest.raises(ConfigError, match="a run records one leg"):
        run.append(batch, seen, cycle_us, late_us)
    assert run.rows == 0
