"""The start-up by itself, with two drives that obey the words they are told as a test says."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, cast

import pytest
from drives_rig import config, node

from legbench.drives.errors import DriveError
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.cycle import Tick
from legbench.drives.master.start_up import StartUp
from legbench.drives.protocol.cia402 import Goal
from legbench.drives.setup.quirks import Quirks
from legbench.errors import PlantFault

NAMES = ("hip", "knee")
FOLLOWS, LIMITED = 1 << 12, 1 << 11
SHOWS = {0x00: 0x0250, 0x06: 0x0231, 0x07: 0x0233, 0x0F: 0x0237, 0x80: 0x0250}
"""Controlword -> statusword of a drive that obeys at once."""
COUNTS = (1000, -3000)
PER_RAD = (1 << 20) / 6.283185307179586


class Drives:
    """A port, and a cycle of two drives that obey at once; what is done to them is kept."""

    def __init__(self) -> None:
        self.axes = tuple(AxisLink(node(place)) for place in (0, 1))
        self.done: list[Any] = []
        self.ticks = 0
        self.bits = [FOLLOWS, FOLLOWS]
        """Besides the state, once a drive is enabled."""
        self.stuck: dict[int, int] = {}
        """Place -> statusword that a drive shows whatever it is told."""
        self.incomplete: set[int] = set()
        self.counts: list[int] = list(COUNTS)
        self.words: list[int | None] = [0x00, 0x00]
        self._show()

    def _show(self) -> None:
        for place, axis in enumerate(self.axes):
            word = self.words[place]
            status = SHOWS[0x00 if word is None else word]
            if status == 0x0237:
                status |= self.bits[place]
            status = self.stuck.get(place, status)
            data = status.to_bytes(2, "little") + self.counts[place].to_bytes(
                4, "little", signed=True
            )
            axis.begin_cycle()
            if self.ticks not in self.incomplete:
                assert axis.feed(0x181 + place, data + b"\0\0")

    def send_frame(self, frame: Any) -> None:
        self.done.append((frame.cob_id, frame.data))

    def begin(self) -> None:
        self.done.append("begin")

    def arm(self) -> None:
        self.done.append("arm")

    def send(self, words: Sequence[int | None]) -> None:
        self.words = list(words)
        self.done.append(tuple(words))

    def send_heartbeat(self) -> None:
        self.done.append("rest")

    def tick(self) -> Tick:
        self.ticks += 1
        self._show()
        return Tick(self.ticks, 0, 0, 0, self.ticks not in self.incomplete)

    def start_up(self, *, read_only: bool = False, cycles: int = 5) -> StartUp:
        bus = config(settle_cycles=cycles)
        return StartUp(cast(Any, self), cast(Any, self), bus, read_only=read_only)


# --- regular process data --------------------------------------------------------------------


@pytest.mark.parametrize("way", ["lead", "read only", "listen"])
def test_nodes_are_started_and_process_data_awaited(way: str) -> None:
    it = Drives()
    start_up = it.start_up(read_only=way == "read only")
    start_up.listening = way == "listen"
    # The third cycle is not complete: five in a row are there after the eighth.
    it.incomplete = {3}
    last = start_up.settle(it.tick)
    assert last.time_ns == it.ticks == 8
    started = [(0x000, b"\x01\x01"), (0x000, b"\x01\x02")]
    said = {"lead": (0, 0), "read only": "rest", "listen": None}[way]
    each = [said] * 8 if said is not None else []
    assert it.done == [*(started if way != "listen" else []), "begin", *each, "arm"]


def test_process_data_that_never_become_regular_end_the_start_after_2000_cycles() -> None:
    for incomplete, words in (
        (set(range(1, 4000)), "missing: hip, knee; look at"),
        (set(range(1, 4000, 2)), "missing: now and then; look at"),
    ):
        it = Drives()
        it.incomplete = incomplete
        with pytest.raises(DriveError, match=rf"within 2000 ms; {words}"):
            it.start_up(cycles=2).settle(it.tick)
        assert it.ticks == 2000
        assert "arm" not in it.done


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_gets_no_word_before_it_is_known_and_its_place_until_it_is_enabled(
    place: int,
) -> None:
    it = Drives()
    it.axes[place].forget()
    it.start_up().idle()
    assert it.done == [(None, 0) if place == 0 else (0, None)]
    it.tick()
    for axis in it.axes:
        axis.target_counts = 5
    it.start_up().idle()
    assert it.done[-1] == (0, 0)
    assert [axis.target_counts for axis in it.axes] == list(COUNTS)
    # Once it is enabled its target is that of the command.
    it.axes[place].machine.seek(Goal.ENABLED)
    it.stuck[place] = 0x1237
    it.tick()
    for axis in it.axes:
        axis.target_counts = 5
    it.start_up().idle()
    assert it.axes[place].target_counts == 5
    assert it.axes[1 - place].target_counts == COUNTS[1 - place]


def test_drives_in_fault_are_those_that_show_it() -> None:
    for shown in ((), (0,), (1,), (0, 1)):
        it = Drives()
        it.stuck = dict.fromkeys(shown, 0x0218)
        it.tick()
        faulted = it.start_up().faulted()
        assert [axis.node.name for axis in faulted] == [NAMES[place] for place in shown]
    it.stuck = {0: 0x021F, 1: 0x0217}  # Its reaction, and a quick stop.
    it.tick()
    assert it.start_up().faulted() == []


# --- to a goal -------------------------------------------------------------------------------


def enable(it: Drives) -> Tick:
    return it.start_up().enable(it.tick)


def test_both_are_enabled_rung_by_rung_without_a_word_too_many() -> None:
    it = Drives()
    last = enable(it)
    assert last.time_ns == it.ticks
    # Each word stands for two cycles; the start ends in the cycle that shows both enabled.
    assert it.done == [(0x06, 0x06)] * 2 + [(0x07, 0x07)] * 2 + [(0x0F, 0x0F)]
    # No cycle is without a word but the last one, which is not ended.
    assert it.ticks == 6
    assert all(axis.statusword == 0x1237 for axis in it.axes)


def test_drives_that_are_found_switched_on_have_their_word_for_two_cycles_too() -> None:
    it = Drives()
    it.words = [0x07, 0x07]
    enable(it)
    assert it.done == [(0x07, 0x07)] * 2 + [(0x0F, 0x0F)]


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_that_never_shows_its_mode_is_named_after_its_own_patience(place: int) -> None:
    it = Drives()
    for number, axis in enumerate(it.axes):
        patience_ms = 700 if number == place else 30
        axis.node = replace(axis.node, quirks=Quirks(mode_patience_ms=patience_ms))
        axis.in_mode = False
    real = it.tick

    def tick() -> Tick:
        # The other one shows it soon.
        it.axes[1 - place].in_mode = it.ticks >= 20
        return real()

    it.tick = tick
    who = rf"^drive '{NAMES[place]}' \(node {place + 1}\) does not become enabled: 1237h: .*"
    told = r"; mode 8 is not shown in 6061h within 700 ms: raise mode_patience_ms in \[node"
    with pytest.raises(DriveError, match=who + told):
        enable(it)
    # 2000 ms until they are switched on, which takes five cycles, and as long again; with 700 ms.
    assert it.ticks == 5 + 2700


@pytest.mark.parametrize("place", [0, 1])
def test_the_mode_is_not_blamed_for_a_drive_that_has_shown_it_or_is_not_enabled(place: int) -> None:
    for in_mode in (True, False):
        it = Drives()
        it.axes[place].in_mode = in_mode
        it.stuck[place] = 0x0218
        with pytest.raises(DriveError) as caught:
            enable(it)
        assert str(caught.value).startswith(f"drive '{NAMES[place]}' (node {place + 1}) does not")
        assert "mode 8" not in str(caught.value)


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("status", [0x0231, 0x0240])
def test_none_is_told_to_become_enabled_before_all_are_switched_on(place: int, status: int) -> None:
    it = Drives()
    it.stuck[place] = status
    real = it.tick

    def tick() -> Tick:
        if it.ticks == 200:
            it.stuck.clear()
        return real()

    it.tick = tick
    enable(it)
    waited = it.done[:200]
    assert all(words[1 - place] in (0x06, 0x07) for words in waited)
    assert waited[-1][1 - place] == 0x07
    # Both get the word in the same cycle.
    assert [words for words in it.done if 0x0F in words] == [(0x0F, 0x0F)]


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize(("cycles", "fails"), [(99, False), (100, True)])
def test_one_may_be_enabled_100_ms_after_the_other_and_no_later(
    place: int, cycles: int, fails: bool
) -> None:
    it = Drives()
    real, alone = it.tick, 0

    def tick() -> Tick:
        nonlocal alone
        if it.words[place] == 0x0F:
            it.stuck = {place: 0x0233} if alone < cycles else {}
            alone += 1
        return real()

    it.tick = tick
    if not fails:
        enable(it)
        assert all(axis.statusword == 0x1237 for axis in it.axes)
        return
    with pytest.raises(PlantFault) as caught:
        enable(it)
    assert caught.value.cause == "drive not enabled"
    assert alone == 100
    assert str(caught.value) == (
        f"drive '{NAMES[place]}' (node {place + 1}) is not enabled 100 ms after the other one: "
        "0233h: switched on, voltage enabled, remote; the limit is enable_spread_ms in the bus "
        "file; look at its brake, its supply and its error"
    )


def test_the_wait_for_the_slower_drive_is_a_time_whatever_the_period_is() -> None:
    for period_us, ticks in ((500, 200), (2000, 50), (3000, 34)):
        it = Drives()
        it.bits[0] = FOLLOWS
        real = it.tick

        def tick(_it: Drives = it, _real: Any = real) -> Tick:
            if _it.words[1] == 0x0F:
                _it.stuck[1] = 0x0233
            return _real()

        bus = config(period_us=period_us, tpdo_deadline_us=period_us // 2)
        up = StartUp(cast(Any, it), cast(Any, it), bus, read_only=False)
        with pytest.raises(PlantFault, match="is not enabled 100 ms after the other one"):
            up.enable(tick)
        shown = [words for words in it.done if words == (0x0F, 0x0F)]
        assert len(shown) == ticks


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_motor_that_moves_by_more_than_20_mrad_while_it_is_enabled_ends_it(
    place: int, side: int
) -> None:
    for angle, fails in ((0.0199, False), (0.0201, True)):
        it = Drives()
        ticks = it.tick

        def moving(_it: Drives = it, _angle: float = angle, _ticks: Any = ticks) -> Tick:
            _it.counts[place] = COUNTS[place] + round(side * _angle * PER_RAD)
            return _ticks()

        it.tick = moving
        if not fails:
            enable(it)
            continue
        with pytest.raises(PlantFault, match=r"limit is 0\.02 rad; look at") as caught:
            enable(it)
        assert caught.value.cause == "moved while enabling"
        sign = side * (1 - 2 * place)
        assert str(caught.value).startswith(
            f"drive '{NAMES[place]}' (node {place + 1}) moved by {sign * 0.0201:.3f} rad"
        )
        assert it.ticks == 1


@pytest.mark.parametrize("place", [0, 1])
def test_20_mrad_are_allowed_themselves(place: int) -> None:
    for angle, fails in ((0.02, False), (math.nextafter(0.02, 1.0), True)):
        it = Drives()
        axis, real = it.axes[place], it.tick
        axis.motor_pos = 0.0

        def tick(_axis: AxisLink = axis, _real: Any = real, _angle: float = angle) -> Tick:
            told = _real()
            _axis.motor_pos = _angle
            return told

        it.tick = tick
        if not fails:
            enable(it)
            continue
        with pytest.raises(PlantFault, match=r"moved by 0\.020 rad while it was enabled"):
            enable(it)


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_that_is_enabled_from_the_first_cycle_on_has_its_5_cycles_too(place: int) -> None:
    it = Drives()
    it.stuck = {place: 0x0237}
    with pytest.raises(PlantFault, match="does not follow its target on enabling"):
        enable(it)
    assert it.ticks == 6


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_that_does_not_follow_for_more_than_5_cycles_ends_it(place: int) -> None:
    for ignored in (5, 6):
        it = Drives()
        it.bits[place] = 0
        real, seen = it.tick, 0

        def tick(_it: Drives = it, _real: Any = real, _cycles: int = ignored) -> Tick:
            nonlocal seen
            if seen == _cycles:
                _it.bits[place] = FOLLOWS
            told = _real()
            seen += _it.axes[place].statusword == 0x0237
            return told

        it.tick = tick
        if ignored == 5:
            enable(it)
            continue
        with pytest.raises(PlantFault, match="not follow its target on enabling: 0237h") as caught:
            enable(it)
        assert caught.value.cause == "command ignored"
        assert str(caught.value).startswith(f"drive '{NAMES[place]}' (node {place + 1})")


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_that_is_limited_when_it_is_enabled_ends_it_at_once(place: int) -> None:
    it = Drives()
    it.bits[place] = FOLLOWS | LIMITED
    with pytest.raises(PlantFault, match="not follow its target on enabling: 1A37h") as caught:
        enable(it)
    assert caught.value.cause == "command ignored"
    assert str(caught.value).startswith(f"drive '{NAMES[place]}' (node {place + 1})")
    # On the way up the bit says nothing.
    it = Drives()
    it.stuck[place] = 0x0A33
    with pytest.raises(PlantFault, match="is not enabled 100 ms after the other one: 0A33h"):
        enable(it)


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_that_is_refused_is_named_at_once_and_a_slow_one_after_2000_cycles(
    place: int,
) -> None:
    who = rf"^drive '{NAMES[place]}' \(node {place + 1}\) does not become enabled: "
    for shown, ticks in ((0x0218, 1), (0x0231, 2000)):
        it = Drives()
        it.stuck[place] = shown
        with pytest.raises(DriveError, match=f"{who}{shown:04X}h"):
            enable(it)
        assert it.ticks == ticks


@pytest.mark.parametrize("place", [0, 1])
def test_after_a_fault_reset_a_drive_is_led_to_rest_and_the_other_one_is_not_asked(
    place: int,
) -> None:
    it = Drives()
    it.stuck[place] = 0x0218
    it.tick()
    real = it.tick

    def tick() -> Tick:
        if it.words[place] == 0x80:
            it.stuck.clear()
        return real()

    start_up = it.start_up()
    start_up.seek(Goal.FAULT_RESET, start_up.faulted(), tick, "leave its fault")
    goals = [axis.machine.goal for axis in it.axes]
    assert goals == [Goal.DISABLED, Goal.DISABLED]
    edge = [words for words in it.done if words[place] == 0x80]
    assert len(edge) == 1
    assert it.done[-1] == (0x00, 0x00)
    # Two of them rest, both.
    it = Drives()
    it.stuck = {0: 0x0218, 1: 0x0218}
    it.tick()
    start_up, real = it.start_up(), it.tick
    start_up.seek(Goal.FAULT_RESET, start_up.faulted(), tick, "leave its fault")
    assert [axis.machine.goal for axis in it.axes] == [Goal.DISABLED, Goal.DISABLED]
    # Motors that are moved by hand meanwhile are no fault: nothing has power.
    it = Drives()
    it.stuck[place] = 0x0218
    it.tick()
    start_up = it.start_up()
    faulted = start_up.faulted()
    it.counts[place] += 100_000
    it.stuck.clear()
    start_up.seek(Goal.FAULT_RESET, faulted, it.tick, "leave its fault")
