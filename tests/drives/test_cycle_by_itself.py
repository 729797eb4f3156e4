"""One cycle by itself, with a wire that answers as a test says: grid, SYNC, answers, commands."""

import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import can
import pytest
from drives_rig import MS, config, node

from legbench.drives.codec.datatypes import DataType
from legbench.drives.codec.pdo import Mapped
from legbench.drives.config import CONTROLWORD, TARGET_POSITION, BusConfig, PdoConfig
from legbench.drives.errors import BusError
from legbench.drives.master.cycle import Cycle, Tick
from legbench.drives.master.port import Port

US = 1000
DATA = bytes.fromhex("3712E80300000000")
"""Operation enabled, follows its command; motor at 1000 counts, link at 0."""
BOTH = ((240 * US, 0x181, DATA), (350 * US, 0x182, DATA))
"""Answers to a SYNC: how much later, identifier, data."""
Answers = tuple[tuple[int, int, bytes], ...]


def message(cob_id: int, data: bytes = b"", *, error: bool = False, own: bool = False) -> Any:
    return can.Message(
        arbitration_id=cob_id,
        data=data,
        is_extended_id=False,
        is_error_frame=error,
        is_rx=not own,
    )


class Wire:
    """A port in virtual time; what comes is planned, what goes out is kept."""

    def __init__(self, now_ns: int = 0) -> None:
        self.time_ns = now_ns
        self.timebase = self
        self.sent: list[tuple[int, int, bytes]] = []
        self.coming: list[tuple[int, can.Message]] = []
        self.answers: Callable[[int], Answers] = lambda number: BOTH
        self.syncs = 0
        self.refuses: set[int] = set()
        self.deaf = self.off_bus = False
        self.message = Port.message

    def now_ns(self) -> int:
        return self.time_ns

    def wait_until(self, at_ns: int) -> None:
        self.time_ns = max(self.time_ns, at_ns)

    def put(self, message: can.Message) -> None:
        if message.arbitration_id in self.refuses:
            raise BusError(f"{message.arbitration_id:03X}h refused")
        self.sent.append((self.time_ns, message.arbitration_id, bytes(message.data)))
        if message.arbitration_id == 0x080:
            for after_ns, cob_id, data in self.answers(self.syncs):
                self.plan(self.time_ns + after_ns, cob_id, data)
            self.syncs += 1

    def send_frame(self, frame: Any) -> None:
        self.put(message(frame.cob_id, frame.data, own=True))

    def plan(self, at_ns: int, cob_id: int, data: bytes = b"", **more: bool) -> None:
        self.coming.append((at_ns, message(cob_id, data, **more)))
        self.coming.sort(key=lambda entry: entry[0])

    def receive(self, until_ns: int) -> can.Message | None:
        if self.deaf:
            raise BusError("deaf")
        if self.coming and self.coming[0][0] <= max(until_ns, self.time_ns):
            at_ns, found = self.coming.pop(0)
            self.wait_until(at_ns)
            return found
        self.wait_until(until_ns)
        return None

    def take(self) -> can.Message | None:
        return self.receive(self.time_ns)

    def foreign(self, message: can.Message) -> bool:
        return message.is_rx

    def when(self, cob_id: int) -> list[int]:
        return [at for at, sent, _ in self.sent if sent == cob_id]


def cycle(wire: Wire, bus: BusConfig | None = None) -> Cycle:
    made = Cycle(cast(Any, wire), bus or config())
    made.begin()
    return made


def missed(it: Cycle) -> list[int]:
    return [watch.lost_total for watch in it.watches]


def stale(place: int, lost: set[int]) -> Callable[[int], Answers]:
    """Answers without those of a drive to some SYNCs."""
    return lambda number: BOTH[1 - place :: 2] if number in lost else BOTH


# --- the grid --------------------------------------------------------------------------------


@pytest.mark.parametrize("period_us", [1000, 2000])
def test_the_first_tick_is_the_next_whole_period_and_the_others_follow(period_us: int) -> None:
    period = period_us * US
    for begun, first in ((0, period), (1, period), (period - 1, period), (period, 2 * period)):
        wire = Wire(begun)
        it = cycle(wire, config(period_us=period_us))
        ticks = [it.tick() for _ in range(3)]
        assert wire.when(0x080) == [first, first + period, first + 2 * period]
        assert ticks == [Tick(at, 0, 0, 0, True) for at in wire.when(0x080)]
        assert (it.silent_total, it.late_frames, missed(it)) == (0, 0, [0, 0])


