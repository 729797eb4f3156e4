"""Parts of an emulated drive and of its bus, each by itself."""

from types import SimpleNamespace
from typing import Any, cast

import pytest
from drives_rig import MS, node

from legbench.drives.emulated import dictionary, error_frames, rules, warmth
from legbench.drives.emulated.behaviour import Behaviour, MissingSetpoint
from legbench.drives.emulated.connection import Connection
from legbench.drives.emulated.dictionary import Dictionary, _shown_only, dictionary_of
from legbench.drives.emulated.emergencies import EmergencyOutlet
from legbench.drives.emulated.faults import (
    Babble,
    FrameFault,
    FrameFaultKind,
    NodeFault,
    NodeFaultKind,
)
from legbench.drives.emulated.heartbeats import HeartbeatConsumer, HeartbeatProducer
from legbench.drives.emulated.injector import Injector
from legbench.drives.emulated.rules import objection, usable, watched
from legbench.drives.emulated.send_queue import SendQueue
from legbench.drives.emulated.sensors import Encoder, SensorFault, Sensors
from legbench.drives.emulated.shared_body import LockstepChannels, SharedBody
from legbench.drives.emulated.station import Station
from legbench.drives.emulated.stuffing import Stuffing, bits_of
from legbench.drives.emulated.warmth import TENTHS, show_temperature
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.objects import Access, Key, ObjectEntry
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.protocol.sdo import Abort
from legbench.drives.protocol.sdo_server import SdoAnswers

OPERATIONAL = b"\x05"

# --- heartbeats ------------------------------------------------------------------------------


def consumer(*words: int) -> HeartbeatConsumer:
    return HeartbeatConsumer({(0x1016, sub): word for sub, word in enumerate(words, start=1)})


@pytest.mark.parametrize("sub", [0, 1])
def test_a_node_of_either_entry_is_watched_from_the_start_or_from_its_first_heartbeat(
    sub: int,
) -> None:
    words = [0, 0]
    words[sub] = 126 << 16 | 30
    for begins in (False, True):
        watch = consumer(*words)
        assert not watch.lost(10**12)
        if begins:
            watch.start(1000 * MS)
        else:
            assert watch.take(126, OPERATIONAL, 1000 * MS)
        assert not watch.lost(1030 * MS)
        assert watch.lost(1030 * MS + 1)
        # Others, and what is no heartbeat, put nothing off; a start changes no watch.
        assert not watch.take(125, OPERATIONAL, 1020 * MS)
        assert not watch.take(126, b"\x06", 1020 * MS)
        watch.start(1020 * MS)
        assert watch.lost(1030 * MS + 1)
        assert watch.take(126, OPERATIONAL, 1020 * MS)
        assert not watch.lost(1050 * MS)
        assert watch.lost(1050 * MS + 1)
        watch.clear()
        assert not watch.lost(10**12)


def test_both_nodes_that_are_watched_must_be_heard() -> None:
    watch = consumer(126 << 16 | 30, 5 << 16 | 100)
    watch.start(0)
    assert not watch.lost(30 * MS)
    watch.take(126, OPERATIONAL, 80 * MS)
    assert not watch.lost(100 * MS)
    assert watch.lost(100 * MS + 1)
    watch.take(5, OPERATIONAL, 100 * MS)
    assert watch.lost(110 * MS + 1)


def test_heartbeats_are_produced_on_a_grid_that_goes_on_while_they_are_mute() -> None:
    beat = HeartbeatProducer()
    assert (beat.since_ns, beat.mute) == (0, False)
    assert not beat.due(0, 10**12)
    assert not beat.due(20, 19)
    assert beat.due(20, 20)
    assert (beat.since_ns, beat.due(20, 39)) == (20, False)
    beat.mute = True
    assert not beat.due(20, 41)
    assert beat.since_ns == 41
    beat.mute = False
    assert not beat.due(20, 60)
    assert beat.due(20, 61)


# --- emergencies -----------------------------------------------------------------------------


