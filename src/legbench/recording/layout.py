"""Names inside a run folder."""

import re
from datetime import UTC, datetime
from typing import Final

FORMAT: Final = 2
"""Version of the format; it rises when an older reader would misread a run."""

RUN: Final = "run.json"
STREAM: Final = "samples.arrows"
ARCHIVE: Final = "samples.parquet"
EVENTS: Final = "events.jsonl"
TORN: Final = ".torn"
"""Suffix under which `recover` keeps a file that had something unreadable in it."""

TIME: Final = "t_ns"
"""Column of the plant time since reset, rounded to the nanosecond (int64) [ns]."""

RUNNING: Final = "running"
COMPLETE: Final = "complete"
INTERRUPTED: Final = "interrupted"
FAULT: Final = "fault"
RECOVERED: Final = "recovered"
CLOSING: Final = (COMPLETE, INTERRUPTED, FAULT)
"""The statuses with which a writer may close a run."""


def file_safe(name: str) -> str:
    """Return `name` with everything but letters, digits, dots and dashes turned into dashes."""
    return re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("-.")


def run_name(start: datetime, hint: str | None = None) -> str:
    """Return `<UTC time>_<hint>`, the name of a run that began at `start`."""
    return "_".join(filter(None, (f"{start.astimezone(UTC):%Y%m%d-%H%M%S}", file_safe(hint or ""))))