@pytest.mark.parametrize(
    ("late_us", "skipped"),
    [(1, 0), (499, 0), (500, 1), (1000, 1), (1499, 1), (1500, 2), (5200, 5)],
)
def test_a_late_tick_is_made_from_half_a_period_on_at_the_next_place_of_the_grid(
    late_us: int, skipped: int
) -> None:
    wire = Wire()
    it = cycle(wire)
    it.tick()
    wire.wait_until(2 * MS + late_us * US)
    told = it.tick()
    at = max(2 * MS + late_us * US, (2 + skipped) * MS)
    assert told == Tick(at, at - (2 + skipped) * MS, skipped, 0, True)
    # The grid does not move.
    assert it.tick() == Tick((3 + skipped) * MS, 0, 0, 0, True)


def test_answers_count_until_the_deadline_and_no_longer() -> None:
    for at_us, counts in ((700, True), (701, False)):
        wire = Wire()
        wire.answers = lambda number, at=at_us: (BOTH[0], (at * US, 0x182, DATA))
        it = cycle(wire)
        assert it.tick().complete is counts
        assert [axis.fresh for axis in it.axes] == [True, counts]
        assert missed(it) == [0, int(not counts)]
        # All there: the cycle waits no longer.
        assert wire.time_ns == MS + 700 * US


# --- what is owed ----------------------------------------------------------------------------


@pytest.mark.parametrize("place", [0, 1])
def test_after_an_answer_that_has_not_come_one_tick_is_silent(place: int) -> None:
    wire = Wire()
    wire.answers = stale(place, {1})
    it = cycle(wire)
    ticks = [it.tick() for _ in range(4)]
    assert wire.when(0x080) == [1 * MS, 2 * MS, 4 * MS, 5 * MS]
    assert [(tick.skipped, tick.silent, tick.late_ns) for tick in ticks] == [
        (0, 0, 0),
        (0, 0, 0),
        (1, 1, 0),
        (0, 0, 0),
    ]
    assert [tick.complete for tick in ticks] == [True, False, True, True]
    assert it.silent_total == 1
    # The cycle and the silent tick, for the drive that owes them.
    assert missed(it) == [2 - 2 * place, 2 * place]


@pytest.mark.parametrize("place", [0, 1])
def test_what_comes_before_the_next_tick_is_late_and_owed_no_more(place: int) -> None:
    wire = Wire()
    wire.answers = stale(place, {1})
    it = cycle(wire)
    it.tick()
    it.tick()
    wire.plan(2 * MS + 900 * US, 0x181 + place, DATA)
    assert it.tick() == Tick(3 * MS, 0, 0, 0, True)
    assert (it.late_frames, it.silent_total) == (1, 0)
    assert missed(it) == [1 - place, place]
    assert "node answered twice" not in it.notices.events
    # An answer to a SYNC that has its own is one too many.
    wire.plan(3 * MS + 800 * US, 0x181 + place, DATA)
    it.tick()
    assert it.late_frames == 2
    assert it.notices.events["node answered twice"]["count"] == 1
    assert it.notices.events["node answered twice"]["cob_id"] == 0x181 + place


@pytest.mark.parametrize("place", [0, 1])
def test_what_comes_in_a_silent_tick_never_passes_for_new(place: int) -> None:
    wire = Wire()
    wire.answers = stale(place, {1})
    it = cycle(wire)
    it.tick()
    it.tick()
    old = DATA[:2] + (-7).to_bytes(4, "little", signed=True) + DATA[6:]
    # An answer that takes 1.5 ms, behind the tick that would have had its SYNC.
    wire.plan(3 * MS + 500 * US, 0x181 + place, old)
    assert it.tick() == Tick(4 * MS, 0, 1, 1, True)
    assert wire.time_ns == 4 * MS + BOTH[1][0]
    assert [axis.motor_counts for axis in it.axes] == [1000, 1000]
    assert (it.late_frames, it.silent_total) == (1, 1)
    assert "node answered twice" not in it.notices.events