def test_emergencies_leave_their_inhibit_time_between_them() -> None:
    values: dict[Key, int] = {(0x1015, 0): 25}
    outlet = EmergencyOutlet(values)
    frames = [Frame(0x81, bytes([number])) for number in range(4)]
    outlet.put(None, 0)
    assert outlet.take() == []
    for frame in frames[:3]:
        outlet.put(frame, 5 * MS)
    # 25 times 100 us, from each to the next.
    wanted = [(5 * MS, frames[0]), (7_500_000, frames[1]), (10 * MS, frames[2])]
    assert outlet.take() == wanted
    assert outlet.take() == []
    outlet.put(frames[3], 20 * MS)
    assert outlet.take() == [(20 * MS, frames[3])]


def test_emergencies_of_a_mute_drive_are_sent_later_or_forgotten() -> None:
    outlet = EmergencyOutlet({(0x1015, 0): 10})
    frame = Frame(0x81)
    outlet.mute()
    outlet.put(frame, MS)
    assert outlet.take() == []
    outlet.unmute(7 * MS)
    assert outlet.take() == [(7 * MS, frame)]
    outlet.put(frame, 7 * MS)
    outlet.mute()
    outlet.put(frame, 8 * MS)
    outlet.clear()
    outlet.unmute(9 * MS)
    assert outlet.take() == []
    # After power-on nothing inhibits.
    outlet.put(frame, 7 * MS)
    assert outlet.take() == [(7 * MS, frame)]


# --- what waits for the wire -----------------------------------------------------------------


def test_of_frames_that_are_ready_the_lowest_identifier_goes_first() -> None:
    queue = SendQueue()
    first, second, third = (cast(Any, name) for name in ("first", "second", "third"))
    assert not queue
    assert queue.put(first, 100, Frame(0x182)) == 1
    assert queue.put(second, 50, Frame(0x183)) == 2
    assert queue.put(third, 100, Frame(0x181)) == 3
    assert queue.put(first, 100, Frame(0x181, b"x")) == 4
    assert queue
    assert queue.earliest_ns == 50
    assert queue.pop(99).frame == Frame(0x183)
    assert queue.earliest_ns == 100
    # Of two with one identifier, the one that was handed over before.
    winner = queue.pop(100)
    assert (winner.frame, winner.sender) == (Frame(0x181), third)
    queue.put_back(winner, 120)
    assert queue.pop(110).frame == Frame(0x181, b"x")
    assert queue.pop(120) == winner._replace(ready_ns=120)
    queue.put(second, 0, Frame(0x100))
    queue.drop(first)
    assert queue.pop(200).sender is second
    assert not queue


def test_a_master_sends_in_its_own_order() -> None:
    queue = SendQueue()
    master, drive = Station(64, 1_000_000), cast(Any, "drive")
    queue.put(master, 10, Frame(0x602))
    queue.put(master, 0, Frame(0x080))
    queue.put(drive, 0, Frame(0x700))
    # Its SYNC waits for its request, once that is ready; a drive's frame waits for neither.
    assert queue.pop(10).frame == Frame(0x602)
    assert queue.pop(10).frame == Frame(0x080)
    assert queue.pop(10).frame == Frame(0x700)
    queue.put(master, 20, Frame(0x602))
    queue.put(master, 0, Frame(0x080))
    assert queue.pop(15).frame == Frame(0x080)


# --- encoders --------------------------------------------------------------------------------


def test_an_encoder_freezes_steps_or_drifts_and_heals() -> None:
    encoder = Encoder(1000.0)
    assert encoder.show(7) == 7
    encoder.disturb(0.0104)
    assert encoder.show(7) == 17
    encoder.fail(SensorFault.STEP, 0.5)
    assert encoder.show(7) == 17
    for _ in range(2):
        encoder.tick(MS)
        assert encoder.show(7) == 517
    encoder.disturb(0.0)
    encoder.fail(SensorFault.DRIFT, -2.0)
    assert encoder.show(7) == 7
    for step in (1, 2):
        encoder.tick(10 * MS)
        assert encoder.show(7) == 7 - 20 * step
    encoder.fail(SensorFault.FROZEN)
    assert encoder.show(900) == -33
    encoder.tick(MS)
    assert encoder.show(901) == -33
    encoder.fail(None)
    assert encoder.show(901) == 901


def test_both_encoders_have_their_own_resolution_and_fault() -> None:
    for place in (0, 1):
        here = node(place)
        sensors = Sensors(here)
        sensors.motor.fail(SensorFault.DRIFT, 0.5)
        sensors.link.fail(SensorFault.DRIFT, 0.25)
        sensors.tick(1000 * MS)
        assert sensors.motor.show(0) == round(0.5 * here.motor.counts_per_rad)
        assert sensors.link.show(0) == round(0.25 * here.link_units.counts_per_rad)


