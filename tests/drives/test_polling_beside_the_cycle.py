"""Requests for a mode and for a temperature, cycle by cycle, with every answer that may come."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from drives_rig import config, node

from legbench.drives.errors import BusError
from legbench.drives.master import mode_poll, temperature
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.mode_poll import ModePoll, mode_polls
from legbench.drives.master.requests import Requests
from legbench.drives.master.temperature import TemperaturePoll, temperature_polls
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.asking import latest_request_us
from legbench.drives.setup.quirks import ModeShown, Quirks

MODE_QUESTION = bytes.fromhex("4061600000000000")
WARMTH_QUESTION = bytes.fromhex("4070200300000000")
ENABLED, SWITCHED_ON = 0x0237, 0x0233
NO_OBJECT = bytes.fromhex("8061600000000206")


def shown(mode: int) -> bytes:
    """Answer of one byte (CiA 301, 7.2.4.3.6)."""
    return bytes.fromhex("4f616000") + mode.to_bytes(1, "little", signed=True) + bytes(3)


def asked(poll: ModePoll | TemperaturePoll, cycles: int) -> list[int]:
    """Cycles in which a request is due."""
    return [cycle for cycle in range(1, cycles + 1) if poll.due(cycle) is not None]


@pytest.mark.parametrize("place", [0, 1])
def test_the_mode_of_an_enabled_drive_is_asked_for_until_it_is_8(place: int) -> None:
    axis = AxisLink(replace(node(place), quirks=Quirks(mode_shown=ModeShown.ENABLED)))
    poll = ModePoll(axis)
    assert poll.every == 20
    axis.statusword = SWITCHED_ON
    assert asked(poll, 60) == []
    axis.statusword = ENABLED
    assert asked(poll, 60) == [20, 40, 60]
    assert poll.due(80) == Frame(0x601 + place, MODE_QUESTION)
    for answer in (shown(0), shown(6), shown(-8), NO_OBJECT, b"\x00" * 7):
        poll.feed(answer)
        assert not axis.in_mode
        assert poll.due(100) == Frame(0x601 + place, MODE_QUESTION)
    # Answers for another object are none, and leave the question open.
    poll.feed(bytes.fromhex("4f41600008000000"))
    assert not axis.in_mode
    poll.feed(shown(8))
    assert axis.in_mode
    assert asked(poll, 60) == []
    # An answer without a question changes nothing.
    poll.feed(shown(6))
    assert axis.in_mode


def test_a_drive_that_has_shown_its_mode_is_not_asked() -> None:
    axis = AxisLink(node(0))
    axis.statusword = ENABLED
    poll = ModePoll(axis)
    assert asked(poll, 60) == []
    poll.feed(shown(6))
    assert axis.in_mode


@pytest.mark.parametrize(("period_us", "every"), [(1000, (20, 200)), (4000, (5, 50))])
def test_requests_come_in_time_not_in_cycles(period_us: int, every: tuple[int, int]) -> None:
    bus = config(period_us=period_us)
    axes = [AxisLink(each) for each in bus.nodes]
    modes, warmth = mode_polls(axes, bus), temperature_polls(bus)
    assert [poll.every for poll in modes] == [every[0]] * 2
    assert [poll.every for poll in warmth] == [every[1]] * 2
    assert (mode_poll.EVERY_MS, temperature.EVERY_MS) == (20, 200)


def warmth_answer(value: int) -> bytes:
    return bytes.fromhex("4b702003") + value.to_bytes(2, "little", signed=True) + bytes(2)


@pytest.mark.parametrize("place", [0, 1])
def test_a_temperature_is_asked_for_every_200_ms_and_scaled(place: int) -> None:
    entry = Mapped(0x2070, 3, DataType.INTEGER16)
    warm = replace(node(place), temperature_object=entry, temperature_scale=0.5)
    poll = TemperaturePoll(warm)
    assert (poll.celsius, poll.unanswered, poll.every) == (None, 0, 200)
    poll.feed(warmth_answer(50))
    assert poll.celsius is None
    assert poll.due(199) is None
    assert poll.due(200) == Frame(0x601 + place, WARMTH_QUESTION)
    assert poll.unanswered == 0
    poll.feed(warmth_answer(-50))
    assert (poll.celsius, poll.unanswered) == (-25.0, 0)
    # Each request without an answer counts, and so does one that the drive refuses.
    for missed in range(3):
        assert poll.due(400 + 200 * missed) is not None
        assert poll.unanswered == missed
        poll.feed(bytes.fromhex("8070200300000206"))
    assert poll.celsius == -25.0
    poll.feed(warmth_answer(60))
    assert poll.celsius == -25.0
    poll.due(1000)
    poll.feed(bytes.fromhex("4b70200260000000"))
    assert poll.celsius == -25.0
    poll.feed(warmth_answer(60))
    assert (poll.celsius, poll.unanswered) == (30.0, 0)
    poll.due(1200)
    assert poll.unanswered == 0


def test_a_real_number_that_is_none_is_no_temperature() -> None:
    entry = Mapped(0x2070, 3, DataType.REAL32)
    poll = TemperaturePoll(replace(node(0), temperature_object=entry, temperature_scale=2.0))
    for bits, celsius in ((0x41C80000, 50.0), (0x7FC00000, 50.0), (0x7F800000, 50.0)):
        poll.due(200)
        poll.feed(bytes.fromhex("43702003") + bits.to_bytes(4, "little"))
        assert poll.celsius == celsius
    # Two answers in a row have brought no temperature.
    assert poll.due(400) is not None
    assert poll.unanswered == 2


def test_a_drive_without_a_temperature_is_not_asked() -> None:
    poll = TemperaturePoll(node(0))
    assert asked(poll, 400) == []
    poll.feed(warmth_answer(50))
    assert (poll.celsius, poll.unanswered) == (None, 0)


# --- turns -----------------------------------------------------------------------------------


class Due:
    """A poll whose requests are due every so many cycles."""

    def __init__(self, name: int, every: int) -> None:
        self.name, self.every = name, every
        self.asked: list[int] = []

    def due(self, cycle: int) -> Frame | None:
        self.asked.append(cycle)
        return None if cycle % self.every else Frame(0x600 + self.name, bytes([cycle % 251]))


class Turns:
    """Requests of some polls, cycle by cycle, and the frames that leave."""

    def __init__(self, *every: int, period_us: int = 1000) -> None:
        self.polls = [Due(name, cycles) for name, cycles in enumerate(every, start=1)]
        self.sent: list[tuple[int, int]] = []
        self.failed: list[BusError] = []
        self.refuses = False
        self.cycle = 0
        port = cast(Any, SimpleNamespace(send_frame=self._send))
        self._bus = config(period_us=period_us)
        self.requests = Requests(port, self._bus, self.polls, self.failed.append)

    def _send(self, frame: Frame) -> None:
        if self.refuses:
            raise BusError("full")
        self.sent.append((self.cycle, frame.cob_id - 0x600))

    def run(self, cycles: int, after_us: float | None = 0.0) -> None:
        for _ in range(cycles):
            self.cycle += 1
            self.requests.turn(None if after_us is None else round(1000 * after_us))


def test_requests_take_turns_a_cycle_apart() -> None:
    it = Turns(20, 20, 20)
    it.run(60)
    # A poll is asked for the cycle in which its turn is, as many cycles ahead as there are before.
    assert it.sent == [(20 * turn - place, place + 1) for turn in (1, 2, 3) for place in (2, 1, 0)]


def test_polls_of_different_intervals_are_all_asked() -> None:
    it = Turns(20, 50)
    it.run(200)
    assert [cycle for cycle, name in it.sent if name == 1] == list(range(20, 201, 20))
    # Every 50 cycles, one ahead; one that is due with another waits for it.
    assert [name for _, name in it.sent].count(2) == 4
    assert len({cycle for cycle, _ in it.sent}) == len(it.sent)
    # Few cycles are looked at in vain.
    assert len(it.polls[0].asked) <= 2 * 200 / 10 + 2


def test_a_request_waits_for_room_up_to_100_ms() -> None:
    latest = latest_request_us(config())
    for after_us, waits in ((latest, False), (latest + 0.001, True)):
        it = Turns(50)
        it.run(50, after_us)
        assert it.sent == ([] if waits else [(50, 1)])
        if waits:
            it.run(99, after_us)
            assert it.sent == []
            it.run(1, after_us)
            assert it.sent == [(150, 1)]
    slow = Turns(50, period_us=4000)
    slow.run(74, 4000.0)
    assert slow.sent == []
    slow.run(1, 4000.0)
    assert slow.sent == [(75, 1)]


def test_nothing_is_asked_in_a_cycle_in_which_nothing_may_be() -> None:
    it = Turns(20)
    it.run(19)
    it.run(200, None)
    assert it.sent == []
    it.run(1)
    # It is asked once, however long it has waited.
    assert it.sent == [(220, 1)]
    it.run(20)
    assert it.sent == [(220, 1), (240, 1)]


def test_a_request_that_cannot_be_sent_is_told_and_is_not_repeated() -> None:
    it = Turns(20)
    it.refuses = True
    it.run(25)
    assert [str(error) for error in it.failed] == ["full"]
    it.refuses = False
    it.run(15)
    assert it.sent == [(40, 1)]
