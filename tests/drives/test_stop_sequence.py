"""The stop sequence word by word and cycle by cycle, with two drives that show what a test says."""

import itertools
from collections.abc import Callable, Sequence
from typing import Any, cast

import pytest
from drives_rig import node

from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.stop import StopSequence
from legbench.drives.master.stop_report import StopReport
from legbench.drives.protocol.cia402 import Goal

ENABLED, BRAKING, OFF, FAULT, UNKNOWN = 0x1237, 0x0217, 0x0250, 0x0218, 0x0201
QUICK, DISABLE = 0x02, 0x00
Script = Callable[[int], int | None]
"""Number of a tick, from 0 -> statusword; None for no answer."""


class ScriptedCycle:
    """Two drives on a bus; what they show follows a script, what they are told is kept."""

    def __init__(self, *scripts: Script) -> None:
        self.axes = tuple(AxisLink(node(place)) for place in (0, 1))
        self.scripts = scripts
        self.words: list[tuple[int, ...]] = []
        self.targets: list[tuple[int, ...]] = []
        self.stopping_at_first_word = False
        self.stopping = self.bus_off = False
        self.ticks = self.sends = 0
        self.fails_tick: set[int] = set()
        self.fails_send: set[int] = set()
        for axis in self.axes:
            axis.machine.seek(Goal.ENABLED)
            axis.statusword, axis.fresh = ENABLED, True
            axis.machine.step(ENABLED)

    def send(self, words: Sequence[int]) -> bool:
        self.sends += 1
        if self.sends - 1 in self.fails_send:
            raise ValueError("no such frame")
        self.stopping_at_first_word |= self.stopping and not self.words
        self.words.append(tuple(words))
        self.targets.append(tuple(axis.target_counts for axis in self.axes))
        return True

    def tick(self) -> None:
        self.ticks += 1
        if self.ticks - 1 in self.fails_tick:
            raise KeyboardInterrupt
        for axis, script in zip(self.axes, self.scripts, strict=True):
            shown = script(self.ticks - 1)
            axis.fresh = shown is not None
            axis.statusword = axis.statusword if shown is None else shown

    def stop(self) -> tuple[StopReport, list[str]]:
        """Stop, and what was held on the way."""
        held: list[str] = []
        sequence = StopSequence(cast(Any, self), lambda error: held.append(type(error).__name__))
        return sequence.run(), held

    def told(self, place: int) -> list[tuple[int, int]]:
        """Controlwords of a drive and for how many cycles each stood."""
        words = [pair[place] for pair in self.words]
        return [(word, len(list(group))) for word, group in itertools.groupby(words)]


def until(ticks: int, before: int | None, after: int | None) -> Script:
    """Show one thing in so many ticks, then another."""
    return lambda tick: before if tick < ticks else after


def always(shown: int | None) -> Script:
    return lambda tick: shown


def pair(place: int, odd: Script, usual: Script) -> tuple[Script, Script]:
    return (odd, usual) if place == 0 else (usual, odd)


NAMES = ("hip", "knee")


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("ramp", [1, 12, 39])
def test_both_are_told_quick_stop_until_both_stand_and_then_to_have_no_voltage(
    place: int, ramp: int
) -> None:
    cycle = ScriptedCycle(*pair(place, until(ramp, BRAKING, OFF), always(OFF)))
    for axis in cycle.axes:
        axis.frames(0x0F)
        axis.aim(1.0)
    report, held = cycle.stop()
    assert report == StopReport()
    assert report.verified
    assert not held
    assert cycle.stopping_at_first_word
    # One word before each look. The drive that is there first has no voltage at once; the other
    # one as soon as its ramp has ended, and both are seen without power three times.
    assert cycle.told(place) == [(QUICK, ramp + 1), (DISABLE, 3)]
    assert cycle.told(1 - place) == [(QUICK, 1), (DISABLE, ramp + 3)]
    assert cycle.ticks == ramp + 1 + 3
    # No target moves, whatever was to be sent next.
    assert {targets for targets in cycle.targets} == {(0, 0)}


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("shown", [ENABLED, BRAKING, UNKNOWN])
def test_a_drive_with_power_after_40_cycles_is_cut_off_and_looked_at_for_100_more(
    place: int, shown: int
) -> None:
    cycle = ScriptedCycle(*pair(place, always(shown), always(OFF)))
    report, _ = cycle.stop()
    assert cycle.told(place) == [(QUICK, 41), (DISABLE, 100)]
    assert cycle.ticks == 140
    assert (report.powered, report.silent) == ((NAMES[place],), ())
    assert report.cut_off == (NAMES[place],)
    assert report.states[0].startswith(f"{shown:04X}h: ")
    assert not report.verified


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_that_obeys_without_voltage_alone_is_cut_off_and_verified(place: int) -> None:
    cycle = ScriptedCycle(*pair(place, until(42, BRAKING, OFF), always(OFF)))
    report, _ = cycle.stop()
    assert cycle.told(place) == [(QUICK, 41), (DISABLE, 5)]
    assert report == StopReport(cut_off=(NAMES[place],))


