"""When files of a run are synced, and what becomes of the rest when one of them fails."""

import errno
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from recorded_rows import cycle

from legbench.recording import store as store_module
from legbench.recording.files import Appender, append_to
from legbench.recording.log_file import LogFile
from legbench.recording.rows import RowBlock
from legbench.recording.store import RunStore
from legbench.recording.stream import END_MARK, WholeBatches, encode_schema, schema_for
from legbench.signals import Floats

SCHEMA = schema_for({})


def block(first: int, count: int = 50, *, truth: bool = True) -> Floats:
    rows = RowBlock()
    for row in range(first, first + count):
        rows.put(*cycle(row, truth=truth))
    return rows.columns()


class Files:
    """Samples, events and a log of a store, a clock that stands still, and what was synced."""

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        self.synced: list[str] = []
        self.refused: dict[str, int] = {}
        self.folder = folder
        self.opened = {name: append_to(folder / name) for name in ("samples", "events", "log")}
        patch.setattr(store_module.time, "monotonic", lambda: self.now)
        patch.setattr(os, "fsync", self._fsync)
        self.opened["samples"].append(encode_schema(SCHEMA))
        self.store = RunStore(self.opened["samples"], self.opened["events"], SCHEMA)

    def _fsync(self, fd: int) -> None:
        (name,) = (name for name, file in self.opened.items() if file.fd == fd)
        self.synced.append(name)
        if name in self.refused:
            raise OSError(self.refused[name], os.strerror(self.refused[name]))

    def rows(self) -> list[int]:
        stream = WholeBatches(self.folder / "samples")
        return [round(t / 1e6) for batch in stream for t in batch["t_ns"].to_pylist()]


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Files]:
    made = Files(tmp_path, monkeypatch)
    yield made
    for file in made.opened.values():
        file.close()


def test_all_files_are_synced_once_a_second_whoever_writes(files: Files) -> None:
    files.store.log(files.opened["log"])
    files.store.write(block(0))
    files.now += 0.999
    files.store.event(b"{}\n")
    assert files.synced == []
    files.now += 0.001
    files.store.write(block(50))
    assert files.synced == ["samples", "events", "log"]
    files.now += 0.999
    files.store.write(block(100))
    assert len(files.synced) == 3
    files.now += 0.001
    files.store.event(b"{}\n")
    assert files.synced == 2 * ["samples", "events", "log"]
    files.store.finish()
    assert files.synced == 3 * ["samples", "events", "log"]


def test_rows_and_their_times_are_counted(files: Files) -> None:
    kept = files.store.kept
    assert (kept.rows, kept.first, kept.last) == (0, 0.0, 0.0)
    files.store.write(block(300, 7))
    assert (kept.rows, kept.first, kept.last) == (7, 0.3, pytest.approx(0.306))
    files.store.write(block(307, 50, truth=False))
    assert (kept.rows, kept.first, kept.last) == (57, 0.3, pytest.approx(0.356))
    files.store.finish()
    assert files.rows() == list(range(300, 357))


@pytest.mark.parametrize("end", [False, True])
def test_a_run_that_was_cut_off_has_no_end_mark(files: Files, end: bool) -> None:
    files.store.write(block(0))
    files.store.finish(end=end)
    content = (files.folder / "samples").read_bytes()
    assert content.endswith(END_MARK) is end
    assert files.synced == ["samples", "events"]


def test_after_a_failed_batch_nothing_is_added_but_events(files: Files) -> None:
    files.store.write(block(0))
    before = (files.folder / "samples").read_bytes()
    real = files.opened["samples"].fd
    files.opened["samples"].fd = os.open("/dev/null", os.O_RDONLY)
    files.store.write(block(50))
    os.close(files.opened["samples"].fd)
    files.opened["samples"].fd = real
    error = files.store.kept.error
    assert isinstance(error, OSError)
    assert error.errno == errno.EBADF
    files.store.write(block(50))
    files.store.event(b"{}\n")
    files.store.finish()
    assert (files.folder / "samples").read_bytes() == before
    assert (files.folder / "events").read_bytes() == b"{}\n"
    assert files.store.kept.rows == 50
    assert files.store.kept.error is error


@pytest.mark.parametrize("name", ["samples", "events"])
def test_a_disk_that_refuses_a_sync_is_the_first_failure(files: Files, name: str) -> None:
    files.refused[name] = errno.EIO
    files.store.write(block(0))
    files.now += 1.0
    files.store.event(b"{}\n")
    kept = files.store.kept
    failed = {"samples": kept.error, "events": kept.events_error}
    other = "events" if name == "samples" else "samples"
    assert failed[other] is None
    first = failed[name]
    assert isinstance(first, OSError)
    assert first.errno == errno.EIO
    files.refused[name] = errno.ENOSPC
    files.now += 1.0
    files.store.event(b"{}\n")
    assert files.synced.count("samples") == files.synced.count("events") == 2
    assert (kept.error if name == "samples" else kept.events_error) is first


@pytest.mark.parametrize(
    ("number", "failed"), [(errno.EIO, errno.EIO), (errno.EINVAL, 0), (errno.ENOSPC, errno.ENOSPC)]
)
def test_a_log_fails_with_its_disk_unless_it_has_none(
    files: Files, number: int, failed: int
) -> None:
    log = LogFile(files.opened["log"])
    log.append(b"one\n")
    files.refused["log"] = number
    log.sync()
    assert log.failed == failed
    log.append(b"two\n")
    log.sync()
    # After its first failure nothing more is written, synced or told.
    assert files.synced == ["log"] * (1 if failed else 2)
    assert (files.folder / "log").read_bytes() == (b"one\n" if failed else b"one\ntwo\n")
    assert log.failed == failed


def test_a_log_is_closed_once_and_synced_before(tmp_path: Path) -> None:
    file = append_to(tmp_path / "log")
    log = LogFile(file)
    log.append(b"one\n")
    log.close()
    log.close()
    log.sync()
    assert log.failed == 0
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(file.fd)


def test_the_first_failure_of_a_log_stays(tmp_path: Path) -> None:
    log = LogFile(Appender(os.open("/dev/full", os.O_WRONLY)))
    log.append(b"one\n")
    assert log.failed == errno.ENOSPC
    log.close()
    assert log.failed == errno.ENOSPC
    gone = LogFile(append_to(tmp_path / "gone"))
    os.close(gone._file.fd)
    gone.close()
    assert gone.failed == errno.EBADF


def test_what_no_system_call_failed_of_is_an_input_output_error(
    files: Files, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(fd: int) -> None:
        raise OSError("no number")

    monkeypatch.setattr(os, "fsync", refuse)
    log = LogFile(files.opened["log"])
    log.sync()
    assert log.failed == errno.EIO


def test_unlike_blocks_are_written_as_they_are(files: Files) -> None:
    """Other numbers of rows, other unknowns, in any order."""
    parts = [(50, True), (3, True), (50, False), (50, True), (1, False)]
    start = 0
    for count, truth in parts:
        files.store.write(block(start, count, truth=truth))
        start += count
    files.store.finish()
    assert files.rows() == list(range(start))
    contact = [
        value
        for batch in WholeBatches(files.folder / "samples")
        for value in batch["contact"].to_pylist()
    ]
    known = np.repeat([truth for _, truth in parts], [count for count, _ in parts])
    assert contact == [
        int(row % 3 == 0) if there else None for row, there in enumerate(known.tolist())
    ]
