"""Frames and objects over a bus that fails, is late or talks of other things, in virtual time."""

from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

import can
import pytest

from legbench.drives.errors import BusError, DriveError, NoAnswerError, SdoAbortError
from legbench.drives.master.port import Port
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.sdo import Abort, abort_data

MS = 1_000_000
RESPONSE = 0x581


class Clock:
    """Time that passes when somebody waits."""

    def __init__(self) -> None:
        self.now = 50_000 * MS

    def now_ns(self) -> int:
        return self.now

    def wait_until(self, at_ns: int) -> None:
        self.now = max(self.now, at_ns)


class Wire(can.BusABC):
    """A bus whose answers are written down: what comes when, and what sending does."""

    def __init__(self, clock: Clock) -> None:
        self.channel_info = "wire"
        self.clock = clock
        self.sent: list[Frame] = []
        self.coming: deque[tuple[int, can.Message]] = deque()
        """When [ns], and what."""
        self.on_send: Callable[[Frame], None] = lambda frame: None
        self.broken: Exception | None = None
        super().__init__(channel="wire")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        if self.broken is not None:
            raise self.broken
        frame = Frame(msg.arbitration_id, bytes(msg.data))
        self.sent.append(frame)
        self.on_send(frame)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if self.broken is not None:
            raise self.broken
        until_ns = self.clock.now + round(1e9 * (timeout or 0.0))
        if self.coming and self.coming[0][0] <= until_ns:
            at_ns, message = self.coming.popleft()
            self.clock.wait_until(at_ns)
            return message
        self.clock.wait_until(until_ns)
        return None

    def give(self, cob_id: int, data: bytes, after_ms: float = 0.0, **kind: Any) -> None:
        """A frame that comes so long from now."""
        message = can.Message(
            arbitration_id=cob_id, data=data, timestamp=1e-9 * self.clock.now, is_extended_id=False
        )
        for name, value in kind.items():
            setattr(message, name, value)
        self.coming.append((self.clock.now + round(after_ms * MS), message))


@pytest.fixture
def wire() -> Iterator[Wire]:
    bus = Wire(Clock())
    yield bus
    bus.shutdown()


def port_of(wire: Wire) -> Port:
    return Port(wire, wire.clock)


# --- the port --------------------------------------------------------------------------------


def test_frames_go_out_as_they_are_and_the_listener_sees_them_stamped(wire: Wire) -> None:
    port, seen = port_of(wire), list[tuple[float, int]]()
    port.listener = lambda message: seen.append((message.timestamp, message.arbitration_id))
    port.send(0x601, b"\1\2")
    port.send_frame(Frame(0x080))
    assert wire.sent == [Frame(0x601, b"\1\2"), Frame(0x080)]
    assert seen == [(pytest.approx(50.0), 0x601), (pytest.approx(50.0), 0x080)]
    message = Port.message(0x123, b"\7")
    assert not message.is_extended_id
    assert not message.is_rx


def test_what_may_not_be_sent_is_named_and_not_sent(wire: Wire) -> None:
    port = port_of(wire)
    port.may_send = lambda cob_id, data: cob_id == 0x080
    port.send(0x080)
    with pytest.raises(DriveError, match="read-only: 201#0F00 is not sent"):
        port.send(0x201, b"\x0f\0")
    assert wire.sent == [Frame(0x080)]


@pytest.mark.parametrize("error", [can.CanOperationError("no buffer"), ValueError("bad line")])
def test_whatever_a_driver_raises_is_a_bus_error_that_says_where(
    wire: Wire, error: Exception
) -> None:
    port = port_of(wire)
    wire.broken = error
    with pytest.raises(BusError, match=f"wire: cannot send: {error}; look at `ip -details"):
        port.send(0x080)
    for receive in (lambda: port.receive(wire.clock.now + MS), port.take):
        with pytest.raises(BusError, match=f"wire: cannot receive: {error}; look at"):
            receive()
    wire.broken = DriveError("our own words")
    for act in (lambda: port.send(0x080), port.take):
        with pytest.raises(DriveError, match=r"^our own words$"):
            act()


def test_receiving_waits_to_its_end_and_no_longer(wire: Wire) -> None:
    port, start = port_of(wire), wire.clock.now
    assert port.receive(start + 7 * MS) is None
    assert wire.clock.now == start + 7 * MS
    wire.give(0x181, b"", after_ms=3)
    message = port.receive(start + 20 * MS)
    assert message is not None
    assert message.arbitration_id == 0x181
    assert wire.clock.now == start + 10 * MS
    # What has come already is taken even when the end has passed.
    wire.give(0x182, b"")
    assert port.receive(start) is not None
    assert port.receive(start) is None
    assert wire.clock.now == start + 10 * MS


