"""How many answers a question gets, over SDO and over LSS, and how long they are awaited."""

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, cast

import can
import pytest
from drives_rig import MS, config

from legbench.commissioning.node_id import _restart
from legbench.drives.errors import DriveError
from legbench.drives.master.doubles import count_answers
from legbench.drives.master.lss_port import LssPort
from legbench.drives.master.port import Port
from legbench.drives.protocol.nmt import NmtCommand

NODE = 5
QUESTION = bytes.fromhex("4018100400000000")
"""Upload of 1018h:04 (CiA 301, 7.2.4.3.5)."""
ANSWER = bytes.fromhex("4318100401020304")
ERROR = can.Message(arbitration_id=0x08, data=bytes(8), is_error_frame=True)


def reply(data: bytes = ANSWER, cob_id: int = 0x580 + NODE) -> can.Message:
    return can.Message(arbitration_id=cob_id, data=data, is_extended_id=False)


class Scripted:
    """A bus in virtual time: each question is followed by messages after so many milliseconds."""

    channel_info = "scripted"

    def __init__(self, *scripts: Sequence[tuple[float, can.Message]]) -> None:
        self.time_ns = 0
        self.sent: list[tuple[int, bytes]] = []
        self._scripts = list(scripts)
        self._due: list[tuple[int, can.Message]] = []

    def now_ns(self) -> int:
        return self.time_ns

    def wait_until(self, at_ns: int) -> None:
        self.time_ns = max(self.time_ns, at_ns)

    def send(self, message: can.Message) -> None:
        self.sent.append((message.arbitration_id, bytes(message.data)))
        for after_ms, answer in self._scripts.pop(0) if self._scripts else ():
            self._due.append((self.time_ns + round(after_ms * MS), answer))

    def recv(self, timeout: float | None = None) -> can.Message | None:
        until_ns = self.time_ns + round(1e9 * (timeout or 0.0))
        if self._due and self._due[0][0] <= until_ns:
            at_ns, message = self._due.pop(0)
            self.time_ns = max(self.time_ns, at_ns)
            return message
        self.time_ns = until_ns
        return None


def counted(*scripts: Sequence[tuple[float, can.Message]]) -> tuple[int, float]:
    """Answers that are counted, and the time that it takes [ms]."""
    bus = Scripted(*scripts)
    answers = count_answers(Port(cast(Any, bus), bus), NODE, 0x1018, 4)
    assert bus.sent == [(0x600 + NODE, QUESTION)] * 3
    return answers, bus.time_ns / MS


ONE = [(3.0, reply())]
TWO = [(3.0, reply()), (10.0, reply())]
REST, PATIENCE, ECHO = 15.0, 100.0, 15.0
"""Rest before a question, wait for the first answer, and for a second one after it [ms]."""


def test_nobody_is_waited_for_three_times() -> None:
    assert counted([], [], []) == (0, 3 * (REST + PATIENCE))


def test_one_drive_answers_once_and_is_not_waited_for_any_longer() -> None:
    assert counted(ONE, ONE, ONE) == (1, 3 * (REST + 3.0 + ECHO))
    assert counted([], ONE, []) == (1, 3 * REST + 2 * PATIENCE + 3.0 + ECHO)


@pytest.mark.parametrize("place", [0, 1, 2])
def test_the_question_with_most_answers_counts(place: int) -> None:
    scripts = [ONE, ONE, ONE]
    scripts[place] = TWO
    assert counted(*scripts) == (2, 3 * (REST + 3.0 + ECHO))
    scripts[place] = [(3.0, reply()), (4.0, reply()), (17.9, reply())]
    assert counted(*scripts)[0] == 3
    # An answer long after the first is one to an earlier question, and is discarded.
    scripts[place] = [(3.0, reply()), (18.5, reply())]
    assert counted(*scripts)[0] == 1


@pytest.mark.parametrize(
    "other",
    [
        reply(cob_id=0x580 + NODE + 1),
        reply(cob_id=0x180 + NODE),
        reply(ANSWER[:7]),
        reply(b""),
        reply(bytes.fromhex("4318100301020304")),
        reply(bytes.fromhex("4319100401020304")),
    ],
)
def test_what_answers_another_question_is_no_answer(other: can.Message) -> None:
    assert counted([(3.0, other)], [], [])[0] == 0
    assert counted([(3.0, reply()), (4.0, other)], ONE, ONE)[0] == 1