def test_while_a_stop_waits_no_tick_is_silent() -> None:
    wire = Wire()
    wire.answers = lambda number: ()
    it = cycle(wire)
    it.stopping = True
    for _ in range(5):
        assert not it.tick().complete
    assert wire.when(0x080) == [number * MS for number in range(1, 6)]
    assert (it.silent_total, missed(it)) == (0, [5, 5])


@pytest.mark.parametrize("place", [0, 1])
def test_a_garbled_answer_is_counted_for_its_drive_and_not_owed(place: int) -> None:
    wire = Wire()
    wire.answers = lambda number: (BOTH[1 - place], (400 * US, 0x181 + place, DATA[:5]))
    it = cycle(wire)
    assert not it.tick().complete
    assert [watch.bad_total for watch in it.watches] == [1 - place, place]
    it.tick()
    assert wire.when(0x080) == [1 * MS, 2 * MS]


def test_an_answer_that_comes_twice_counts_once() -> None:
    wire = Wire()
    wire.answers = lambda number: (BOTH[0], (300 * US, 0x181, DATA))
    it = cycle(wire)
    told = it.tick()
    assert (told.complete, it.axes[1].fresh) == (False, False)
    assert it.notices.events["node answered twice"]["count"] == 1


# --- a bus that fails ------------------------------------------------------------------------


def test_a_sync_that_is_refused_loses_the_cycle_and_the_next_one_is_new() -> None:
    for off_bus in (False, True):
        wire = Wire()
        it = cycle(wire)
        wire.refuses, wire.off_bus = {0x080}, off_bus
        assert it.tick() == Tick(1 * MS, 0, 0, 0, False)
        assert str(it.bus_error) == "080h refused"
        assert missed(it) == [1, 1]
        wire.refuses, wire.off_bus = set(), False
        assert it.tick() == Tick(2 * MS, 0, 0, 0, True)
        assert it.bus_error is None
        # A controller that has left the bus does not come back by itself.
        assert it.bus_off is off_bus


def test_a_bus_that_cannot_be_read_owes_all_answers() -> None:
    wire = Wire()
    wire.answers = lambda number: () if number == 1 else BOTH
    it = cycle(wire)
    it.tick()
    wire.deaf = True
    assert not it.tick().complete
    assert str(it.bus_error) == "deaf"
    wire.deaf = False
    assert it.tick() == Tick(5 * MS, 0, 1, 1, True)
    assert it.bus_error is None
    # What was not read before a SYNC may be an answer to the last one.
    real = wire.take

    def once() -> can.Message | None:
        wire.take = real
        raise BusError("deaf")

    wire.take = once
    assert it.tick() == Tick(7 * MS, 0, 1, 1, True)
    assert str(it.bus_error) == "deaf"


def test_a_bus_that_fails_between_two_answers_is_told() -> None:
    wire = Wire()
    it = cycle(wire)
    wire.off_bus = True
    real = wire.receive

    def fails(until_ns: int) -> can.Message | None:
        if until_ns > wire.time_ns and it.axes[0].fresh:
            raise BusError("deaf")
        return real(until_ns)

    wire.receive = fails
    assert not it.tick().complete
    assert [axis.fresh for axis in it.axes] == [True, False]
    assert (str(it.bus_error), it.bus_off) == ("deaf", True)


def test_frames_that_never_end_hold_up_no_tick_for_longer_than_a_period() -> None:
    wire = Wire()
    it = cycle(wire)
    it.stopping = True
    real = wire.take

    def babble() -> can.Message | None:
        wire.time_ns += 10 * US
        return message(0x555)

    wire.take = babble
    it.tick()
    assert str(it.bus_error).startswith("frames come faster than they are read, for 1 ms now")
    assert 1 * MS < wire.when(0x080)[0] - MS <= 1 * MS + 20 * US
    wire.take = real


def test_frames_of_others_hold_up_no_cycle_beyond_its_deadline() -> None:
    wire = Wire()
    it = cycle(wire)

    def babble(until_ns: int) -> can.Message | None:
        wire.wait_until(until_ns)
        return message(0x555)

    wire.take = lambda: None
    wire.receive = babble
    assert not it.tick().complete
    assert wire.time_ns == MS + 700 * US