def test_remote_and_extended_frames_are_passed_over_error_frames_counted(wire: Wire) -> None:
    for take in (lambda port: port.receive(wire.clock.now + MS), lambda port: port.take()):
        port = port_of(wire)
        wire.give(0x181, b"", is_remote_frame=True)
        wire.give(0x181, b"", is_extended_id=True)
        wire.give(0x088, bytes(8), is_error_frame=True)
        wire.give(0x182, b"")
        message = take(port)
        assert message is not None
        assert message.is_error_frame
        assert port.error_frames == 1
        message = take(port)
        assert message is not None
        assert message.arbitration_id == 0x182
        assert port.error_frames == 1
        assert take(port) is None


def test_frames_not_for_us_do_not_hold_it_beyond_its_end(wire: Wire) -> None:
    port, start = port_of(wire), wire.clock.now
    for after_ms in (1, 2, 3):
        wire.give(0x181, b"", after_ms=after_ms, is_extended_id=True)
    wire.give(0x182, b"", after_ms=4)
    assert port.receive(start + 2 * MS) is None
    assert wire.clock.now == start + 2 * MS


@pytest.mark.parametrize(
    ("age_s", "kept"),
    [(0.0, True), (0.5, True), (9.99, True), (10.01, False), (-0.01, False), (1e6, False)],
)
def test_a_stamp_of_our_clock_is_kept_and_any_other_is_now(
    wire: Wire, monkeypatch: pytest.MonkeyPatch, age_s: float, kept: bool
) -> None:
    monkeypatch.setattr("time.time", lambda: 1.7e9)
    port, seen = port_of(wire), list[float]()
    port.listener = lambda message: seen.append(message.timestamp)
    now = 1e-9 * wire.clock.now
    wire.give(0x181, b"", timestamp=now - age_s)
    port.take()
    assert seen == [pytest.approx(now - age_s if kept else now, abs=1e-6)]
    # The system's clock is another one, and is brought to ours.
    wire.give(0x181, b"", timestamp=1.7e9 - age_s)
    port.take()
    assert seen[1] == pytest.approx(now - age_s if kept else now, abs=1e-5)


def test_a_listener_that_fails_is_told_once_and_hears_nothing_more(wire: Wire) -> None:
    def fail(message: can.Message) -> None:
        raise OSError("disk full")

    port = port_of(wire)
    port.listener = fail
    port.send(0x080)
    assert port.listener_error == "OSError: disk full"
    port.send(0x080)
    assert port.listener is None
    assert len(wire.sent) == 2


