"""A server of emulated adapters by itself: its terminals, and the time that it lets pass."""

import os
import socket
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, cast, final

import pytest
from can_rig import MS

from legbench.drives.emulated.network import Network
from legbench.drives.emulated.slcan_server import SlcanServer


@pytest.mark.parametrize("named", [True, False])
def test_every_channel_has_a_terminal_and_none_is_left(tmp_path: Path, *, named: bool) -> None:
    links = [tmp_path / "a.tty", tmp_path / "b.tty"] if named else []
    server = SlcanServer([Network(()), Network(())], links)
    terminals = server.path.split(",")
    assert len(set(terminals)) == 2
    assert [os.readlink(link) for link in links] == (terminals if named else [])
    assert all(map(os.path.exists, terminals))
    for _ in range(2):
        server.close()
        assert not any(map(os.path.exists, terminals))
        assert list(tmp_path.iterdir()) == []


def test_channels_and_terminals_are_as_many(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="zip"):
        SlcanServer([Network(()), Network(())], [tmp_path / "a.tty"])
    assert list(tmp_path.iterdir()) == []


@final
class SlowLine:
    """An adapter that takes 2 ms to read its line, and notes the time of the bus."""

    writers = ()

    def __init__(self, network: Network) -> None:
        self.network, self.clock_ns = network, 10 * MS
        self.seen: list[tuple[str, int]] = []
        self.reader, self._other = socket.socketpair()

    def now_ns(self) -> int:
        return self.clock_ns

    def take(self, _: Collection[object]) -> None:
        self.seen.append(("takes", self.network.now_ns))
        self.clock_ns += 2 * MS

    def give(self) -> None:
        self.seen.append(("gives", self.network.now_ns))

    def close(self) -> None:
        self.reader.close()
        self._other.close()


@pytest.fixture
def slow() -> Iterator[SlowLine]:
    line = SlowLine(Network(()))
    yield line
    line.close()


def test_a_bus_is_as_late_as_the_clock_when_frames_are_taken_and_when_they_are_given(
    slow: SlowLine,
) -> None:
    with SlcanServer([slow.network], now_ns=slow.now_ns) as server:
        server._lines[0].close()
        server._lines = [cast(Any, slow)]
        for _ in range(2):
            slow.clock_ns += MS
            server.poll()
    assert slow.seen == [
        ("takes", 1 * MS),
        ("gives", 3 * MS),
        ("takes", 4 * MS),
        ("gives", 6 * MS),
    ]
