"""The names inside a run folder and the columns of its samples."""

import re
from typing import Final

from legbench.signals import SIGNALS

FORMAT: Final = 1
"""Rises when an older reader would misread a run; a new column alone does not raise it."""

RUN: Final = "run.json"
STREAM: Final = "samples.arrows"
ARCHIVE: Final = "samples.parquet"
EVENTS: Final = "events.jsonl"
TORN: Final = ".torn"
"""Suffix under which `recover` keeps a file that had something unreadable in it."""

TIME: Final = "t_ns"
"""Plant time since reset, rounded to the nanosecond (int64) [ns]."""

INT8_COLUMNS: Final = frozenset({"phase", "contact"})
"""Columns stored as int8; `contact` is null where the plant does not know it."""

COLUMNS: Final[tuple[str, ...]] = tuple(column for signal in SIGNALS for column in signal.columns)
"""Columns of the samples after `t_ns`, in their order on disk; float64 but `INT8_COLUMNS`."""

UNITS: Final[dict[str, str]] = {TIME: "ns"} | {
    column: signal.unit for signal in SIGNALS for column in signal.columns
}

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