def test_a_command_in_two_frames_goes_out_whole() -> None:
    rpdos = (
        PdoConfig(number=1, objects=(CONTROLWORD,)),
        PdoConfig(number=2, objects=(TARGET_POSITION,)),
    )
    nodes = tuple(replace(node(place), rpdos=rpdos) for place in (0, 1))
    wire = Wire()
    it = cycle(wire, config(nodes=nodes))
    for axis in it.axes:
        axis.target_counts = 1000
    assert it.send([0x0F, 0x07])
    assert [(cob_id, data) for _, cob_id, data in wire.sent] == [
        (0x201, b"\x0f\x00"),
        (0x301, b"\xe8\x03\x00\x00"),
        (0x202, b"\x07\x00"),
        (0x302, b"\xe8\x03\x00\x00"),
    ]


@pytest.mark.parametrize("refused", [0x201, 0x202])
def test_a_command_that_is_refused_keeps_no_other_drive_from_its_own(refused: int) -> None:
    wire = Wire()
    it = cycle(wire)
    it.tick()
    assert it.send([0x0F, 0x0F])
    wire.sent.clear()
    wire.refuses = {refused}
    assert not it.send([0x06, 0x02])
    assert str(it.bus_error) == f"{refused:03X}h refused"
    words = {0x201: b"\x06\x00", 0x202: b"\x02\x00"}
    del words[refused]
    assert [(cob_id, data[:2]) for _, cob_id, data in wire.sent] == list(words.items())


def test_without_a_word_no_command_goes_out() -> None:
    for place in (0, 1):
        wire = Wire()
        it = cycle(wire)
        for axis, counts in zip(it.axes, (1000, -2000), strict=True):
            axis.target_counts = counts
        assert it.send([None, 0x0F] if place else [0x0F, None])
        targets = (b"\xe8\x03\x00\x00", b"\x30\xf8\xff\xff")
        assert [(cob, data) for _, cob, data in wire.sent] == [
            (0x201 + place, b"\x0f\x00" + targets[place])
        ]


def test_words_for_another_number_of_drives_are_refused() -> None:
    for words in ([0x0F], [0x0F, 0x0F, 0x0F]):
        with pytest.raises(ValueError, match="zip"):
            cycle(Wire()).send(words)


