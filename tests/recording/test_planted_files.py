"""Files of a run folder that are no files, or files that no run wrote."""

import json
import os
from pathlib import Path

import pytest

from legbench.errors import RecordingError
from legbench.reading import LARGEST_JSON
from legbench.recording import events
from legbench.recording.events import read_events
from legbench.recording.manifest import read_manifest
from legbench.writing import write_whole


@pytest.mark.parametrize("name", ["run.json", "events.jsonl"])
@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("fifo", "it is a FIFO; give a regular file"),
        ("device", "it is a device; give a regular file"),
        ("folder", "it is a directory; give a regular file"),
    ],
)
def test_what_is_no_file_is_named_and_not_waited_for(
    kind: str, words: str, name: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    if kind == "fifo":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        path.mkdir()
    read = read_manifest if name == "run.json" else read_events
    with pytest.raises(RecordingError, match=words):
        read(tmp_path)


def test_a_link_to_a_file_is_read(tmp_path: Path) -> None:
    """Stores of large data keep what they hold behind links."""
    (tmp_path / "stored").write_text('{"format": 1}')
    (tmp_path / "run.json").symlink_to("stored")
    assert read_manifest(tmp_path) == {"format": 1}


def test_a_file_that_is_too_large_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with (tmp_path / "run.json").open("wb") as file:
        file.truncate(LARGEST_JSON + 1)
    with pytest.raises(RecordingError, match=rf"has more than {LARGEST_JSON} bytes, the limit"):
        read_manifest(tmp_path)
    (tmp_path / "events.jsonl").write_bytes(b"{}\n" * 4)
    monkeypatch.setattr(events, "LARGEST_EVENTS", 11)
    with pytest.raises(RecordingError, match="has more than 11 bytes, the limit"):
        read_events(tmp_path)


def test_json_that_is_too_deep_is_damage(tmp_path: Path) -> None:
    deep = "[" * 100_000
    (tmp_path / "run.json").write_text(deep)
    with pytest.raises(RecordingError, match="tables or lists lie deeper than 32"):
        read_manifest(tmp_path)
    (tmp_path / "events.jsonl").write_text(json.dumps({"name": "end"}) + "\n" + deep + "\n")
    assert read_events(tmp_path) == ([{"name": "end"}], 1)


def test_a_draft_that_is_a_link_is_not_written_through(tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.write_text("kept\n")
    (tmp_path / ".run.json.draft").symlink_to(precious)
    write_whole(tmp_path / "run.json", b"{}")
    assert precious.read_text() == "kept\n"
    assert (tmp_path / "run.json").read_bytes() == b"{}"
    assert not (tmp_path / "run.json").is_symlink()
