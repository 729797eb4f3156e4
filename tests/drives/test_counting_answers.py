"""Two drives with one node id: how many answers a question gets, and how long they are awaited."""

from collections.abc import Sequence
from typing import Any, cast

import can
import pytest
from drives_rig import MS

from legbench.drives.master.doubles import count_answers
from legbench.drives.master.port import Port

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
        for after_ms, answer in self._scripts.pop(0):
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