@pytest.mark.parametrize(
    ("entry", "scale", "shown"),
    [(None, 0.5, 250.0), (TENTHS, 0.5, 250.0), (Mapped(0x2071, 0, DataType.INTEGER8), 0.5, 50.0)],
)
def test_a_temperature_is_shown_in_the_unit_of_its_object(
    entry: Mapped | None, scale: float, shown: float
) -> None:
    assert (warmth.WARM, warmth.HOT) == (25.0, 90.0)
    told: list[tuple[Key, float]] = []
    for there in (True, False):
        store: Any = SimpleNamespace(
            entry=lambda key, there=there: there or None,
            show=lambda key, value: told.append((key, value)),
        )
        drive: Any = SimpleNamespace(temperature_object=entry, temperature_scale=scale)
        for key in ((0x2070, 0), None):
            show_temperature(store, cast(Any, SimpleNamespace(temperature=key)), drive, 25.0)
    assert told == [((0x2070, 0), pytest.approx(shown))]


# --- rules -----------------------------------------------------------------------------------


def test_identifiers_that_an_object_may_be_given_are_those_that_301_leaves() -> None:
    # CiA 301, table 40: restricted CAN-IDs.
    restricted = {
        *range(0x80),
        *range(0x101, 0x181),
        *range(0x581, 0x600),
        *range(0x601, 0x680),
        *range(0x6E0, 0x700),
        *range(0x701, 0x800),
    }
    for cob in range(0x900):
        for flags in (0, 1 << 31, 1 << 30, 3 << 30):
            assert usable(cob | flags) is (cob < 0x800 and cob not in restricted)
    assert not usable(1 << 29 | 0x181)


def test_a_word_of_1016h_asks_for_a_node_and_a_time() -> None:
    for node_id in (0, 1, 127, 128, 255):
        for time_ms in (0, 1, 65_535):
            asks = 1 <= node_id <= 127 and time_ms > 0
            assert watched(node_id << 16 | time_ms) == ((node_id, time_ms) if asks else None)


VALUES: dict[Key, int] = {(0x1006, 0): 0, (0x1016, 1): 0, (0x1016, 2): 0}
TAKES: dict[Key, set[int]] = {
    # CiA 301, 7.5.2; CiA 402-2: option codes.
    (0x1003, 0): {0},
    (0x1019, 0): {0, *range(2, 241)},
    (0x1029, 1): {0, 1, 2},
    (0x6007, 0): {0, 1, 2, 3},
    (0x605A, 0): set(range(9)),
    (0x605B, 0): {0, 1},
    (0x605C, 0): {0, 1},
    (0x605D, 0): {1, 2, 3, 4},
    (0x605E, 0): {0, 1, 2, 3, 4},
    (0x607E, 0): {0x00, 0x40, 0x80, 0xC0},
}


@pytest.mark.parametrize("key", list(TAKES))
def test_an_object_takes_the_values_of_the_standards(key: Key) -> None:
    assert set(rules.ALLOWED) == set(TAKES)
    for value in range(-3, 260):
        wanted = None if value in TAKES[key] else Abort.INVALID_VALUE
        assert objection(key, value, VALUES) is wanted
    # The counter of SYNC stays as it is while SYNC has a period.
    running = VALUES | {(0x1006, 0): 1000}
    kept = Abort.DEVICE_STATE if key == (0x1019, 0) else None
    assert objection(key, min(TAKES[key]), running) is kept


def test_sync_has_a_free_identifier_and_no_drive_produces_it() -> None:
    for value, wanted in (
        (0x80, None),
        (0x100, None),
        (0x101, Abort.INVALID_VALUE),
        (1 << 30 | 0x80, Abort.INVALID_VALUE),
    ):
        assert objection((0x1005, 0), value, VALUES) is wanted


@pytest.mark.parametrize("sub", [1, 2])
def test_no_node_is_watched_twice(sub: int) -> None:
    other = VALUES | {(0x1016, 3 - sub): 126 << 16 | 30}
    for word, wanted in (
        (126 << 16 | 10, Abort.INCOMPATIBLE),
        (125 << 16 | 10, None),
        (126 << 16, None),
        (0, None),
    ):
        assert objection((0x1016, sub), word, other) is wanted
    again = VALUES | {(0x1016, sub): 126 << 16 | 30}
    assert objection((0x1016, sub), 126 << 16 | 10, again) is None