def test_no_power_is_to_be_seen_three_times_in_a_row() -> None:
    # Ticks 0 to 2 end the ramp and look twice; tick 3 shows power once more.
    cycle = ScriptedCycle(lambda tick: BRAKING if tick == 3 else OFF, always(OFF))
    report, _ = cycle.stop()
    assert report.verified
    assert cycle.ticks == 4 + 3
    # A drive that is in fault has no power either.
    cycle = ScriptedCycle(always(FAULT), always(OFF))
    assert cycle.stop()[0].verified
    assert cycle.ticks == 1 + 3


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_that_says_nothing_for_more_than_20_cycles_is_waited_for_no_longer(
    place: int,
) -> None:
    cycle = ScriptedCycle(*pair(place, always(None), always(OFF)))
    report, _ = cycle.stop()
    assert cycle.ticks == 21 + 3
    assert (report.powered, report.silent, report.cut_off) == ((), (NAMES[place],), ())
    assert not report.verified
    # It may be silent for 20 cycles and speak again: then it counts again.
    cycle = ScriptedCycle(*pair(place, lambda tick: BRAKING if tick == 20 else None, always(OFF)))
    report, _ = cycle.stop()
    assert cycle.ticks == 21 + 21 + 2
    assert report.cut_off == (NAMES[place],)
    assert report.silent == (NAMES[place],)


@pytest.mark.parametrize("place", [0, 1])
def test_off_the_bus_a_drive_that_says_nothing_is_not_waited_for(place: int) -> None:
    cycle = ScriptedCycle(*pair(place, always(None), always(OFF)))
    cycle.bus_off = True
    report, _ = cycle.stop()
    assert cycle.ticks == 1 + 3
    assert (report.powered, report.silent, report.cut_off) == ((), (NAMES[place],), ())
    # One that still answers is.
    cycle = ScriptedCycle(*pair(place, until(10, BRAKING, OFF), always(OFF)))
    cycle.bus_off = True
    report, _ = cycle.stop()
    assert cycle.ticks == 10 + 1 + 3
    assert report.verified


def test_three_cycles_in_a_row_that_raise_end_the_wait_and_fewer_do_not() -> None:
    cycle = ScriptedCycle(until(10, BRAKING, OFF), always(OFF))
    cycle.fails_tick = {1, 2, 4, 5, 7, 8}
    report, held = cycle.stop()
    assert report == StopReport(errors=("KeyboardInterrupt",))
    assert held == ["KeyboardInterrupt"] * 6
    assert cycle.ticks == 10 + 1 + 3
    cycle = ScriptedCycle(always(BRAKING), always(BRAKING))
    cycle.fails_tick = set(range(200))
    report, held = cycle.stop()
    # Three in the ramp, three without voltage; the words go out before each.
    assert cycle.ticks == 3 + 3
    assert held == ["KeyboardInterrupt"] * 6
    assert cycle.told(0) == cycle.told(1) == [(QUICK, 3), (DISABLE, 3)]
    assert report.cut_off == NAMES


@pytest.mark.parametrize("first", [0, 1, 4])
def test_a_word_that_is_not_taken_is_sent_once_more_and_then_left(first: int) -> None:
    sound = ScriptedCycle(until(6, BRAKING, OFF), until(6, BRAKING, OFF))
    sound.stop()
    for times in (1, 2):
        cycle = ScriptedCycle(until(6, BRAKING, OFF), until(6, BRAKING, OFF))
        cycle.fails_send = set(range(first, first + times))
        report, held = cycle.stop()
        assert report == StopReport(errors=("ValueError: no such frame",))
        assert held == ["ValueError"] * times
        assert cycle.ticks == sound.ticks
        # Sent again at once, or missing in its cycle: the next cycle has its own.
        assert len(cycle.words) == len(sound.words) - (times - 1)