def test_drives_are_asked_for_their_temperature_in_cycles_200_and_199() -> None:
    warmth = Mapped(0x2070, 0, DataType.INTEGER16)
    nodes = tuple(replace(node(place), temperature_object=warmth) for place in (0, 1))
    wire = Wire()
    it = cycle(wire, config(nodes=nodes))
    for _ in range(401):
        it.tick()
        it.send_rest()
    # The first tick is cycle 1, at 1 ms.
    assert [at // MS for at in wire.when(0x601)] == [200, 400]
    assert [at // MS for at in wire.when(0x602)] == [199, 399]


@pytest.mark.parametrize("beat_ms", [10, 15])
def test_heartbeats_keep_to_the_grid_whatever_is_skipped(beat_ms: int) -> None:
    wire = Wire()
    wire.answers = stale(0, {4, 9, 14})
    it = cycle(wire, config(master_heartbeat_ms=beat_ms))
    for _ in range(60):
        it.tick()
        it.send_rest()
    beats = [at // MS for at in wire.when(0x77E)]
    assert it.silent_total == 3
    # The first one a heartbeat after the first tick; sent in the cycle before its time.
    assert beats[0] == beat_ms
    assert {b - a for a, b in itertools.pairwise(beats)} <= {beat_ms, beat_ms + 1}
    wire.refuses = {0x77E}
    sent = [it.send_rest() for _ in range(1) if it.tick()]
    for _ in range(beat_ms):
        it.tick()
        sent.append(it.send_rest())
    assert False in sent


# --- frames that are no process data ---------------------------------------------------------


def test_an_error_frame_is_counted_and_that_of_bus_off_is_known() -> None:
    for bits in range(1 << 9):
        it = cycle(Wire())
        it.other(message(bits, bytes(8), error=True))
        assert (it.error_frames, it.stranger) == (1, None)
        assert it.bus_off is bool(bits & 0x40)


def test_frames_of_a_master_are_a_strangers_unless_they_are_our_own() -> None:
    ours = {0x000, 0x080, 0x77E, 0x201, 0x202}
    for cob_id in range(1 << 11):
        it = cycle(Wire())
        it.other(message(cob_id, b"\x05", own=True))
        assert it.stranger is None
        it.other(message(cob_id, b"\x05"))
        assert it.stranger == (cob_id if cob_id in ours else None)
    wire = Wire()
    it = cycle(wire)
    assert not it.led_by_another()
    wire.plan(0, 0x080)
    assert it.led_by_another()


@pytest.mark.parametrize("place", [0, 1])
def test_each_frame_is_heard_for_the_drive_that_sent_it(place: int) -> None:
    wire = Wire(5 * MS)
    bus = config(nodes=tuple(replace(node(i), temperature_object=None) for i in (0, 1)))
    it = cycle(wire, bus)
    it.other(message(0x701 + place, b"\x04"))
    it.other(message(0x703, b"\x04"))
    assert [watch.state is not None for watch in it.watches] == [not place, bool(place)]
    it.other(message(0x081 + place, bytes.fromhex("1043010000000000")))
    assert [len(watch.history) for watch in it.watches] == [1 - place, place]
    # 40h reads, 23h and 2Bh write; what we ask ourselves is no news.
    it.other(message(0x601 + place, bytes.fromhex("4041600000000000")))
    it.other(message(0x601 + place, bytes.fromhex("2B40600006000000"), own=True))
    assert "foreign SDO write" not in it.notices.events
    it.other(message(0x601 + place, bytes.fromhex("2B40600006000000")))
    event = it.notices.events["foreign SDO write"]
    assert (event["count"], event["node"], event["object"]) == (1, place + 1, "6040h:00")
    assert event["first"] == pytest.approx(0.005)


def test_what_comes_before_the_sync_of_another_master_is_heard_as_ever() -> None:
    wire = Wire()
    it = cycle(wire)
    wire.plan(100 * US, 0x701, b"\x04")
    wire.plan(200 * US, 0x181, bytes(8), error=True)
    wire.plan(300 * US, 0x080, bytes(8), error=True)
    wire.plan(400 * US, 0x181, DATA)
    assert not it.hears_sync(MS)
    assert [watch.state is not None for watch in it.watches] == [True, False]
    assert (it.error_frames, it.late_frames) == (2, 1)


# --- behind another master -------------------------------------------------------------------


def test_the_sync_of_another_master_is_followed_and_nothing_is_sent() -> None:
    wire = Wire()
    it = cycle(wire)
    assert not it.hears_sync(3 * MS)
    assert wire.time_ns == 3 * MS
    for at in (4, 5, 6, 8, 10):
        wire.plan(at * MS, 0x080)
        for after_ns, cob_id, data in BOTH:
            wire.plan(at * MS + after_ns, cob_id, data)
    assert it.hears_sync(5 * MS)
    assert wire.time_ns == 4 * MS
    ticks = [it.follow() for _ in range(4)]
    assert [tick.time_ns for tick in ticks] == [5 * MS, 6 * MS, 8 * MS, 10 * MS]
    assert [(tick.skipped, tick.silent, tick.late_ns) for tick in ticks[1:]] == [
        (0, 0, 0),
        (1, 1, 0),
        (1, 1, 0),
    ]
    assert all(tick.complete for tick in ticks)
    # What the drives answered to the first SYNC came before the second one was awaited.
    assert it.late_frames == 2
    assert it.stranger is None
    assert not wire.sent
    # A master that is heard no more is waited for two periods.
    now = wire.time_ns
    gone = it.follow()
    assert (gone.complete, gone.skipped) == (False, 0)
    assert wire.time_ns == now + 2 * MS
    assert missed(it) == [1, 1]
    # It counts for one period; of the SYNC at 12 ms nobody has heard.
    wire.plan(13 * MS, 0x080)
    assert it.follow().skipped == 1


def test_a_bus_that_fails_while_another_master_is_followed_is_told() -> None:
    wire = Wire()
    it = cycle(wire)
    wire.deaf = True
    assert not it.follow().complete
    assert str(it.bus_error) == "deaf"
    assert missed(it) == [1, 1]
    wire.deaf = False
    wire.plan(wire.time_ns + 100 * US, 0x080)
    assert not it.follow().complete
    assert it.bus_error is None
