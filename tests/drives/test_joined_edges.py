"""Joined channels and a serial adapter by themselves: turns, waits, lines that are cut short."""

import errno
import gc
import os
import time
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast, final

import can
import pytest
from can_rig import BUS
from drives_rig import config

from legbench.drives.emulated.network import Network
from legbench.drives.emulated.slcan_server import SlcanServer
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.transport import slcan_bus, split_bus
from legbench.drives.transport.slcan_bus import SlcanBus
from legbench.drives.transport.split_bus import Routes, SplitBus, wait_for_any, worst_state
from legbench.drives.transport.timebase import SystemTime

ACTIVE, PASSIVE, ERROR = can.BusState.ACTIVE, can.BusState.PASSIVE, can.BusState.ERROR


@final
class Part:
    """An interface with some messages, which notes in a list of all that it was looked at."""

    def __init__(self, name: str, looks: list[str], *messages: str) -> None:
        self.channel = self.name = name
        self.channel_info, self.state = f"bus {name}", ACTIVE
        self._looks, self._messages = looks, list(messages)

    def recv(self, timeout: float) -> str | None:
        assert timeout == 0.0
        self._looks.append(self.name)
        return self._messages.pop(0) if self._messages else None

    def fileno(self) -> int:
        raise NotImplementedError

    def shutdown(self) -> None:
        """Nothing is held."""


def joined(*parts: Part) -> SplitBus:
    return SplitBus(cast(Any, parts), config())


def test_channels_take_turns_and_begin_with_the_second_one() -> None:
    looks: list[str] = []
    bus = joined(Part("a", looks, "a1", "a2"), Part("b", looks, "b1"), Part("c", looks, "c1", "c2"))
    found = [bus.recv(0.0) for _ in range(6)]
    assert found == ["b1", "c1", "a1", "c2", "a2", None]
    assert "".join(looks) == "bcabca" + "bca"
    assert bus.channel_info == "bus a + bus b + bus c"
    assert bus.channel == "a+b+c"
    bus.shutdown()


def test_a_joined_bus_is_as_ill_as_its_worst_channel_and_all_are_restarted() -> None:
    parts = [Part(name, []) for name in "abc"]
    bus = joined(*parts)
    for states, worst in (
        ((ACTIVE, ACTIVE, ACTIVE), ACTIVE),
        ((ACTIVE, PASSIVE, ACTIVE), PASSIVE),
        ((PASSIVE, ACTIVE, ERROR), ERROR),
        ((ERROR, PASSIVE, ACTIVE), ERROR),
    ):
        for part, state in zip(parts, states, strict=True):
            part.state = state
        assert bus.state is worst_state(cast(Any, parts)) is worst
    bus.state = ACTIVE
    assert [part.state for part in parts] == [ACTIVE] * 3
    bus.shutdown()


def test_interfaces_are_waited_for_together_or_looked_at_five_times_in_a_millisecond(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    waits: list[object] = []
    monkeypatch.setattr(split_bus, "select", SimpleNamespace(select=lambda *how: waits.append(how)))
    monkeypatch.setattr(split_bus, "time", SimpleNamespace(sleep=waits.append))
    ports = [SimpleNamespace(fileno=lambda number=number: number) for number in (7, 8)]
    for left in (None, 0.5):
        wait_for_any(cast(Any, ports), left)
    assert waits == [([7, 8], [], [], None), ([7, 8], [], [], 0.5)]
    waits.clear()
    for left in (None, 0.5, 1e-4):
        wait_for_any(cast(Any, [*ports, Part("a", [])]), left)
    assert waits == [2e-4, 2e-4, 1e-4]


def test_a_joined_bus_waits_for_what_is_left_of_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, waits = [100.0], []

    def wait(_parts: object, left: float | None) -> None:
        waits.append(left)
        clock[0] += 0.25

    monkeypatch.setattr(split_bus, "wait_for_any", wait)
    monkeypatch.setattr(split_bus, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    bus = joined(Part("a", []), Part("b", []))
    assert bus.recv(0.5) is None
    assert waits == [0.5, 0.25]
    bus.shutdown()


def test_the_last_node_has_its_channel_and_an_order_to_nobody_goes_to_all() -> None:
    bus = config()
    first, second = bus.nodes
    nodes = (replace(first, channel="a"), replace(second, channel="b", node_id=127))
    routes = Routes(replace(bus, nodes=nodes, master_id=126))
    assert routes.of(0x67F, bytes(8)) == (1,)
    assert routes.of(0x600, bytes(8)) == routes.of(0x680, bytes(8)) == (0, 1)
    assert routes.of(0x000, b"\x01\x7f") == (1,)
    assert routes.of(0x000, b"\x01") == routes.of(0x000, b"") == (0, 1)


def test_a_system_time_sleeps_to_the_end_unless_it_is_asked_to_spin() -> None:
    assert SystemTime()._spin_ns == 0
    assert SystemTime(7)._spin_ns == 7


# --- a serial adapter ------------------------------------------------------------------------


@pytest.fixture
def adapter() -> Iterator[SlcanBus]:
    assert load_bus(BUS).bitrate == 1_000_000
    with SlcanServer([Network(())]) as server:
        bus = SlcanBus(server.path, bitrate=1_000_000, sleep_after_open=0.0)
        yield bus
        bus.shutdown()


def test_an_adapter_says_where_it_is_and_is_not_waited_for_at_its_end(adapter: SlcanBus) -> None:
    assert adapter.channel_info == f"slcan {adapter.channel}"
    assert adapter.serialPortOrig.write_timeout == 0.1


def test_a_line_that_was_cut_short_is_sent_to_its_end_and_one_that_was_refused_is_not(
    adapter: SlcanBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    rooms, written = [None, 3, 100, 100], []

    def write(_fd: int, line: bytes) -> int:
        room = rooms.pop(0)
        if room is None:
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        written.append(line[:room])
        return min(room, len(line))

    monkeypatch.setattr(slcan_bus.os, "write", write)
    frames = [can.Message(arbitration_id=i, data=b"\1", is_extended_id=False) for i in range(4)]
    for frame in frames[:2]:
        with pytest.raises(can.CanOperationError, match="takes no frame any more"):
            adapter.send(frame)
    adapter.send(frames[2])
    adapter.send(frames[3])
    monkeypatch.undo()
    assert b"".join(written) == b"t001101\rt002101\rt003101\r"


def test_an_adapter_waits_as_long_as_it_is_told(
    adapter: SlcanBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    waits: list[float | None] = []

    def wait(_read: object, _write: object, _odd: object, left: float | None) -> tuple[list[int]]:
        waits.append(left)
        return ([],)

    monkeypatch.setattr(slcan_bus, "select", SimpleNamespace(select=wait))
    monkeypatch.setattr(slcan_bus, "time", SimpleNamespace(monotonic=lambda: 100.0, time=time.time))
    for timeout in (None, 0.0, 0.5):
        assert adapter.recv(timeout) is None
    monkeypatch.undo()
    assert waits == [None, 0.0, 0.5]


def test_an_adapter_that_was_never_opened_has_nothing_to_shut_down(
    caplog: pytest.LogCaptureFixture,
) -> None:
    for wrong, error in (({"fd": True}, can.CanInitializationError), ({"bitrat": 5}, TypeError)):
        with pytest.raises(error):
            SlcanBus("/nowhere", **cast(Any, wrong))
    gc.collect()
    assert [record.message for record in caplog.records] == []
