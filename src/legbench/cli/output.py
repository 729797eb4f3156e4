"""Output of the commands: results on stdout, everything else on stderr."""

import errno
import math
import os
import select
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from legbench.errors import UnwritableError
from legbench.strict_json import null_for_nan

WRONG_USAGE: Final = 2
"""Exit status of a command that was refused as it was asked, before anything was done."""


def report_error(message: str) -> None:
    """Print an error as one line on stderr that begins with `legbench: `."""
    note(f"legbench: {message}")


def note(message: str) -> None:
    """Print a line on stderr that a person may want to know and a script does not.

    Where nobody reads it any more, or stderr was closed before the program began, it is dropped:
    words end no command.
    """
    _to_stderr(f"{message}\n")


def print_json(content: Mapping[str, Any]) -> None:
    """Print one JSON object on stdout; a number that JSON lacks is null."""
    import json

    print(json.dumps(null_for_nan(content), allow_nan=False))


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write one JSON object as a whole file; make its folder if need be.

    Raises:
        UnwritableError: it cannot be written; an older file is untouched.
    """
    import json

    from legbench.writing import save_whole

    save_whole(path, json.dumps(null_for_nan(content), indent=1, allow_nan=False) + "\n")


@contextmanager
def results_in(path: Path | None) -> Iterator[None]:
    """Make the folder that results are to be written to before they are computed.

    Of what was made for it, nothing stays behind that is empty at the end, after ^C for example.

    Args:
        path: the folder; none where nothing is to be written.

    Raises:
        UnwritableError: it cannot be made.
    """
    made: list[Path] = []
    try:
        if path is not None:
            _make(path, made)
        yield
    finally:
        with suppress(OSError):  # A folder that holds something stays, and those above it.
            for folder in reversed(made):
                folder.rmdir()


def _make(path: Path, made: list[Path]) -> None:
    """Make a folder and those above it that are missing, each noted in `made` once it is there."""
    from legbench.writing import reason

    try:
        for folder in (*reversed(path.parents), path):
            if not folder.is_dir():
                folder.mkdir()
                made.append(folder)
        if not os.access(path, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        raise UnwritableError(
            f"cannot write {path}: {reason(error)}; name a folder that you can write"
        ) from error


def progress(done: int, total: int, left: float | None = None) -> None:
    """Draw a line that overwrites itself, on a terminal that takes it at once.

    A stalled terminal (^S, a lost connection) must not hold up who reports, and one that is gone
    is no terminal. The bar of rich, which tyro brings along, draws from a thread of its own, which
    waits for a stalled terminal while it holds the lock that every update takes.

    Args:
        done: how much is done.
        total: how much there is to do.
        left: time that the rest will take, where that is known [s].
    """
    if not _draws():
        return
    width = 32
    filled = width * done // max(total, 1)
    bar = "#" * filled + "-" * (width - filled)
    end = "\n" if done >= total else ""
    # Blanks overwrite what a longer line before has left.
    rest = f", {duration_text(left)} left" if left is not None and done < total else ""
    _to_stderr(f"\r[{bar}] {100 * done // max(total, 1):3d} %{rest:<18}{end}")


def status_line(text: str) -> None:
    """Draw words that overwrite the ones before, on a terminal that takes them at once."""
    if _draws():
        _to_stderr(f"\r{text:<79}")


def end_status_line() -> None:
    """Leave the last words of `status_line` where they are."""
    if _draws():
        _to_stderr("\n")


def timed_progress() -> Callable[[int, int], None]:
    """Return a progress line that tells the time left, by the pace since its first report."""
    left_after = pace()

    def tell(done: int, total: int) -> None:
        progress(done, total, left_after(done, total))

    return tell


def pace() -> Callable[[int, int], float | None]:
    """Return what tells the time left [s] by the pace since it was first asked; none at first.

    Less done than before begins another work, with a pace of its own.
    """
    began, first, last = 0.0, 0, math.inf

    def left_after(done: int, total: int) -> float | None:
        nonlocal began, first, last
        now = time.monotonic()
        if done < last:
            began, first = now, done
        last = done
        return (now - began) * (total - done) / (done - first) if done > first else None

    return left_after


def duration_text(seconds: float) -> str:
    """Return a time in hours, minutes and seconds, as 1:02:03 or 2:03 [s]."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def _draws() -> bool:
    """Whether stderr is a terminal that takes a line now."""
    with suppress(OSError, ValueError):
        if sys.stderr is not None and sys.stderr.isatty():
            return bool(select.select([], [sys.stderr], [], 0.0)[1])
    return False


def _to_stderr(text: str) -> None:
    """Write to stderr, if there is one; once it takes nothing, /dev/null takes the rest.

    Otherwise the text that it refused would be tried again when the interpreter ends, and turn
    the exit status into 120.
    """
    if sys.stderr is None:
        return
    try:
        sys.stderr.write(text)
        sys.stderr.flush()
    except (OSError, ValueError):
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())
