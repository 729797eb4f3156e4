"""One cycle by itself: a bus that fails, commands, frames of others."""

import itertools
from dataclasses import replace

import can
import pytest
from cycle_wire import BOTH, DATA, US, Wire, cycle, message, missed, stale
from drives_rig import MS, config, node

from legbench.drives.errors import BusError
from legbench.drives.master.cycle import Tick
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import CONTROLWORD, TARGET_POSITION, PdoConfig

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
    assert wire.time_ns == MS + 720 * US


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
        with pytest.raises(ValueError, match=rf"^{len(words)} controlwords for 2 drives$"):
            cycle(Wire()).send(words)


def test_drives_are_asked_for_their_temperature_in_cycles_200_and_199() -> None:
    warmth = Mapped(0x2070, 0, DataType.INTEGER16)
    nodes = tuple(replace(node(place), temperature_object=warmth) for place in (0, 1))
    wire = Wire()
    it = cycle(wire, config(nodes=nodes))
    for _ in range(401):
        it.tick()
        it.send_heartbeat()
    # The first tick is cycle 1, at 1 ms.
    assert [at // MS for at in wire.when(0x601)] == [200, 400]
    assert [at // MS for at in wire.when(0x602)] == [199, 399]
    for place, shown in ((0, "3801"), (1, "A201")):
        it.other(message(0x581 + place, bytes.fromhex(f"4B702000{shown}0000")))
        told = [poll.celsius for poll in it.polls]
        assert told == pytest.approx([31.2, 41.8] if place else [31.2, None])


@pytest.mark.parametrize("beat_ms", [10, 15])
def test_heartbeats_keep_to_the_grid_whatever_is_skipped(beat_ms: int) -> None:
    wire = Wire()
    wire.answers = stale(0, {4, 9, 14})
    it = cycle(wire, config(master_heartbeat_ms=beat_ms))
    for _ in range(60):
        it.tick()
        it.send_heartbeat()
    beats = [at // MS for at in wire.when(0x77E)]
    assert it.silent_total == 3
    # The first one a heartbeat after the first tick; sent in the cycle before its time.
    assert beats[0] == beat_ms
    assert {b - a for a, b in itertools.pairwise(beats)} <= {beat_ms, beat_ms + 1}
    wire.refuses = {0x77E}
    sent = [it.send_heartbeat() for _ in range(1) if it.tick()]
    for _ in range(beat_ms):
        it.tick()
        sent.append(it.send_heartbeat())
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


def test_what_comes_between_two_answers_is_heard() -> None:
    wire = Wire()
    it = cycle(wire)
    wire.plan(MS + 300 * US, 0x702, b"\x04")
    assert it.tick().complete
    assert [watch.state is not None for watch in it.watches] == [False, True]
