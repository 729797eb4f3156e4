"""Faults of frames and nodes in their windows, frames by their bits, channels in lock-step."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from legbench.drives.emulated import error_frames
from legbench.drives.emulated.faults import (
    FOREVER_NS,
    Babble,
    FrameFault,
    FrameFaultKind,
    NodeFault,
    NodeFaultKind,
)
from legbench.drives.emulated.injector import Injector
from legbench.drives.emulated.sensors import SensorFault
from legbench.drives.emulated.shared_body import LockstepChannels, SharedBody
from legbench.drives.emulated.stuffing import Stuffing, bits_of
from legbench.drives.protocol.frame import Frame

OPERATIONAL = b"\x05"

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
        channel.now_ns = 1
    own: Any = (0.0, 0.0)
    assert shared.part(1)(own) == (["link b0", "link b1"], ["torque b0", "torque b1"])
    assert shared.part(0)(own[:1]) == (["link a0"], ["torque a0"])
    assert log == [("a", 0, 1), ("b", 0, 1), ("b", 1, 1), ("a0", "b0", "b1")]
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
    assert injector.unplugged == set()
    list(injector.node_events(100))
    assert injector.unplugged == {1}
    list(injector.node_events(200))
    assert injector.unplugged == set()


def test_all_faults_that_begin_or_end_together_do() -> None:
    faults = [
        NodeFault(kind=NodeFaultKind.SILENT, node_id=place, start_ns=100, end_ns=200)
        for place in (1, 2, 3)
    ]
    injector = Injector(faults)
    assert list(injector.node_events(100)) == [(fault, True) for fault in faults]
    assert list(injector.node_events(200)) == [(fault, False) for fault in faults]


def test_a_fault_lasts_for_ever_unless_it_says_how_long() -> None:
    # 146 years, and a number of 64 bits still.
    assert FOREVER_NS == 4_611_686_018_427_387_904
    frame = FrameFault(kind=F.DROP)
    assert (frame.cob_id, frame.start_ns, frame.end_ns) == (None, 0, FOREVER_NS)
    assert (frame.delay_ns, frame.length) == (0, 0)
    of_node = NodeFault(kind=NodeFaultKind.RESET, node_id=1, start_ns=5)
    assert (of_node.end_ns, of_node.size) == (FOREVER_NS, 0.0)
    assert Babble(cob_id=1, start_ns=0, end_ns=1, every_ns=1).data == bytes(8)


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