# --- the wire --------------------------------------------------------------------------------


def test_frames_are_as_long_as_their_bits() -> None:
    for size in range(9):
        frame = Frame(0x555, b"\xaa" * size)
        plain = 47 + 8 * size
        assert bits_of(frame, Stuffing.NONE) == plain
        assert bits_of(frame, Stuffing.WORST) == plain + (34 + 8 * size - 1) // 4
        assert plain <= bits_of(frame, Stuffing.EXACT) <= bits_of(frame, Stuffing.WORST)
        wide = frame._replace(extended=True)
        assert bits_of(wide, Stuffing.NONE) == plain + 20


def test_error_frames_are_those_of_socketcan() -> None:
    # linux/can/error.h: CAN_ERR_PROT | CAN_ERR_BUSERROR, CAN_ERR_BUSOFF, CAN_ERR_CRTL with
    # CAN_ERR_CRTL_RX_OVERFLOW in data[1].
    found = (error_frames.ERROR_FRAME, error_frames.BUS_OFF_FRAME, error_frames.OVERFLOW_FRAME)
    assert [frame.cob_id for frame in found] == [0x88, 0x40, 0x04]
    assert [frame.data for frame in found] == [bytes(8), bytes(8), bytes((0, 1, 0, 0, 0, 0, 0, 0))]
    assert all(frame.error for frame in found)


class Channel:
    """A network with some drives and events at given times."""

    def __init__(self, name: str, drives: int, log: list[Any], *events: int) -> None:
        self.name, self.log, self.now_ns = name, log, 0
        self.events = list(events)
        self.drives = [
            SimpleNamespace(tick=lambda now_ns, at=at: self._tick(at, now_ns))
            for at in range(drives)
        ]

    def _tick(self, at: int, now_ns: int) -> str:
        self.log.append((self.name, at, now_ns))
        return f"{self.name}{at}"

    def upcoming(self) -> tuple[int, Any]:
        def happen() -> None:
            self.log.append((self.name, self.events.pop(0), self.now_ns))

        return (self.events[0] if self.events else 10**9, happen)


def test_channels_move_one_body_together_once_a_tick() -> None:
    log: list[Any] = []

    def body(motors: tuple[Any, ...]) -> tuple[list[str], list[str]]:
        log.append(motors)
        return [f"link {motor}" for motor in motors], [f"torque {motor}" for motor in motors]

    shared = SharedBody(cast(Any, body))
    channels = [Channel("a", 1, log), Channel("b", 2, log)]
    shared.join(cast(Any, channels))
    for channel in channels:
        channel.now_ns = 5
    own: Any = (0.0, 0.0)
    assert shared.part(1)(own) == (["link b0", "link b1"], ["torque b0", "torque b1"])
    assert shared.part(0)(own[:1]) == (["link a0"], ["torque a0"])
    assert log == [("a", 0, 5), ("b", 0, 5), ("b", 1, 5), ("a0", "b0", "b1")]
    channels[0].now_ns = 6
    shared.part(0)(own[:1])
    assert log[4:] == [("a", 0, 6), ("b", 0, 6), ("b", 1, 6), ("a0", "b0", "b1")]


def test_events_of_all_channels_come_in_the_order_of_their_times() -> None:
    log: list[Any] = []
    channels = [Channel("a", 0, log, 10, 30, 70), Channel("b", 0, log, 20, 30, 40)]
    together = LockstepChannels(cast(Any, channels))
    assert together.next_ns() == 10
    together.wait_until(35)
    assert log == [("a", 10, 10), ("b", 20, 20), ("a", 30, 30), ("b", 30, 30)]
    assert [channel.now_ns for channel in channels] == [35, 35]
    assert (together.now_ns(), together.next_ns()) == (35, 40)
    # Until a frame has come for somebody: at once, where one is there already.
    station = cast(Any, SimpleNamespace(received=[1]))
    together.advance(100, [station])
    assert together.now_ns() == 35
    station.received = []
    together.advance(40, [station])
    assert log[4:] == [("b", 40, 40)]
    together.advance(38)
    assert together.now_ns() == 40


