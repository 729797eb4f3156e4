"""The loop's end of the recording process, whose other end is played here report by report."""

import errno
import os
import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from recorded_rows import cycle

from legbench.recording import process_disk
from legbench.recording.abstract_disk import Kept
from legbench.recording.files import append_to
from legbench.recording.process_disk import (
    END,
    EVENT,
    REPORT,
    ROWS,
    UNKNOWN,
    ProcessDisk,
    longest_packet,
)
from legbench.recording.rows import RowBlock
from legbench.recording.stream import schema_for

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="sequenced packets are Linux's")
SCHEMA = schema_for({})


class Played:
    """A disk of the loop, and the socket of the process that it takes this for."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.waited = 0
        self.theirs: Any = None

        def started(samples: int, events: int, number: int) -> SimpleNamespace:
            self.theirs = socket.socket(fileno=os.dup(number))
            self.theirs.setblocking(False)
            return SimpleNamespace(pid=4711, wait=self._wait)

        monkeypatch.setattr(process_disk, "_started", started)
        self.files = (append_to(folder / "samples"), append_to(folder / "events"))
        self.disk = ProcessDisk(*self.files, SCHEMA)

    def _wait(self) -> int:
        self.waited += 1
        return 3

    def report(self, rows: int, samples: int = 0, events: int = 0, *, ended: bool = False) -> None:
        self.theirs.send(REPORT.pack(rows, 0.5, 0.5 + rows, samples, events, ended))

    def take(self, count: int = 2) -> bytes:
        """Hand some rows over; the packet that came."""
        block = RowBlock()
        for row in range(count):
            block.put(*cycle(row))
        columns = block.columns().tobytes()
        self.disk.take(block)
        assert block.count == 0
        packet = self.theirs.recv(longest_packet(SCHEMA))
        assert packet == ROWS + columns
        return packet


@pytest.fixture
def played(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Played]:
    made = Played(tmp_path, monkeypatch)
    yield made
    made.theirs.close()
    made.disk.close()


def test_reports_say_what_is_kept_and_the_first_error_of_either_file(played: Played) -> None:
    kept = played.disk.kept
    assert played.disk.pid == 4711
    assert (kept.rows, kept.first, kept.last) == (0, 0.0, 0.0)
    played.report(50)
    played.take()
    assert (kept.rows, kept.first, kept.last) == (50, 0.5, 50.5)
    assert (kept.error, kept.events_error) == (None, None)
    played.report(50, errno.ENOSPC, errno.EIO)
    played.report(50, errno.EIO, errno.ENOSPC)
    played.take()
    for error, number in ((kept.error, errno.ENOSPC), (kept.events_error, errno.EIO)):
        assert isinstance(error, OSError)
        assert (error.errno, error.strerror) == (number, os.strerror(number))
    played.report(70)
    played.take()
    assert kept.rows == 70
    assert isinstance(kept.error, OSError)


def test_rows_that_could_not_be_encoded_are_no_error_of_the_system(played: Played) -> None:
    played.report(0, UNKNOWN)
    played.take()
    assert str(played.disk.kept.error) == "the rows could not be encoded"


def test_a_process_that_has_gone_is_noticed_with_the_next_rows(played: Played) -> None:
    played.theirs.close()
    played.disk.take(RowBlock())
    assert str(played.disk.kept.error) == "the recording process ended early"


def test_a_process_that_hangs_up_after_its_reports_is_noticed(played: Played) -> None:
    played.report(50)
    played.theirs.shutdown(socket.SHUT_WR)
    played.take()
    assert played.disk.kept.rows == 50
    assert str(played.disk.kept.error) == "the recording process ended early"


def test_a_long_line_goes_in_parts(played: Played) -> None:
    size = longest_packet(SCHEMA) - 1
    assert size == 8 * 50 * len(SCHEMA)
    for length in (5, size, size + 1, 2 * size):
        line = (b"0123456789" * (length // 10 + 1))[: length - 1] + b"\n"
        played.disk.event(line)
        parts = [played.theirs.recv(size + 2) for _ in range(-(-length // size))]
        assert [part[:1] for part in parts] == [EVENT] * len(parts)
        assert b"".join(part[1:] for part in parts) == line


def test_a_run_ends_with_the_report_of_its_end(played: Played) -> None:
    played.report(20)
    played.report(70, ended=True)
    played.disk.finish()
    assert played.theirs.recv(9) == END
    assert (played.waited, played.disk.kept.rows, played.disk.kept.error) == (1, 70, None)


def test_a_process_that_ends_without_that_report_has_ended_early(played: Played) -> None:
    played.report(20)
    played.theirs.shutdown(socket.SHUT_WR)
    played.disk.finish()
    assert (played.waited, played.disk.kept.rows) == (1, 20)
    assert str(played.disk.kept.error) == "the recording process ended early, with status 3"


def test_what_the_queue_does_not_take_waits_here_in_its_order(played: Played) -> None:
    block = RowBlock()
    sent = 0
    while not played.disk._waiting:
        block.put(*cycle(sent))
        played.disk.take(block)
        sent += 1
    block.put(*cycle(sent))
    played.disk.take(block)
    assert len(played.disk._waiting) == 2
    assert not played.disk.lagging
    # As soon as there is room, what waits goes first.
    for row in range(sent):
        assert played.theirs.recv(longest_packet(SCHEMA))[:1] == ROWS
        if row == sent - 2:
            played.disk.event(b"now\n")
    assert [played.theirs.recv(longest_packet(SCHEMA))[:1] for _ in (0, 1)] == [ROWS, EVENT]
    assert not played.disk._waiting


def test_a_closed_disk_holds_no_file_open(played: Played) -> None:
    for file in played.files:
        os.fstat(file.fd)
    played.disk.close()
    for file in played.files:
        with pytest.raises(OSError, match=os.strerror(errno.EBADF)):
            os.fstat(file.fd)
    # The fixture closes once more what it can.
    played.files[0].fd, played.files[1].fd = os.dup(2), os.dup(2)


def test_of_a_run_that_has_no_row_nothing_is_kept() -> None:
    kept = Kept()
    assert (kept.rows, kept.first, kept.last) == (0, 0.0, 0.0)
    assert (kept.error, kept.events_error) == (None, None)
