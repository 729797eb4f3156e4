"""Channels joined to one bus: what goes where, what comes, and what one of them refuses."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import can
import pytest
from drives_rig import config

from legbench.drives.errors import BusError
from legbench.drives.protocol.nmt import NmtCommand, nmt_frame
from legbench.drives.setup.config import BusConfig
from legbench.drives.transport.lock import ChannelLock
from legbench.drives.transport.open_channels import adapters_of, open_channels
from legbench.drives.transport.split_bus import Routes, SplitBus

NAMES = ("cycle-left", "cycle-right")


def two() -> BusConfig:
    """The rig's drives, each on a channel of its own."""
    bus = config(interface="virtual")
    nodes = tuple(replace(node, channel=name) for node, name in zip(bus.nodes, NAMES, strict=True))
    return replace(bus, nodes=nodes)


@pytest.fixture
def wires() -> Iterator[tuple[SplitBus, list[can.BusABC]]]:
    """The joined bus, and a participant of each channel."""
    others = [can.Bus(interface="virtual", channel=name) for name in NAMES]
    parts = [can.Bus(interface="virtual", channel=name) for name in NAMES]
    bus = SplitBus(parts, two())
    try:
        yield bus, others
    finally:
        bus.shutdown()
        for other in others:
            other.shutdown()


def frame(cob_id: int, data: bytes = b"") -> can.Message:
    return can.Message(arbitration_id=cob_id, data=data, is_extended_id=False)


def heard(others: list[can.BusABC]) -> list[list[int]]:
    """Identifiers that came on each channel since the last look."""
    found: list[list[int]] = []
    for other in others:
        ids: list[int] = []
        while (message := other.recv(0.0)) is not None:
            ids.append(message.arbitration_id)
        found.append(ids)
    return found


def test_frames_go_to_the_channel_of_their_drive_and_all_others_to_all() -> None:
    routes = Routes(two())
    for cob_id, data, where in (
        (0x080, b"", (0, 1)),
        (0x77E, b"\x05", (0, 1)),
        (0x201, bytes(6), (0,)),
        (0x202, bytes(6), (1,)),
        (0x601, bytes(8), (0,)),
        (0x602, bytes(8), (1,)),
        (0x603, bytes(8), (0, 1)),
        (0x000, nmt_frame(NmtCommand.START, 0).data, (0, 1)),
        (0x000, nmt_frame(NmtCommand.START, 2).data, (1,)),
        (0x7E5, bytes(8), (0, 1)),
    ):
        assert routes.of(cob_id, data) == where


def test_a_joined_bus_sends_and_hears_on_both(wires: tuple[SplitBus, list[can.BusABC]]) -> None:
    bus, others = wires
    for cob_id in (0x080, 0x201, 0x602):
        bus.send(frame(cob_id, bytes(2)))
    assert heard(others) == [[0x080, 0x201], [0x080, 0x602]]
    for cob_id in (0x181, 0x701):
        others[0].send(frame(cob_id))
    for cob_id in (0x182, 0x702):
        others[1].send(frame(cob_id))
    # Channels take turns: none waits until the other one is silent.
    came = [message.arbitration_id for message in iter(lambda: bus.recv(0.0), None)]
    assert sorted(came) == [0x181, 0x182, 0x701, 0x702]
    assert {came[0], came[1]} == {0x181, 0x182}
    assert bus.recv(0.001) is None
    assert bus.state is can.BusState.ACTIVE


def test_a_channel_that_refuses_keeps_no_other_from_a_frame(
    wires: tuple[SplitBus, list[can.BusABC]], monkeypatch: pytest.MonkeyPatch
) -> None:
    bus, others = wires
    for place in (0, 1):

        def refuse(_msg: can.Message, _timeout: float | None = None) -> None:
            raise can.CanOperationError("no room")

        with monkeypatch.context() as broken:
            broken.setattr(bus.parts[place], "send", refuse)
            with pytest.raises(can.CanOperationError, match="no room"):
                bus.send(frame(0x080))
        assert heard(others) == [[0x080] if place == 1 else [], [0x080] if place == 0 else []]


def test_all_channels_are_locked_or_none(tmp_path: Path) -> None:
    first, second = (ChannelLock(name, tmp_path) for name in NAMES)
    both = ChannelLock.joined([ChannelLock(name, tmp_path) for name in NAMES])
    second.acquire()
    with pytest.raises(BusError, match="cycle-right already has a master"):
        both.acquire()
    first.acquire()  # The one that was free has been given back.
    first.release()
    second.release()
    both.acquire()
    for one in (first, second):
        with pytest.raises(BusError, match="already has a master"):
            one.acquire()
    both.release()
    first.acquire()
    second.acquire()
    first.release()
    second.release()


def test_channels_are_opened_together_and_closed_when_one_is_not_there() -> None:
    bus = two()
    adapters = adapters_of(bus)
    assert [one.channel for one in adapters] == list(NAMES)
    opened, lock = open_channels(bus, adapters, leads=True)
    try:
        assert isinstance(opened, SplitBus)
        assert lock.held
        with pytest.raises(BusError, match="already has a master"):
            open_channels(bus, adapters, leads=True)[1].release()
    finally:
        opened.shutdown()
        lock.release()
    assert not lock.held
    given = adapters_of(bus, channel="cycle-a,cycle-b")
    assert [one.channel for one in given] == ["cycle-a", "cycle-b"]
    for wrong in ("cycle-a", "cycle-a,cycle-a", "a,b,c"):
        with pytest.raises(BusError, match=r"drives hang on 2 channels, .*give each drive its own"):
            adapters_of(bus, channel=wrong)
    broken = (adapters[0], replace(adapters[1], interface="socketcan", channel="nocan7"))
    with pytest.raises(BusError):
        open_channels(bus, broken, leads=True)
    first = ChannelLock.of_channel("virtual", NAMES[0])
    first.acquire()
    first.release()


class Part:
    """An interface that cannot be waited for and has a frame at the second look."""

    def __init__(self, name: str, *, fails: bool = False) -> None:
        self.channel_info, self.fails, self.looks, self.ends = name, fails, 0, 0

    def fileno(self) -> int:
        raise NotImplementedError

    def recv(self, timeout: float) -> can.Message | None:
        assert timeout == 0.0
        self.looks += 1
        return frame(0x181) if self.looks == 2 else None

    def shutdown(self) -> None:
        self.ends += 1
        if self.fails:
            raise can.CanOperationError(self.channel_info)


def test_a_time_of_less_than_a_second_is_waited_for_too() -> None:
    parts: Any = [Part("left"), Part("right")]
    bus = SplitBus(parts, two())
    try:
        assert bus.recv(0.0) is None
        assert [part.looks for part in parts] == [1, 1]
        later: Any = [Part("left"), Part("right")]
        bus.parts = tuple(later)
        message = bus.recv(0.9)
        assert message is not None
        assert message.arbitration_id == 0x181
        assert sum(part.looks for part in later) == 3
    finally:
        bus.shutdown()


@pytest.mark.parametrize("failing", [0, 1])
def test_every_channel_is_shut_down_and_the_bus_knows(failing: int) -> None:
    parts: Any = [Part(name, fails=place == failing) for place, name in enumerate(NAMES)]
    bus = SplitBus(parts, two())
    with pytest.raises(can.CanOperationError, match=NAMES[failing]):
        bus.shutdown()
    assert [part.ends for part in parts] == [1, 1]
    assert bus._is_shutdown