# --- faults ----------------------------------------------------------------------------------


def window(kind: FrameFaultKind, cob_id: int | None = 0x181, **how: int) -> FrameFault:
    return FrameFault(kind=kind, cob_id=cob_id, start_ns=100, end_ns=200, **how)


F = FrameFaultKind
ANSWER = Frame(0x181, b"abcd")


@pytest.mark.parametrize(
    ("fault", "arrives"),
    [
        (window(F.DROP), ()),
        (window(F.DROP, None), ()),
        (window(F.DROP, 0x182), ((0, ANSWER),)),
        (window(F.DELAY, delay_ns=30), ((30, ANSWER),)),
        (window(F.DELAY), ((1, ANSWER),)),
        (window(F.DUPLICATE, delay_ns=30), ((0, ANSWER), (30, ANSWER))),
        (window(F.DUPLICATE), ((0, ANSWER), (1, ANSWER))),
        (window(F.WRONG_LENGTH, length=3), ((0, Frame(0x181, b"abc")),)),
        (window(F.WRONG_LENGTH, length=6), ((0, Frame(0x181, b"abcd\0\0")),)),
        (window(F.BAD_BITS), ((0, ANSWER),)),
    ],
)
def test_a_frame_has_its_fate_within_the_window_of_a_fault(
    fault: FrameFault, arrives: tuple[tuple[int, Frame], ...]
) -> None:
    injector = Injector([fault])
    for now_ns, struck in ((99, False), (100, True), (199, True), (200, False)):
        assert injector.fate(ANSWER, now_ns) == (arrives if struck else ((0, ANSWER),))
        broken = struck and fault.kind is F.BAD_BITS
        assert injector.breaks(ANSWER, now_ns) is broken
    assert Injector([]).fate(ANSWER, 150) == ((0, ANSWER),)


def test_a_fault_of_a_node_begins_once_and_ends_once() -> None:
    first = NodeFault(kind=NodeFaultKind.SILENT, node_id=1, start_ns=100, end_ns=200)
    second = NodeFault(kind=NodeFaultKind.RESET, node_id=2, start_ns=150)
    injector = Injector([first])
    injector.add(second)
    seen = {now: list(injector.node_events(now)) for now in (99, 100, 149, 150, 199, 200, 300)}
    assert {now: events for now, events in seen.items() if events} == {
        100: [(first, True)],
        150: [(second, True)],
        200: [(first, False)],
    }
    injector = Injector([first])
    assert not injector.silent(1, 100)
    list(injector.node_events(100))
    assert (injector.silent(1, 100), injector.silent(2, 100)) == (True, False)
    list(injector.node_events(200))
    assert not injector.silent(1, 200)


def test_all_faults_that_begin_or_end_together_do() -> None:
    faults = [
        NodeFault(kind=NodeFaultKind.SILENT, node_id=place, start_ns=100, end_ns=200)
        for place in (1, 2, 3)
    ]
    injector = Injector(faults)
    assert list(injector.node_events(100)) == [(fault, True) for fault in faults]
    assert list(injector.node_events(200)) == [(fault, False) for fault in faults]


def test_a_babbling_node_sends_all_the_time() -> None:
    babble = Babble(cob_id=1, start_ns=100, end_ns=200, every_ns=10)
    injector = Injector([babble])
    for now_ns, span_ns, count in ((99, 35, 0), (100, 35, 3), (199, 5, 1), (200, 35, 0)):
        assert list(injector.babble(now_ns, span_ns)) == [Frame(1, bytes(8))] * count


class Struck:
    """A drive that notes what strikes it."""

    def __init__(self) -> None:
        self.log: list[Any] = []
        note = self.log.append
        self.axis: Any = SimpleNamespace(
            warning=None,
            motion=SimpleNamespace(jammed=None),
            sensors=SimpleNamespace(
                motor=SimpleNamespace(fail=lambda *how: note(("motor", *how))),
                link=SimpleNamespace(fail=lambda *how: note(("link", *how))),
            ),
        )
        self.trip = lambda code, now_ns: note(("trip", code, now_ns))
        self.clear_trip = lambda code: note(("clear", code))
        self.mute_heartbeat = lambda mute: note(("mute", mute))
        self.reset = lambda now_ns: note(("reset", now_ns))
        self.bus_off = lambda now_ns: note(("off", now_ns))
        self.repeat_process_data = lambda repeats: note(("repeats", repeats))


