"""What commands print: results on stdout, everything else on stderr."""

import select
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from legbench.errors import ConfigError
from legbench.strict_json import null_for_nan


def report_error(message: str) -> None:
    """One line that begins with `legbench: `."""
    print(f"legbench: {message}", file=sys.stderr)


def note(message: str) -> None:
    """Something that a person may want to know and a script does not."""
    print(message, file=sys.stderr)


def print_json(content: Mapping[str, Any]) -> None:
    """Print one JSON object on stdout; a number that JSON lacks is null."""
    import json

    print(json.dumps(null_for_nan(content), allow_nan=False))


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write one JSON object as a whole file; make its folder if need be.

    Raises:
        ConfigError: it cannot be written; an older file is untouched.
    """
    import json

    from legbench.recording.files import write_whole

    text = json.dumps(null_for_nan(content), indent=1, allow_nan=False)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, f"{text}\n".encode())
    except OSError as error:
        raise ConfigError(f"{path.parent} cannot be written: {error}") from error


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
