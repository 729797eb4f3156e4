"""Lines beside the rows: never waited for, never with a hole, kept when the loop's process dies."""

import fcntl
import os
import signal
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import recorded_rows
from hypothesis import given, settings
from hypothesis import strategies as st
from recorded_rows import append_rows

from legbench.errors import RecordingError
from legbench.recording import logs
from legbench.recording.files import Appender, append_to
from legbench.recording.log_file import LogFile
from legbench.recording.logs import ENDED_EARLY, LINES_AT_ONCE, TOO_SLOW
from legbench.recording.process_disk import ProcessDisk
from legbench.recording.reader import load
from legbench.recording.repair import recover
from legbench.recording.ring import RING_BYTES, Ring
from legbench.recording.writer import RunWriter

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="shared memory files are Linux's")
WAYS = [False, pytest.param(True, marks=LINUX)]
"""By the loop itself, by the recording process."""
PATIENCE = 30.0
"""Longest that a process may take on a busy machine [s]."""
PIPE_BYTES = 1 << 16


def lines(count: int, size: int = 40) -> list[bytes]:
    return [b"%0*d\n" % (size - 1, number) for number in range(count)]


@pytest.mark.parametrize("realtime", WAYS)
def test_a_log_is_its_lines_in_order(tmp_path: Path, realtime: bool) -> None:
    """More than the memory of a ring, and a rest that fills no batch."""
    wanted = lines(20_321, size=1000)
    assert sum(map(len, wanted)) > 1.1 * RING_BYTES
    with RunWriter.create(tmp_path, {}, realtime=realtime) as writer:
        log = writer.log("lines.log")
        path = writer.path / "lines.log"
        for number, line in enumerate(wanted):
            log.write(line)
            if number % 5000 == 4999:
                await_size(path, 1000 * (number - 499))
        append_rows(writer, 120)
        log.close()
        log.close()
        log.write(b"too late\n")
        assert log.error is None
        assert path.read_bytes() == b"".join(wanted)
        append_rows(writer, 30, start=120)
    assert len(load(writer.path).time) == 150


def await_size(path: Path, size: int) -> None:
    deadline = time.monotonic() + PATIENCE
    while path.stat().st_size < size:
        assert time.monotonic() < deadline
        time.sleep(1e-3)


@contextmanager
def stuck() -> Iterator[tuple[int, Appender]]:
    """A pipe for a disk that takes 64 KiB, then stalls until somebody reads its other end."""
    drain, end = os.pipe()
    try:
        yield drain, Appender(end)
    finally:
        os.close(drain)


def unread(pipe: int) -> int:
    return int.from_bytes(fcntl.ioctl(pipe, termios.FIONREAD, bytes(4)), sys.byteorder)


@contextmanager
def drained(pipe: int) -> Iterator[bytearray]:
    """Read a pipe until its other end is closed; what was read."""
    content = bytearray()

    def read() -> None:
        while part := os.read(pipe, 1 << 20):
            content.extend(part)

    reader = threading.Thread(target=read)
    reader.start()
    yield content
    reader.join()


@LINUX
def test_a_disk_that_stalls_holds_up_no_line_and_loses_none(tmp_path: Path) -> None:
    wanted = lines(30_000)
    with RunWriter.create(tmp_path, {}, realtime=True) as writer, stuck() as (pipe, file):
        log = writer._disk.log(file)
        for number, line in enumerate(wanted):
            log.write(line)
            if number % 1000 == 0:
                append_rows(writer, 1, start=number)
        # All of it has been taken, and the disk has had a part of it at the most.
        assert unread(pipe) <= PIPE_BYTES < sum(map(len, wanted))
        with drained(pipe) as content:
            log.close()
        assert log.error is None
        assert content == b"".join(wanted)
    assert load(writer.path).complete
    assert len(load(writer.path).time) == 30


