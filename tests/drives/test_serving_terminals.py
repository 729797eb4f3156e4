"""A server of emulated adapters by itself: its terminals, and the time that it lets pass."""

import os
import socket
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, cast, final

import pytest
from can_rig import MS

from legbench.drives.emulated import slcan_line
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.slcan_line import SlcanLine
from legbench.drives.emulated.slcan_server import SlcanServer
from legbench.drives.errors import BusError


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


# --- one line --------------------------------------------------------------------------------


def test_a_line_leaves_no_file_open_neither_at_its_end_nor_without_a_link(tmp_path: Path) -> None:
    warned: list[str] = []
    before = len(os.listdir("/proc/self/fd"))
    (tmp_path / "mine").write_text("mine")
    with pytest.raises(BusError, match="cannot serve a bus at"):
        SlcanLine(Network(()), tmp_path / "mine", warned.append)
    assert len(os.listdir("/proc/self/fd")) == before
    line = SlcanLine(Network(()), tmp_path / "link", warned.append)
    assert len(os.listdir("/proc/self/fd")) == before + 2
    for _ in range(2):
        line.close()
        assert len(os.listdir("/proc/self/fd")) == before
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]
    assert warned == []


@pytest.fixture
def line() -> Iterator[SlcanLine]:
    with SlcanLine(Network(()), None, lambda _: None) as it:
        yield it


def test_what_is_written_does_not_come_back(line: SlcanLine) -> None:
    line._unsent = b"t1230\r"
    line.give()
    with pytest.raises(BlockingIOError):
        os.read(line.reader, 100)


@pytest.mark.parametrize(("written", "left"), [(6, b""), (8, b"\r"), (7, b"\r"), (12, b"")])
def test_a_new_opening_ends_a_line_that_was_begun_and_drops_the_rest(
    line: SlcanLine, monkeypatch: pytest.MonkeyPatch, written: int, left: bytes
) -> None:
    monkeypatch.setattr(slcan_line.os, "write", lambda _fd, _data: written)
    line._unsent = b"t1230\rt4560\r"
    line.give()
    assert line._unsent == b"t1230\rt4560\r"[written:]
    line._forget_old()
    assert line._unsent == b"t1230\rt4560\r"[written:]
    line._adapter.openings = 1
    line._forget_old()
    assert line._unsent == left


def test_lines_are_dropped_once_64_kibibytes_are_unread(
    line: SlcanLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slcan_line.os, "write", lambda _fd, _data: 0)
    for unread, grown in ((65_535, 65_537), (65_536, 65_536)):
        line._unsent, line._answers = b"x" * unread, b"ab"
        line.give()
        assert len(line._unsent) == grown
        assert line._answers == b""


def test_another_bitrate_is_warned_of_once_each_time_that_it_is_set(line: SlcanLine) -> None:
    warnings: list[str] = []
    line._warn = warnings.append
    for asked, count in (
        *((None, 0), (1_000_000, 0), (500_000, 1), (500_000, 1)),
        *((1_000_000, 1), (500_000, 2), (250_000, 3), (None, 3), (250_000, 4)),
    ):
        line._adapter.bitrate = asked
        line._compare_bitrates()
        assert len(warnings) == count
    assert warnings[0].startswith("the adapter was set to 500000 bit/s, the bus runs at 1000000")