def test_answers_that_collide_destroy_frames_and_count_as_a_second_one() -> None:
    assert counted(ONE, [(2.0, ERROR), (3.0, reply())], ONE)[0] == 2
    assert counted(ONE, [(3.0, reply()), (4.0, ERROR), (5.0, ERROR)], ONE)[0] == 2
    # Errors without any answer are a fault of the bus, and show no drive.
    assert counted([(2.0, ERROR)], [], [])[0] == 0
    shown = can.Message(arbitration_id=0x585, data=ANSWER, is_error_frame=True)
    assert counted([(2.0, shown)], [], [])[0] == 0


# --- layer setting services ------------------------------------------------------------------

SELECTED = bytes.fromhex("4400000000000000")


def lss(data: bytes = SELECTED, cob_id: int = 0x7E4) -> can.Message:
    return reply(data, cob_id)


def test_all_answers_right_after_the_first_are_taken_and_nothing_else() -> None:
    other = bytes.fromhex("4f00000000000000")
    for wait_ms in (500, 25):
        script = [
            (1.0, lss(SELECTED, 0x585)),
            (1.5, can.Message(arbitration_id=0x7E4, data=SELECTED, is_error_frame=True)),
            (2.0, lss(SELECTED[:7])),
            (4.0, lss()),
            (9.0, lss(other)),
            # 15 ms after the first answer nobody is waited for any more.
            (19.5, lss()),
        ]
        bus = Scripted(script)
        port = LssPort(Port(cast(Any, bus), bus))
        asked = bytes.fromhex("5e00000000000000")
        answers = port.ask(asked) if wait_ms == 500 else port.ask(asked, wait_ms * MS)
        assert bus.sent == [(0x7E5, asked)]
        assert answers == [SELECTED, other]
        assert bus.time_ns == 19 * MS
    for wait_ms in (500, 25):
        bus = Scripted([])
        port = LssPort(Port(cast(Any, bus), bus))
        assert (port.ask(asked) if wait_ms == 500 else port.ask(asked, wait_ms * MS)) == []
        assert bus.time_ns == wait_ms * MS


def test_a_late_answer_to_an_earlier_request_is_none_to_this_one() -> None:
    bus = Scripted([(0.0, lss()), (0.0, lss())], [(3.0, lss())])
    port = Port(cast(Any, bus), bus)
    port.send(0x7E5, SELECTED)
    assert LssPort(port).ask(SELECTED) == [SELECTED]


def test_drives_are_released_before_an_interface_can_be_closed() -> None:
    bus = Scripted([])
    LssPort(Port(cast(Any, bus), bus)).release()
    # Back to waiting, and 2 ms for the frame.
    assert bus.sent == [(0x7E5, bytes.fromhex("0400000000000000"))]
    assert bus.time_ns == 2 * MS


def test_a_fast_scan_begins_with_a_reset_and_asks_for_nothing_where_nobody_answers() -> None:
    bus = Scripted([])
    assert LssPort(Port(cast(Any, bus), bus)).find_unconfigured() is None
    assert bus.sent == [(0x7E5, bytes.fromhex("5100000000800000"))]
    assert bus.time_ns == 25 * MS
    bus = Scripted([])
    assert not LssPort(Port(cast(Any, bus), bus)).any_unconfigured()
    assert bus.sent == [(0x7E5, bytes.fromhex("4c00000000000000"))]
    assert bus.time_ns == 100 * MS