@LINUX
def test_a_disk_that_stalls_for_too_long_ends_the_log_not_the_run(tmp_path: Path) -> None:
    wanted = lines(RING_BYTES // 1000 + 2000, size=1000)
    with RunWriter.create(tmp_path, {}, realtime=True) as writer, stuck() as (pipe, file):
        log = writer._disk.log(file)
        for line in wanted:
            log.write(line)
        append_rows(writer, 60)
        assert log.error == TOO_SLOW == "the disk is too slow, 16 MiB of lines wait for it"
        with drained(pipe) as content:
            await_drained(content)
            log.write(b"after the hole\n")
            log.close()
        assert log.error == TOO_SLOW
        kept = len(content) // 1000
        assert content == b"".join(wanted[:kept])
        assert RING_BYTES - 500 * 1000 <= len(content) <= RING_BYTES + PIPE_BYTES
    assert load(writer.path).complete


def await_drained(content: bytearray) -> None:
    deadline = time.monotonic() + PATIENCE
    while len(content) < RING_BYTES - 500 * 1000:
        assert time.monotonic() < deadline
        time.sleep(1e-3)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("realtime", WAYS)
def test_a_disk_that_is_full_ends_the_log_not_the_run(tmp_path: Path, realtime: bool) -> None:
    with RunWriter.create(tmp_path, {}, realtime=realtime) as writer:
        log = writer._disk.log(Appender(os.open("/dev/full", os.O_WRONLY)))
        for number, line in enumerate(lines(20_000)):
            log.write(line)
            if number % 50 == 0:
                append_rows(writer, 1, start=number)
        log.close()
        assert log.error == "No space left on device"
    assert load(writer.path).complete
    assert len(load(writer.path).time) == 400


@pytest.mark.parametrize("realtime", WAYS)
def test_a_log_that_cannot_be_made_is_refused(tmp_path: Path, realtime: bool) -> None:
    writer = RunWriter.create(tmp_path, {}, realtime=realtime)
    with pytest.raises(RecordingError, match=r"events\.jsonl: File exists \[EEXIST\]"):
        writer.log("events.jsonl")
    writer.close()
    with pytest.raises(RecordingError, match="is closed"):
        writer.log("other.log")


def test_a_loop_that_writes_its_own_log_loses_no_line_of_it(tmp_path: Path) -> None:
    writer = RunWriter.create(tmp_path, {})
    log = writer.log("lines.log")
    path = writer.path / "lines.log"
    for number, line in enumerate(lines(LINES_AT_ONCE + 1), start=1):
        log.write(line)
        assert path.stat().st_size == (40 * 500 if number >= 500 else 0)
    writer.close()
    log.close()
    log.write(b"too late\n")
    log.close()
    assert (writer.path / "lines.log").read_bytes() == b"".join(lines(LINES_AT_ONCE + 1))
    assert log.error is None


def test_a_loop_writes_its_lines_some_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert LINES_AT_ONCE == 500
    monkeypatch.setattr(logs, "LINES_AT_ONCE", 3)
    file = LogFile(append_to(tmp_path / "log"))
    log = logs.LoopLog(file)
    for number, size in enumerate((0, 0, 12, 12, 12, 24), start=1):
        log.write(b"%03d\n" % number)
        assert (tmp_path / "log").stat().st_size == size
    log.close()


@LINUX
def test_a_log_that_is_closed_gives_its_memory_up() -> None:
    ring = Ring.create()
    log = logs.RingLog(ring, ring.end)
    os.fstat(ring.fd)
    for _ in range(2):
        log.close()
        with pytest.raises(OSError, match="Bad file descriptor"):
            os.fstat(ring.fd)
    assert log.error is None


@LINUX
def test_a_run_that_is_closed_before_its_log_says_what_is_missing(tmp_path: Path) -> None:
    writer = RunWriter.create(tmp_path, {}, realtime=True)
    log = writer.log("lines.log")
    for line in lines(LINES_AT_ONCE):
        log.write(line)
    writer.close()
    log.write(b"lost\n")
    log.close()
    assert (writer.path / "lines.log").read_bytes() == b"".join(lines(LINES_AT_ONCE))
    assert log.error == ENDED_EARLY


@LINUX
def test_two_logs_have_a_file_each(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {}, realtime=True) as writer:
        first, second = writer.log("first.log"), writer.log("second.log")
        first.write(b"1\n")
        second.write(b"2\n")
        second.close()
        first.write(b"3\n")
        first.close()
        assert (writer.path / "first.log").read_bytes() == b"1\n3\n"
        assert (writer.path / "second.log").read_bytes() == b"2\n"


@LINUX
@pytest.mark.parametrize("frozen", [False, True])
def test_no_line_is_lost_when_the_master_is_killed(tmp_path: Path, frozen: bool) -> None:
    """Not even while the recording process does not run; and none waits for the first row."""
    command = [sys.executable, recorded_rows.__file__, "logged", str(tmp_path), "process"]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as master:
        assert master.stdout is not None
        children = Path(f"/proc/{master.pid}/task/{master.pid}/children")
        assert master.stdout.readline() == b"0\n"
        (run,), (pid,) = tmp_path.iterdir(), map(int, children.read_text().split())
        await_size(run / "lines.log", 1)
        if frozen:
            os.kill(pid, signal.SIGSTOP)
        for line in master.stdout:
            if int(line) == 2000:
                break
        master.kill()
        told = [2000, *map(int, master.stdout.read().split(b"\n")[:-1])][-1]
    if frozen:
        os.kill(pid, signal.SIGCONT)
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            assert recover(run).status == "recovered"
            break
        except RecordingError:
            assert time.monotonic() < deadline
    kept = (run / "lines.log").read_bytes()
    # The last one may have been written and not been told.
    numbers = list(range(told + 1 + (kept.count(b"\n") - told - 1)))
    assert kept == b"".join(b"%d\n" % number for number in numbers)
    assert told <= numbers[-1] <= told + 1


@LINUX
def test_a_log_whose_process_was_killed_says_so(tmp_path: Path) -> None:
    writer = RunWriter.create(tmp_path, {}, realtime=True)
    disk = writer._disk
    assert isinstance(disk, ProcessDisk)
    log = writer.log("lines.log")
    os.kill(disk.pid, signal.SIGKILL)
    disk._process.wait()
    for line in lines(100):
        log.write(line)
    log.close()
    assert log.error == ENDED_EARLY
    with pytest.raises(RecordingError, match="recording process ended early"):
        writer.close()


@LINUX
@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    steps=st.lists(
        st.one_of(st.integers(0, RING_BYTES // 3), st.booleans()), min_size=1, max_size=30
    )
)
def test_a_ring_gives_what_was_put_in_its_order(steps: list[int | bool]) -> None:
    """Sizes are put, looks with or without everything are taken; a model tells what comes out."""
    ring = Ring.create()
    try:
        waiting = seen = 0
        put_total = took_total = 0
        for step in steps:
            if not isinstance(step, bool):
                fits = waiting + step <= RING_BYTES
                assert ring.put(pattern(put_total, step)) is fits
                waiting += step if fits else 0
                put_total += step if fits else 0
                continue
            expected = put_total if step else max(seen, took_total)
            got = ring.look(everything=step)
            seen = put_total
            assert got == pattern(took_total, expected - took_total)
            ring.take(len(got))
            waiting, took_total = waiting - len(got), expected
            assert ring.waiting == waiting
    finally:
        ring.close()


def pattern(start: int, size: int) -> bytes:
    """Bytes whose place in the stream can be told from them."""
    period = 251
    whole = bytes(range(period)) * (size // period + 2)
    return whole[start % period : start % period + size]