K = NodeFaultKind
STRIKES: dict[NodeFaultKind, tuple[list[Any], list[Any]]] = {
    K.UNDER_VOLTAGE: ([("trip", 0x3220, 7)], [("clear", 0x3220)]),
    K.OVER_TEMPERATURE: ([("trip", 0x4310, 7)], [("clear", 0x4310)]),
    K.HEARTBEAT_LOSS: ([("mute", True)], [("mute", False)]),
    K.RESET: ([("reset", 7)], []),
    K.BUS_OFF: ([("off", 7)], []),
    K.REPEATING: ([("repeats", True)], [("repeats", False)]),
    K.MOTOR_FROZEN: ([("motor", SensorFault.FROZEN, 0.5)], [("motor", None, 0.5)]),
    K.MOTOR_STEP: ([("motor", SensorFault.STEP, 0.5)], [("motor", None, 0.5)]),
    K.MOTOR_DRIFT: ([("motor", SensorFault.DRIFT, 0.5)], [("motor", None, 0.5)]),
    K.LINK_FROZEN: ([("link", SensorFault.FROZEN, 0.5)], [("link", None, 0.5)]),
    K.LINK_STEP: ([("link", SensorFault.STEP, 0.5)], [("link", None, 0.5)]),
    K.LINK_DRIFT: ([("link", SensorFault.DRIFT, 0.5)], [("link", None, 0.5)]),
    K.SILENT: ([], []),
    K.WARNING: ([], []),
    K.JAMMED: ([], []),
}


@pytest.mark.parametrize("kind", list(NodeFaultKind))
def test_each_fault_strikes_its_part_of_a_drive_and_leaves_it(kind: NodeFaultKind) -> None:
    drive = Struck()
    fault = NodeFault(kind=kind, node_id=1, start_ns=0, size=0.5)
    for begins, wanted in zip((True, False), STRIKES[kind], strict=True):
        drive.log.clear()
        Injector.strike(cast(Any, drive), fault, 7, begins=begins)
        assert drive.log == wanted
        shown = (drive.axis.warning, drive.axis.motion.jammed)
        assert shown == (
            begins if kind is K.WARNING else None,
            begins if kind is K.JAMMED else None,
        )
    assert Injector.cuts_off(fault) is (kind is K.BUS_OFF)


# --- dictionaries ----------------------------------------------------------------------------


def test_a_dictionary_names_the_objects_of_the_profile() -> None:
    # CiA 402-2: 6060h, 6061h and 8, cyclic synchronous position; 6080h max motor speed.
    assert (dictionary.MODE, dictionary.MODE_DISPLAY, dictionary.CYCLIC) == (
        (0x6060, 0),
        (0x6061, 0),
        8,
    )
    assert (dictionary.MAX_SPEED, dictionary.EMCY) == ((0x6080, 0), (0x1014, 0))
    assert dictionary.USUAL_LINKS == ((0x60E4, 1), (0x2064, 0))
    # COB-IDs of four PDOs each way.
    assert {(base + n, 1) for base in (0x1400, 0x1800) for n in range(4)} == dictionary.RELATIVE
    for place in (0, 1):
        found = {entry.key: entry.default for entry in dictionary_of(node(place)).entries}
        assert found[0x1014, 0] == 0x81 + place
        assert found[0x1803, 1] == (1 << 31) + 0x481 + place
        assert [found[0x1018, sub] for sub in (1, 2, 3, 4)] == [0x1234, 7, 0, 100 + place]


def test_a_value_is_held_for_the_bus_alone_where_it_is_a_number() -> None:
    for kind, default, shown in (
        (DataType.UNSIGNED32, 5, b"\x05\0\0\0"),
        (DataType.REAL32, 1.0, b"\0\0\x80\x3f"),
    ):
        entry = ObjectEntry(0x6080, 0, "it", kind, Access.RW, default)
        held = _shown_only(entry)
        assert (held.kind, held.default) == (DataType.OCTET_STRING, shown)
    for kind, default in ((DataType.VISIBLE_STRING, "text"), (DataType.UNSIGNED32, b"\x01")):
        entry = ObjectEntry(0x6080, 0, "it", kind, Access.RW, default)
        assert _shown_only(entry) is entry