@pytest.mark.parametrize(
    ("act", "asked", "wait_ms", "answer", "found"),
    [
        (LssPort.node_id, "5e", 500, "5e05", 5),
        (LssPort.store, "17", 5000, "1700", 0),
        (LssPort.store, "17", 5000, "1702", 2),
        (LssPort.store, "17", 5000, "17ff", None),
        (LssPort.any_unconfigured, "4c", 100, "50", True),
        (LssPort.any_unconfigured, "4c", 100, "4f", False),
    ],
)
def test_each_service_has_its_own_answer_and_patience(
    act: Callable[[LssPort], object], asked: str, wait_ms: int, answer: str, found: object
) -> None:
    data = bytes.fromhex(answer).ljust(8, b"\0")
    bus = Scripted([(wait_ms - 1.0, lss(data))])
    assert act(LssPort(Port(cast(Any, bus), bus))) == found
    assert bus.sent == [(0x7E5, bytes.fromhex(asked).ljust(8, b"\0"))]
    if act is LssPort.any_unconfigured:
        return
    wrong = bytes((data[0] + 1, *data[1:]))
    for script, error in (
        ([(wait_ms + 1.0, lss(data))], "no drive answers over LSS"),
        ([(1.0, lss(wrong))], "no drive answers over LSS"),
        ([(1.0, lss(data)), (2.0, lss(data))], "2 drives answer over LSS"),
    ):
        bus = Scripted(script)
        with pytest.raises(DriveError, match=error):
            act(LssPort(Port(cast(Any, bus), bus)))


# --- a new node id in use --------------------------------------------------------------------

IDENTITY = (0x123, 0x402, 5, 0xA5A50F01)
BOOT_UP = reply(b"\x00", 0x700 + 42)


def identity_scripts() -> list[list[tuple[float, can.Message]]]:
    """Answers of node 42 to 1018h:01 to :04."""
    return [
        [(1.0, reply(bytes((0x43, 0x18, 0x10, sub)) + word.to_bytes(4, "little"), 0x580 + 42))]
        for sub, word in enumerate(IDENTITY, start=1)
    ]


def restarted(before: int | None, *scripts: Sequence[tuple[float, can.Message]]) -> Scripted:
    """The bus after a drive that was node `before` has become node 42, or has not."""
    bus = Scripted(*scripts)
    port = Port(cast(Any, bus), bus)
    session = cast(Any, SimpleNamespace(port=lambda: port, config=config()))
    _restart(session, before, 42, IDENTITY, NmtCommand.RESET_NODE)
    return bus


def test_a_drive_that_was_reset_is_asked_as_soon_as_it_boots_under_its_new_id() -> None:
    others = [(1.0, reply(b"\x05", 0x702)), (2.0, reply(b"\x00", 0x701)), (3.0, BOOT_UP)]
    bus = restarted(1, others, *identity_scripts())
    question, given_up = bytes.fromhex("4000100000000000"), bytes.fromhex("8000100000000405")
    assert bus.sent == [
        (0x000, b"\x81\x01"),
        *[(0x62A, bytes((0x40, 0x18, 0x10, sub)) + bytes(4)) for sub in (1, 2, 3, 4)],
        # The old node id is asked twice, and nobody answers.
        *[(0x601, question), (0x601, given_up)] * 2,
    ]
    assert bus.time_ns == 3 * MS + 4 * MS + 2 * 15 * MS


def test_a_second_drive_under_the_old_node_id_is_noticed() -> None:
    device = reply(bytes.fromhex("4300100092010200"), 0x581)
    with pytest.raises(DriveError, match="node 1 still answers after its drive has become node 42"):
        restarted(1, [(3.0, BOOT_UP)], *identity_scripts(), [(1.0, device)])


def test_another_drive_under_the_new_node_id_is_noticed() -> None:
    scripts = identity_scripts()
    scripts[3] = [(1.0, reply(bytes.fromhex("4318100409000000"), 0x580 + 42))]
    with pytest.raises(DriveError, match="node 42 is another drive, serial 9, than the one"):
        restarted(1, [(3.0, BOOT_UP)], *scripts)


def test_a_drive_that_does_not_boot_is_asked_after_5_s_all_the_same() -> None:
    bus = restarted(42, [], *identity_scripts())
    assert bus.sent[0] == (0x000, b"\x81\x2a")
    # It has the node id that it had, so nobody else is asked.
    assert {cob_id for cob_id, _ in bus.sent[1:]} == {0x62A}
    assert bus.time_ns == 5000 * MS + 4 * MS
