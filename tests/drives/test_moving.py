"""The move to a posture, command by command, before a guard that is set by hand."""

from collections.abc import Callable, Sequence
from typing import Any, cast

import pytest

from legbench.drives.master.move import missed, move

Limit = Callable[[tuple[float, ...]], tuple[float, ...]]


class Drives:
    """A guard and the drives behind it: every command and every look in its order."""

    def __init__(self, applied: tuple[float, ...], limit: Limit = lambda wish: wish) -> None:
        self.applied, self._limit = applied, limit
        self.log: list[Any] = []

    def command(self, motor_pos: Sequence[float]) -> tuple[float, ...]:
        self.log.append(tuple(motor_pos))
        self.applied = self._limit(tuple(motor_pos))
        return self.applied

    def exchange(self) -> str:
        self.log.append("look")
        return f"sample {len(self.log)}"

    def reachable(self, wanted: Sequence[float]) -> tuple[float, ...]:
        return self._limit(tuple(wanted))


def moved(drives: Drives, wanted: tuple[float, ...], step: float) -> str:
    return cast(Any, move)(drives, drives, wanted, step)


def test_each_motor_goes_by_one_step_a_cycle_and_is_held_for_two() -> None:
    drives = Drives((0.0, 1.0))
    found = moved(drives, (0.5, 0.25), 0.25)
    end = (0.5, 0.25)
    # A command, then a look, every time; the last two hold the posture.
    commands = [(0.25, 0.75), (0.5, 0.5), end, end, end]
    assert drives.log == [entry for command in commands for entry in (command, "look")]
    assert found == "sample 10"


def test_a_last_step_of_just_the_allowed_length_ends_at_the_posture_itself() -> None:
    last, wanted = 0.04, 0.11
    step = wanted - last
    assert last + step != wanted
    drives = Drives((last,))
    moved(drives, (wanted,), step)
    assert drives.log[::2] == [(wanted,)] * 3


def test_who_stands_there_already_is_held_for_two_cycles() -> None:
    drives = Drives((0.5, 0.25))
    assert moved(drives, (0.5, 0.25), 0.1) == "sample 4"
    assert drives.log == [(0.5, 0.25), "look"] * 2


def test_a_move_ends_where_a_limit_lets_nothing_through_any_more() -> None:
    drives = Drives((0.0, 0.0), lambda wish: (min(wish[0], 0.5), wish[1]))
    moved(drives, (1.0, 0.25), 0.25)
    assert drives.log[::2] == [(0.25, 0.25), (0.5, 0.25), (0.75, 0.25), *[(0.5, 0.25)] * 2]
    guard = cast(Any, drives)
    assert missed(guard, (1.0, 0.25)) is None


def test_a_posture_has_as_many_positions_as_there_are_motors() -> None:
    with pytest.raises(ValueError, match="zip"):
        moved(Drives((0.0, 0.0)), (1.0,), 0.25)


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_either_motor_that_ends_a_nanoradian_short_has_missed(place: int, side: float) -> None:
    for gap, short in ((0.0, False), (0.999e-9, False), (1e-9, True), (1.5e-9, True)):
        applied = [0.0, 0.0]
        applied[place] = side * gap
        fault = missed(cast(Any, Drives(tuple(applied))), (0.0, 0.0))
        assert (fault is not None) is short
        if fault is not None:
            assert fault.cause == "start posture"
            assert str(fault).startswith(f"the motors were led to {tuple(applied)} rad, not to")