def test_limits_of_an_object_refuse_what_lies_beyond() -> None:
    limited = Dictionary(entries=(), limits={(0x6085, 0): (10, 100)})
    for value, wanted in ((9, Abort.TOO_LOW), (10, None), (100, None), (101, Abort.TOO_HIGH)):
        assert limited.refusal((0x6085, 0), value) is wanted
        assert limited.refusal((0x6084, 0), value) is None


def test_a_drive_behaves_by_default_as_is_written_here() -> None:
    usual = Behaviour()
    assert (usual.reply_delay_us, usual.seed, usual.boot_us) == ((50, 250), 0, 5000)
    assert (usual.missing_limit, usual.sync_loss_periods) == (3, 5)
    assert (usual.status_lag_us, usual.mode_lag_us, usual.setpoint_delay) == (0, 2000, 0)
    assert (usual.rpdos, usual.tpdos, usual.start_pos, usual.rated_torque) == (4, 4, 0.0, 10.0)
    assert (usual.missing_setpoint, usual.sdo_answers) == (MissingSetpoint.HOLD, SdoAnswers.SIZED)
    assert usual.lacking is Abort.NO_OBJECT
    on = (usual.interpolate, usual.follows_bit, usual.halt_blocks_mode)
    off = (usual.slow_loop, usual.mode_needs_power, usual.fixed_mapping)
    assert (set(on), set(off)) == ({True}, {False})
    assert (usual.ignores, usual.lacks) == (frozenset(), frozenset())
    assert (usual.defaults, usual.warnings) == ((), ())
    nothing = (usual.bandwidth, usual.slew_rate, usual.motor_noise, usual.hard_stop)
    assert set(nothing) == {None}
    assert usual.home_switch is None
    ideal = Behaviour.ideal(0.5)
    assert ideal == Behaviour(reply_delay_us=(0, 0), interpolate=False, start_pos=0.5)


class Power:
    """The power stage and the alarms of a drive, as its connection sees them."""

    def __init__(self, *, option: int = 3, faulted: bool = False) -> None:
        self.log: list[Any] = []
        note = self.log.append
        alarms = SimpleNamespace(
            raise_=lambda code: Frame(0x81, code.to_bytes(2, "little")),
            clear=lambda code: Frame(0x82, code.to_bytes(2, "little")),
        )
        power = SimpleNamespace(faulted=faulted, connection_lost=lambda: note("stop"))
        axis: Any = SimpleNamespace(
            alarms=alarms, power=power, take=lambda: [Frame(0x83), Frame(0x84)]
        )
        self.connection = Connection(axis, {(0x6007, 0): option, (0x1015, 0): 0})

    def sent(self) -> list[tuple[int, str]]:
        return [(frame.cob_id, frame.data.hex()) for _, frame in self.connection.outlet.take()]


def test_what_a_connection_reports_and_when_it_stops() -> None:
    it = Power()
    it.connection.report(0x8250, 5)
    it.connection.over(0x8250, 6)
    it.connection.forward(7)
    assert it.sent() == [(0x81, "5082"), (0x82, "5082"), (0x83, ""), (0x84, "")]
    assert it.log == []
    it.connection.lost(0x8130, 8)
    assert (it.sent(), it.log) == ([(0x81, "3081")], ["stop"])
    # A fault keeps its reason until it is reset.
    it = Power(faulted=True)
    it.connection.over(0x8250, 6)
    assert it.sent() == []


@pytest.mark.parametrize("option", [0, 1, 2, 3])
@pytest.mark.parametrize("faulted", [False, True])
def test_a_connection_that_nmt_ends_is_an_error_where_it_is_a_fault(
    option: int, faulted: bool
) -> None:
    it = Power(option=option, faulted=faulted)
    it.connection.end(5)
    told = option == 1 and not faulted
    assert it.sent() == ([(0x81, "0081")] if told else [])
    assert it.log == ["stop"]


def test_a_drive_off_the_bus_stops_at_once_and_tells_when_it_is_back() -> None:
    it = Power()
    it.connection.leave_bus(5)
    assert (it.sent(), it.log) == ([], ["stop"])
    it.connection.rejoin_bus(9)
    assert it.sent() == [(0x81, "4081"), (0x82, "4081")]