def test_a_controller_off_the_bus_is_one_whose_driver_says_so(
    wire: Wire, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = port_of(wire)
    for state, off in (
        (can.BusState.ACTIVE, False),
        (can.BusState.PASSIVE, False),
        (can.BusState.ERROR, True),
    ):
        monkeypatch.setattr(Wire, "state", property(lambda _, state=state: state))
        assert port.off_bus == off

    def fail(_: object) -> can.BusState:
        raise NotImplementedError

    monkeypatch.setattr(Wire, "state", property(fail))
    assert not port.off_bus


def test_whose_frame_it_is_is_known_where_the_bus_gives_back_our_own(wire: Wire) -> None:
    port = port_of(wire)
    assert port.foreign(can.Message(is_rx=True))
    assert not port.foreign(can.Message(is_rx=False))


# --- objects over the port -------------------------------------------------------------------


def answer(*replies: bytes | None, after_ms: float = 0.1) -> Callable[[Wire], None]:
    """A drive that answers one request after the other; None is silence."""

    def attach(wire: Wire) -> None:
        left = deque(replies)

        def on_send(frame: Frame) -> None:
            if frame.data[0] == 0x80 or not left:
                return
            reply = left.popleft()
            if reply is not None:
                wire.give(RESPONSE, reply, after_ms)

        wire.on_send = on_send

    return attach


POSITION = bytes.fromhex("4364600078563412")
READ = Frame(0x601, bytes.fromhex("4064600000000000"))
TIMED_OUT = Frame(0x601, bytes.fromhex("8064600000000405"))


def test_an_object_is_read_and_written(wire: Wire) -> None:
    sdo = SdoPort(port_of(wire), 1)
    answer(POSITION)(wire)
    assert sdo.get_int(0x6064, 0, DataType.INTEGER32) == 0x12345678
    assert wire.sent == [READ]
    answer(bytes.fromhex("6060600000000000"))(wire)
    sdo.put(0x6060, 0, DataType.INTEGER8, -1)
    assert wire.sent[1] == Frame(0x601, bytes.fromhex("2f606000ff000000"))


@pytest.mark.parametrize(("timeout_ms", "retries"), [(200, 3), (50, 1), (7, 5)])
def test_a_node_that_is_silent_is_asked_so_often_and_each_time_told_to_forget(
    wire: Wire, timeout_ms: int, retries: int
) -> None:
    sdo, start = SdoPort(port_of(wire), 1, timeout_ms=timeout_ms, retries=retries), wire.clock.now
    words = (
        f"node 1 on wire does not answer for 6064h:00 .* within {timeout_ms} ms, {retries} times"
    )
    with pytest.raises(NoAnswerError, match=words):
        sdo.read(0x6064)
    assert wire.sent == [READ, TIMED_OUT] * retries
    assert wire.clock.now - start == timeout_ms * retries * MS


def test_by_default_a_node_has_200_ms_three_times(wire: Wire) -> None:
    start = wire.clock.now
    with pytest.raises(NoAnswerError):
        SdoPort(port_of(wire), 1).read(0x6064)
    assert wire.clock.now - start == 600 * MS


def test_an_answer_to_the_last_try_is_one(wire: Wire) -> None:
    answer(None, None, POSITION)(wire)
    assert SdoPort(port_of(wire), 1).read(0x6064) == bytes.fromhex("78563412")
    assert wire.sent == [READ, TIMED_OUT, READ, TIMED_OUT, READ]


def test_each_segment_has_the_whole_time(wire: Wire) -> None:
    first = bytes.fromhex("4108100014000000")
    segments = [bytes((16 * (place % 2),)) + bytes(7) for place in range(2)]
    answer(first, *segments, b"\x03" + bytes(7), after_ms=9)(wire)
    assert len(SdoPort(port_of(wire), 1, timeout_ms=10).read(0x1008)) == 20


def test_frames_of_others_go_to_who_wants_them_and_hold_nothing_up(wire: Wire) -> None:
    others: list[int] = []
    port = port_of(wire)
    sdo = SdoPort(
        port, 1, timeout_ms=10, retries=1, on_other=lambda m: others.append(m.arbitration_id)
    )
    wire.give(0x182, b"", 1)
    wire.give(RESPONSE, bytes(8), 2, is_error_frame=True)
    wire.give(0x582, POSITION, 3)
    wire.give(RESPONSE, bytes.fromhex("4365600078563412"), 4)
    wire.give(RESPONSE, POSITION, 5)
    assert sdo.read(0x6064) == bytes.fromhex("78563412")
    assert others == [0x182, RESPONSE, 0x582]
    # A node that babbles is no answer, and does not put the end off.
    start = wire.clock.now
    for place in range(20):
        wire.give(0x182, b"", 0.9 * place)
    with pytest.raises(NoAnswerError):
        sdo.read(0x6064)
    assert wire.clock.now - start <= 11 * MS


def test_a_refusal_is_told_with_the_node_and_the_object(wire: Wire) -> None:
    answer(abort_data(Abort.READ_ONLY, 0x6064, 0))(wire)
    with pytest.raises(SdoAbortError, match=r"^node 1, 6064h:00 .*read only") as caught:
        SdoPort(port_of(wire), 1).read(0x6064)
    assert caught.value.code == Abort.READ_ONLY
    # It is over on both sides: nothing more is said.
    assert wire.sent == [READ]


def test_a_broken_protocol_is_told_to_the_drive_too(wire: Wire) -> None:
    answer(bytes.fromhex("4108100014000000"), b"\x10" + bytes(7))(wire)
    with pytest.raises(SdoAbortError, match="toggle bit"):
        SdoPort(port_of(wire), 1).read(0x1008)
    assert wire.sent[-1] == Frame(0x601, abort_data(Abort.TOGGLE, 0x1008, 0))


def test_a_value_of_another_type_is_named(wire: Wire) -> None:
    sdo = SdoPort(port_of(wire), 1)
    answer(POSITION, bytes.fromhex("4308100061626364"))(wire)
    with pytest.raises(DriveError, match=r"node 1, 6064h:00 .*: 4 bytes are no INTEGER16"):
        sdo.get(0x6064, 0, DataType.INTEGER16)
    with pytest.raises(DriveError, match=r"node 1, 1008h:00 .* is no number"):
        sdo.get_int(0x1008, 0, DataType.VISIBLE_STRING)


def test_the_bus_is_looked_at_before_each_write_and_before_no_question(wire: Wire) -> None:
    looks: list[int] = []
    sdo = SdoPort(
        Port(wire, wire.clock),
        1,
        timeout_ms=10,
        retries=2,
        before_write=lambda: looks.append(len(wire.sent)),
    )
    with pytest.raises(NoAnswerError):
        sdo.get_int(0x6064, 0, DataType.INTEGER32)
    assert looks == []
    wire.sent.clear()
    with pytest.raises(NoAnswerError):
        sdo.put(0x607A, 0, DataType.INTEGER32, 5)
    # Before the first try and before the second, behind the abort of the first.
    assert looks == [0, 2]
