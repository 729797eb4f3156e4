"""`events.jsonl`: one JSON object a line, for what happens rarely."""

import json
from pathlib import Path
from typing import Any

from legbench.errors import RecordingError
from legbench.reading import LARGEST_EVENTS, UnreadableError, parse_json, read_file
from legbench.recording.layout import EVENTS, TORN
from legbench.recording.manifest import plain
from legbench.writing import write_whole

Event = dict[str, Any]


def encode_event(time: float, name: str, detail: dict[str, Any]) -> bytes:
    """Return the line of one event, with the plant time [s] and its name."""
    record = plain({"time": time, "name": name, **detail})
    return json.dumps(record, allow_nan=False, ensure_ascii=False).encode() + b"\n"


def read_events(run: Path) -> tuple[list[Event], int]:
    """Return the events of the folder `run`, and how many lines are not whole.

    Raises:
        RecordingError: the file is there but cannot be read.
    """
    lines = _lines(run)
    events = [event for event in map(_parse, lines) if event is not None]
    return events, len(lines) - len(events)


def drop_torn_events(run: Path) -> int:
    """Keep only the whole lines, the old file beside them as `events.jsonl.torn`.

    Returns:
        How many lines were not whole; with none, nothing is changed.

    Raises:
        RecordingError: the file cannot be read.
        OSError: it cannot be written; it is what it was before.
    """
    lines = _lines(run)
    whole = [line for line in lines if _parse(line) is not None]
    if len(whole) < len(lines):
        write_whole(run / (EVENTS + TORN), (run / EVENTS).read_bytes())
        write_whole(run / EVENTS, b"".join(line + b"\n" for line in whole))
    return len(lines) - len(whole)


def _lines(run: Path) -> list[bytes]:
    try:
        content = read_file(run / EVENTS, LARGEST_EVENTS)
    except FileNotFoundError:
        return []
    except UnreadableError as error:
        raise RecordingError(f"{run / EVENTS}: {error}") from error
    return [line for line in content.split(b"\n") if line]


def _parse(line: bytes) -> Event | None:
    try:
        event = parse_json(line)
    except UnreadableError:
        return None
    return event if isinstance(event, dict) else None
