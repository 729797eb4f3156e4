"""Whatever a user hands over as a file ends in one line that says what is wrong with it."""

import os
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from legbench.design import load_design
from legbench.design.requirements import load_requirements
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.errors import LegbenchError, RecordingError
from legbench.reading import (
    DEEPEST,
    LARGEST_TOML,
    LONGEST_LINE,
    UnreadableError,
    parse_json,
    read_toml,
)
from legbench.recording.events import read_events
from legbench.recording.layout import EVENTS, RUN
from legbench.recording.manifest import read_manifest

TOML_READERS = (load_bus, load_limits, load_design, load_requirements)
NAMES = [reader.__name__ for reader in TOML_READERS]
TEXTS = {
    "deep list": (b"a = " + b"[" * 2000 + b"]" * 2000, "deeper than 32"),
    "deeper list than the parser takes": (b"a = [\n" + b"[\n" * 90_000, "deeper than 32"),
    "deep dotted key": (b"a" + b".a" * 1500 + b" = 1", "deeper than 32"),
    "deep inline table": (b"a = " + b"{a = " * 100 + b"1" + b"}" * 100, "deeper than 32"),
    "long line": (b"a" + b".a" * 60_000 + b" = 1", "a line of 120005 bytes, the limit is 8192"),
    "huge": (b"#\n" * LARGEST_TOML, f"more than {LARGEST_TOML} bytes"),
    "no UTF-8": (b"name = '\xff\xfe'", "is no UTF-8 text"),
    "thousands of digits": (b"a = " + b"9" * 5000, "not valid TOML: .*4300 digits"),
    "NUL": (b"a = \0", "not valid TOML"),
}
SPECIAL: dict[str, tuple[Callable[[Path], object], str]] = {
    "directory": (Path.mkdir, "it is a directory; give a regular file"),
    "FIFO": (os.mkfifo, "it is a FIFO; give a regular file"),
    "device": (lambda path: path.symlink_to("/dev/zero"), "it is a device; give a regular file"),
    "terminal": (lambda path: path.symlink_to("/dev/ptmx"), "it is a device; give a regular file"),
    "loop": (lambda path: path.symlink_to(path), "cannot be read: Too many levels"),
}


@pytest.mark.parametrize("reader", TOML_READERS, ids=NAMES)
@pytest.mark.parametrize("case", list(TEXTS))
def test_a_text_that_no_reader_can_take_is_named(
    case: str, reader: Callable[[Path], object], tmp_path: Path
) -> None:
    content, words = TEXTS[case]
    path = tmp_path / "file.toml"
    path.write_bytes(content)
    with pytest.raises(LegbenchError, match=words) as caught:
        reader(path)
    assert str(caught.value).startswith(str(path))
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("reader", TOML_READERS, ids=NAMES)
@pytest.mark.parametrize("case", list(SPECIAL))
def test_what_is_no_regular_file_is_named_and_never_waited_for(
    case: str, reader: Callable[[Path], object], tmp_path: Path
) -> None:
    make, words = SPECIAL[case]
    path = tmp_path / "file.toml"
    make(path)
    with pytest.raises(LegbenchError, match=words):
        reader(path)


def test_a_socket_is_no_file(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as there:
        there.bind(str(tmp_path / "s"))
        with pytest.raises(UnreadableError):
            read_toml(tmp_path / "s")


def test_a_missing_file_is_a_missing_file(tmp_path: Path) -> None:
    for path in (tmp_path / "none", tmp_path / "none" / "none"):
        with pytest.raises(FileNotFoundError):
            read_toml(path)
    (tmp_path / "plain").touch()
    with pytest.raises(FileNotFoundError):
        read_toml(tmp_path / "plain" / "none")


@pytest.mark.parametrize("content", [b"[" * 100_000, b"[" * 40 + b"]" * 40, b'{"a":' * 50_000])
def test_json_that_is_too_deep_is_unreadable(content: bytes, tmp_path: Path) -> None:
    with pytest.raises(UnreadableError, match="deeper than 32"):
        parse_json(content)
    (tmp_path / RUN).write_bytes(content)
    with pytest.raises(RecordingError, match="is damaged: tables or lists lie deeper") as caught:
        read_manifest(tmp_path)
    assert str(tmp_path / RUN) in str(caught.value)
    (tmp_path / EVENTS).write_bytes(content + b'\n{"time": 1, "name": "end"}\n')
    events, bad = read_events(tmp_path)
    assert (len(events), bad) == (1, 1)


@pytest.mark.parametrize("case", list(SPECIAL))
def test_a_run_folder_may_hold_anything(case: str, tmp_path: Path) -> None:
    make, words = SPECIAL[case]
    for name, reader in ((RUN, read_manifest), (EVENTS, read_events)):
        make(tmp_path / name)
        with pytest.raises(RecordingError, match=words):
            reader(tmp_path)


def test_the_limits_themselves_are_taken(tmp_path: Path) -> None:
    path = tmp_path / "edge.toml"
    path.write_text("a = " + "[" * (DEEPEST - 1) + "]" * (DEEPEST - 1), encoding="utf-8")
    assert read_toml(path)["a"] is not None
    path.write_text(f"a = '{'x' * (LONGEST_LINE - 6)}'", encoding="utf-8")
    assert len(read_toml(path)["a"]) == LONGEST_LINE - 6
    comment = "#" + "x" * 1022 + "\n"
    path.write_text(comment * (LARGEST_TOML // 1024), encoding="utf-8")
    assert read_toml(path) == {}
