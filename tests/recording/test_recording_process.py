"""The program that records for a loop in real time, run here and now with packets in its queue."""

import errno
import os
import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from recorded_rows import cycle

from legbench.recording import process
from legbench.recording.files import Appender, append_to
from legbench.recording.log_file import LogFile, RingDrain
from legbench.recording.process_disk import END, EVENT, LOG, LOG_END, REPORT, ROWS, UNKNOWN
from legbench.recording.ring import RING_BYTES, Ring
from legbench.recording.rows import RowBlock
from legbench.recording.stream import WholeBatches, encode_schema, schema_for

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="sequenced packets are Linux's")
SCHEMA = schema_for({})
Packet = tuple[bytes, list[int]]
CLOSED = os.strerror(errno.EBADF)


def rows(first: int, count: int) -> bytes:
    block = RowBlock()
    for row in range(first, first + count):
        block.put(*cycle(row))
    return ROWS + block.columns().tobytes()


class Master:
    """The end of the loop: files that the program writes, and a socket that it listens to."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.samples, self.events = append_to(folder / "samples"), append_to(folder / "events")
        self.samples.append(encode_schema(SCHEMA))
        self.socket, self._theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.socket.setblocking(False)

    def run(self, *packets: bytes) -> int:
        """Status of the program once it has taken what is in its queue."""
        for packet in packets:
            self.socket.send(packet)
        files = (self.samples.fd, self.events.fd, self._theirs.detach())
        return process.main(list(map(str, files)))

    def reports(self) -> list[tuple[int, float, float, int, int, bool]]:
        """Everything that was told: rows, first and last time, errnos, whether it is the end."""
        found = []
        while report := self.socket.recv(REPORT.size):
            found.append(REPORT.unpack(report))
        return found

    def close(self) -> None:
        for end in (self.socket, self._theirs, self.samples, self.events):
            end.close()

    def kept(self) -> tuple[list[int], str | None]:
        """Rows of the samples, and what is wrong with their file."""
        stream = WholeBatches(self.folder / "samples")
        found = [round(t / 1e6) for batch in stream for t in batch["t_ns"].to_pylist()]
        return found, stream.tear


@pytest.fixture
def master(tmp_path: Path) -> Iterator[Master]:
    made = Master(tmp_path)
    yield made
    made.close()


def test_a_run_is_written_packet_by_packet_and_each_is_reported(master: Master) -> None:
    parts = [EVENT + b'{"name": "touch', EVENT + b'down"}\n', EVENT + b'{"name": "liftoff"}\n']
    assert master.run(rows(5, 50), parts[0], rows(55, 13), *parts[1:], END) == 0
    assert master.reports() == [
        (50, 0.005, 0.054, 0, 0, False),
        (50, 0.005, 0.054, 0, 0, False),
        *[(63, 0.005, 0.067, 0, 0, False)] * 3,
        (63, 0.005, 0.067, 0, 0, True),
    ]
    assert master.kept() == (list(range(5, 68)), None)
    events = (master.folder / "events").read_bytes()
    assert events == b'{"name": "touchdown"}\n{"name": "liftoff"}\n'


def test_what_a_killed_master_left_in_the_queue_is_written_without_an_end(master: Master) -> None:
    for packet in (rows(0, 50), EVENT + b"torn by its dea", rows(50, 50)):
        master.socket.send(packet)
    master.socket.close()
    assert master.run() == 1
    found, tear = master.kept()
    assert found == list(range(100))
    assert tear == "samples has no end mark after 100 rows"
    assert (master.folder / "events").read_bytes() == b""


def test_a_disk_that_refuses_is_told_by_its_number(
    master: Master, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = os.write
    full = {master.samples.fd: errno.ENOSPC, master.events.fd: errno.EIO}

    def write(fd: int, data: Any) -> int:
        if fd in full:
            raise OSError(full[fd], os.strerror(full[fd]))
        return real(fd, data)

    monkeypatch.setattr(os, "write", write)
    assert master.run(rows(0, 50), EVENT + b"{}\n", END) == 0
    told = [(row[0], *row[3:]) for row in master.reports()]
    assert told == [
        (0, errno.ENOSPC, 0, False),
        (0, errno.ENOSPC, errno.EIO, False),
        (0, errno.ENOSPC, errno.EIO, True),
    ]


def test_what_is_no_error_of_the_system_has_a_number_of_its_own() -> None:
    errors = (None, OSError(28, "full"), OSError("no number"), ValueError("no file"))
    assert [process._number(error) for error in errors] == [0, 28, UNKNOWN, UNKNOWN]
    assert UNKNOWN == -1


def test_packets_are_taken_until_there_is_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    """A time-out is no packet, a connection that was reset still has its queue."""
    came: list[Any] = [
        BlockingIOError(),
        (b"R1", []),
        ConnectionResetError(),
        (b"L", [7, 8]),
        (b"", []),
        (b"never", []),
    ]

    def receive(_master: Any, size: int, most: int) -> tuple[bytes, list[int], int, None]:
        assert (size, most) == (99, 2)
        packet = came.pop(0)
        if isinstance(packet, Exception):
            raise packet
        return (*packet, 0, None)

    monkeypatch.setattr(socket, "recv_fds", receive)
    found = list(process._packets(cast(Any, None), 99))
    assert found == [(b"", []), (b"R1", []), (b"L", [7, 8])]
    # One lives a tenth of a second without a packet (seconds, microseconds).
    assert np.frombuffer(process.LOOK_EVERY, np.int_).tolist() == [0, 100_000]


# --- logs ------------------------------------------------------------------------------------


class Log:
    """A log as the loop sees it, and its file."""

    def __init__(self, path: Path) -> None:
        self.path, self.ring = path, Ring.create()
        self._file = append_to(path)

    def descriptors(self) -> list[int]:
        """Memory and file for the program, whose they are then, as those that a socket brings."""
        return [os.dup(self.ring.fd), self._file.fd]

    @property
    def content(self) -> bytes:
        return self.path.read_bytes()


def test_lines_are_written_once_they_are_known_to_be_whole(
    master: Master, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = Log(master.folder / "first"), Log(master.folder / "second")

    def packets(*_: object) -> Iterator[Packet]:
        yield LOG, first.descriptors()
        yield LOG, second.descriptors()
        first.ring.put(b"1\n")
        second.ring.put(b"2\n")
        # Nothing has come: what is new may be half there, and is written at the next look.
        yield b"", []
        assert (first.content, second.content) == (b"", b"")
        yield b"", []
        assert (first.content, second.content) == (b"1\n", b"2\n")
        assert first.ring.waiting == second.ring.waiting == 0
        # A packet says that what was put before it is whole.
        first.ring.put(b"3\n")
        yield rows(0, 50), []
        assert (first.content, second.content) == (b"1\n3\n", b"2\n")
        first.ring.put(b"4\n")
        second.ring.put(b"5\n")
        yield LOG_END + b"\x01", []
        assert (first.ring.closed, second.ring.closed) == (False, True)
        first.ring.put(b"6\n")
        yield LOG_END + b"\x01", []
        yield END, []
        raise AssertionError("nothing is read after the end")

    monkeypatch.setattr(process, "_packets", packets)
    assert master.run() == 0
    assert first.content == b"1\n3\n4\n6\n"
    assert second.content == b"2\n5\n"
    assert first.ring.closed
    # Two logs, rows, two ends of a log, and the end; none for a look.
    assert [told[-1] for told in master.reports()] == [False] * 5 + [True]


def test_a_log_whose_file_fails_says_so_and_loses_its_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = Log(tmp_path / "log")
    memory, fd = log.descriptors()
    drain = RingDrain(Ring(memory), LogFile(Appender(fd)))
    real = os.write

    def write(to: int, data: Any) -> int:
        if to == fd:
            raise OSError(errno.ENOSPC, CLOSED)
        return real(to, data)

    log.ring.put(b"kept\n")
    drain.drain(everything=True)
    drain.drain(everything=True)
    assert (log.content, log.ring.failed, log.ring.waiting) == (b"kept\n", 0, 0)
    monkeypatch.setattr(os, "write", write)
    log.ring.put(b"lost\n")
    drain.drain(everything=True)
    assert (log.ring.failed, log.ring.waiting, log.ring.closed) == (errno.ENOSPC, 0, False)
    drain.close()
    assert (log.content, log.ring.closed) == (b"kept\n", True)
    drain.close()
    drain.drain(everything=True)


def test_a_log_is_synced_as_it_is_closed_and_its_failure_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[int] = []
    for number in (0, errno.EIO, errno.EINVAL):
        log = Log(tmp_path / f"log{number}")
        memory, fd = log.descriptors()
        drain = RingDrain(Ring(memory), LogFile(Appender(fd)))

        def sync(to: int, number: int = number) -> None:
            synced.append(to)
            if number:
                raise OSError(number, os.strerror(number))

        monkeypatch.setattr(os, "fsync", sync)
        drain.close()
        assert synced[-1] == fd
        # A pipe, or /dev/null, has no disk to wait for.
        assert log.ring.failed == (errno.EIO if number == errno.EIO else 0)
        with pytest.raises(OSError, match=CLOSED):
            os.fstat(fd)
    assert len(synced) == 3


def test_a_ring_is_filled_to_its_last_byte_and_goes_on_behind_its_seam() -> None:
    ring = Ring.create()
    assert RING_BYTES == 16_777_216
    assert ring.put(bytes(RING_BYTES - 10))
    assert ring.put(b"0123456789")
    assert not ring.put(b"x")
    assert ring.waiting == RING_BYTES
    assert ring.look(everything=True)[-10:] == b"0123456789"
    ring.take(RING_BYTES - 4)
    assert ring.put(b"abcdef")
    assert ring.look(everything=True) == b"6789abcdef"
    assert not ring.put(bytes(RING_BYTES - 9))
    ring.take(10)
    assert (ring.waiting, ring.look(everything=True)) == (0, b"")
    # Once all is taken there is room for as much as it holds, from wherever it begins.
    whole = bytes(RING_BYTES - 1) + b"x"
    assert ring.put(whole)
    assert ring.look(everything=True) == whole
    ring.close()
