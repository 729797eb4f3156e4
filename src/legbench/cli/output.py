"""What commands print: results on stdout, everything else on stderr."""

import select
import sys
from collections.abc import Mapping
from typing import Any


def report_error(message: str) -> None:
    """One line that begins with `legbench: `."""
    print(f"legbench: {message}", file=sys.stderr)


def note(message: str) -> None:
    """Something that a person may want to know and a script does not."""
    print(message, file=sys.stderr)


def print_json(content: Mapping[str, Any]) -> None:
    """One JSON object on stdout; not-a-number is null."""
    import json

    print(json.dumps(content, allow_nan=False))


def progress(done: int, total: int) -> None:
    """A line that overwrites itself, on a terminal that takes it at once: a stalled one (^S, a lost
    connection) must not hold up who reports.
    """
    if not sys.stderr.isatty() or not select.select([], [sys.stderr], [], 0.0)[1]:
        return
    width = 32
    filled = width * done // max(total, 1)
    bar = "#" * filled + "-" * (width - filled)
    end = "\n" if done >= total else ""
    print(f"\r[{bar}] {100 * done // max(total, 1):3d} %", end=end, file=sys.stderr, flush=True)
