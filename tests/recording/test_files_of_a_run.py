"""Locks that are waited for, manifests that are filled in, events line by line."""

import errno
import fcntl
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pytest

from legbench import __version__
from legbench.errors import ConfigError, FormatError, RecordingError
from legbench.recording import files as files_module
from legbench.recording.disk import Disk
from legbench.recording.events import drop_torn_events, encode_event, read_events
from legbench.recording.files import append_to, lock
from legbench.recording.manifest import (
    OWN_KEYS,
    new_manifest,
    parse_manifest,
    plain,
    to_json,
)
from legbench.recording.writer import RunWriter


class Clock:
    """Time that passes only while somebody sleeps, and what happens meanwhile."""

    def __init__(self, patch: pytest.MonkeyPatch, happens: Callable[[float], None]) -> None:
        self.now, self._happens = 50.0, happens
        patch.setattr(files_module.time, "monotonic", lambda: self.now)
        patch.setattr(files_module.time, "sleep", self._sleep)

    def _sleep(self, seconds: float) -> None:
        assert 0.0 < seconds <= 0.05
        self.now += seconds
        self._happens(self.now - 50.0)


def opened(path: Path) -> int:
    path.touch()
    return os.open(path, os.O_RDWR)


@pytest.mark.parametrize(("released", "taken"), [(0.0, True), (0.5, True), (1.5, False)])
def test_a_lock_is_waited_for_as_long_as_one_has_patience(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, released: float, taken: bool
) -> None:
    holder, mine = opened(tmp_path / "x"), opened(tmp_path / "x")
    fcntl.flock(holder, fcntl.LOCK_EX)
    clock = Clock(
        monkeypatch,
        lambda after: fcntl.flock(holder, fcntl.LOCK_UN) if after >= released else None,
    )
    if taken:
        lock(mine, tmp_path, patience=1.0)
        assert clock.now - 50.0 == pytest.approx(max(released, 0.02), abs=0.03)
        with pytest.raises(BlockingIOError):
            fcntl.flock(holder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    else:
        with pytest.raises(RecordingError, match="still being written by another process; end"):
            lock(mine, tmp_path, patience=1.0)
        assert clock.now - 50.0 == pytest.approx(1.0, abs=0.03)
    os.close(holder)
    os.close(mine)


def test_without_patience_a_lock_is_tried_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(after: float) -> None:
        raise AssertionError("waited")

    Clock(monkeypatch, never)
    holder, mine = opened(tmp_path / "x"), opened(tmp_path / "x")
    lock(holder, tmp_path)
    with pytest.raises(RecordingError, match="is still being written"):
        lock(mine, tmp_path)
    os.close(holder)
    lock(mine, tmp_path)
    os.close(mine)


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOTSUP, errno.EBADF])
def test_a_file_system_without_locks_is_taken_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    def refuse(fd: int, operation: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(fcntl, "flock", refuse)
    lock(3, tmp_path, patience=9.0)


def test_a_system_without_locks_is_taken_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(files_module, "fcntl", None)
    lock(-1, tmp_path)


def test_a_lock_that_fails_otherwise_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(fd: int, operation: int) -> None:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(fcntl, "flock", refuse)
    with pytest.raises(OSError, match="Input/output error"):
        lock(3, tmp_path)


def test_a_file_that_is_there_is_not_appended_to(tmp_path: Path) -> None:
    file = append_to(tmp_path / "x")
    file.append(b"mine")
    with pytest.raises(FileExistsError):
        append_to(tmp_path / "x")
    # Whatever moves the offset, a record goes to the end.
    os.lseek(file.fd, 0, os.SEEK_SET)
    file.append(b" too")
    file.close()
    assert (tmp_path / "x").read_bytes() == b"mine too"
    assert (tmp_path / "x").stat().st_mode & 0o777 & ~0o644 == 0


def test_plain_values_are_those_of_json() -> None:
    given: dict[Any, Any] = {
        "array": np.array([[1.0, np.inf], [-np.inf, np.nan]]),
        "number": np.float32(0.5),
        "flag": np.bool_(True),
        3: ("x", None, True, {"deep": [np.int8(-3)]}),
        "path": Path("a/b"),
    }
    wanted = {
        "array": [[1.0, "inf"], ["-inf", "nan"]],
        "number": 0.5,
        "flag": True,
        "3": ["x", None, True, {"deep": [-3]}],
        "path": "a/b",
    }
    assert plain(given) == wanted
    assert json.loads(to_json(given)) == wanted
    assert type(plain(given)["flag"]) is bool


def test_versions_that_are_told_stay_and_others_are_looked_up() -> None:
    given = {"provenance": {"versions": {"numpy": "mine", "extra": "1"}, "seed": 4}, "x": 1}
    made = new_manifest(given, id="a", created="then")
    versions = made["provenance"]["versions"]
    assert versions.pop("python")
    assert versions == {"numpy": "mine", "extra": "1", "pyarrow": pyarrow.__version__}
    assert made["provenance"]["seed"] == 4
    assert (made["format"], made["legbench"], made["id"], made["created"], made["x"]) == (
        *(2, __version__, "a", "then", 1),
    )
    assert (made["status"], made["cause"]) == ("running", None)
    assert given["provenance"] == {"versions": {"numpy": "mine", "extra": "1"}, "seed": 4}


@pytest.mark.parametrize("key", OWN_KEYS)
def test_each_key_of_the_recording_is_its_own(key: str) -> None:
    with pytest.raises(ConfigError, match=f"the manifest's {key} are filled in by the recording"):
        new_manifest({key: None, "seed": 1}, id="a", created="then")


@pytest.mark.parametrize(("format", "known"), [(0, False), (1, True), (2, True), (3, False)])
def test_formats_up_to_the_present_one_are_read(format: int, known: bool) -> None:
    content = json.dumps({"format": format, "x": 1}).encode()
    if known:
        assert parse_manifest(content, source="it") == {"format": format, "x": 1}
    else:
        with pytest.raises(FormatError, match=r"^it"):
            parse_manifest(content, source="it")


def test_an_event_is_one_line_whatever_it_says() -> None:
    detail: dict[str, Any] = {"text": 'a\n"b" \N{GREEK SMALL LETTER MU}', "value": np.float64(2.0)}
    line = encode_event(0.5, "notice", detail)
    assert line.count(b"\n") == 1
    assert line.endswith(b"\n")
    assert json.loads(line) == {"time": 0.5, "name": "notice", **detail}
    # Text is kept as it is read, in UTF-8, in an event as in the manifest.
    micro = "\N{GREEK SMALL LETTER MU}m".encode()
    assert micro in encode_event(0.5, "notice", {"unit": micro.decode()})
    assert micro in to_json({"unit": micro.decode()})


def test_a_run_that_is_closed_holds_no_file_open(tmp_path: Path) -> None:
    writer = RunWriter.create(tmp_path, {})
    disk = writer._disk
    assert isinstance(disk, Disk)
    for file in (disk._samples, disk._events):
        os.fstat(file.fd)
    writer.close()
    for file in (disk._samples, disk._events):
        with pytest.raises(OSError, match=os.strerror(errno.EBADF)):
            os.fstat(file.fd)


@pytest.mark.parametrize(
    ("content", "names", "bad"),
    [
        (b"", [], 0),
        (b'{"name": "a"}\n', ["a"], 0),
        (b'{"name": "a"}\n{"name": "b"}', ["a", "b"], 0),
        (b'{"name": "a"}\n\n\n{"name": "b"}\n', ["a", "b"], 0),
        (b'{"name": "a"}\n[1]\n3\n{"na', ["a"], 3),
        (b'{"na\n{"name": "b"}\n', ["b"], 1),
    ],
)
def test_lines_that_are_no_event_are_counted_and_set_aside(
    tmp_path: Path, content: bytes, names: list[str], bad: int
) -> None:
    path = tmp_path / "events.jsonl"
    path.write_bytes(content)
    events, torn = read_events(tmp_path)
    assert ([event["name"] for event in events], torn) == (names, bad)
    assert drop_torn_events(tmp_path) == bad
    aside = tmp_path / "events.jsonl.torn"
    assert aside.exists() is (bad > 0)
    if bad:
        assert aside.read_bytes() == content
        wanted = b"".join(json.dumps({"name": name}).encode() + b"\n" for name in names)
        assert path.read_bytes() == wanted
    else:
        assert path.read_bytes() == content
    assert drop_torn_events(tmp_path) == 0
    path.unlink()
    assert read_events(tmp_path) == ([], 0)


@pytest.mark.parametrize(
    ("hint", "suffix"),
    [("a b/c", "_a-b-c"), (None, ""), ("", ""), ("-x.", "_x"), ("//", ""), ("1_2", "_1_2")],
)
def test_a_hint_is_made_safe_for_a_name(tmp_path: Path, hint: str | None, suffix: str) -> None:
    with RunWriter.create(tmp_path, {}, name=hint) as writer:
        pass
    assert writer.path.name[15:] == suffix
