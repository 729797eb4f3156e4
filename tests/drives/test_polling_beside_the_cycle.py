"""Requests for a mode and for a temperature, cycle by cycle, with every answer that may come."""

from dataclasses import replace

import pytest
from drives_rig import config, node

from legbench.drives.master import mode_poll, temperature
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.mode_poll import ModePoll, mode_polls
from legbench.drives.master.temperature import TemperaturePoll, temperature_polls
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.pdo import Mapped
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
