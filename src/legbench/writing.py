"""Files that are whole or not there, and how their failure is told."""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from legbench.errors import RecordingError, UnwritableError


def reason(error: Exception) -> str:
    """Say why `error` happened, in one line, with the name of its errno if it has one."""
    if isinstance(error, OSError) and error.errno is not None:
        return f"{os.strerror(error.errno)} [{errno.errorcode.get(error.errno, error.errno)}]"
    # Arrow tells what it met in several lines.
    return " ".join(str(error).split())


def put_in_place(draft: Path, path: Path) -> None:
    """Make the finished file `draft` be `path`, at once and surviving a power cut.

    Raises:
        OSError: the draft could not be synced or renamed; `path` is what it was before.
    """
    for target in (draft, draft.parent):
        fd = os.open(target, os.O_RDONLY)
        try:
            os.fsync(fd)
        finally:
            os.close(fd)
        if target == draft:
            draft.replace(path)


def write_whole(path: Path, content: bytes) -> None:
    """Write `content` as the file `path`, or leave `path` untouched; raises OSError."""
    draft = path.with_name(f".{path.name}.draft")
    try:
        # Made anew: whatever lies there, such as a link, is not written through.
        draft.unlink(missing_ok=True)
        with draft.open("xb") as file:
            file.write(content)
        put_in_place(draft, path)
    except BaseException:
        with suppress(OSError):
            draft.unlink()
        raise


def save_whole(path: Path, content: str) -> None:
    """Write a file for the user, whole, and make its folder if need be.

    Raises:
        UnwritableError: it cannot be written; an older file is untouched.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, content.encode())
    except OSError as error:
        raise UnwritableError(
            f"cannot write {path}: {reason(error)}; name a file that you can write"
        ) from None


@contextmanager
def draft_of(path: Path) -> Iterator[Path]:
    """Yield a draft file with `path`'s suffix, which replaces `path` if no exception is raised.

    The folder is made if need be.

    Raises:
        RecordingError: nothing can be written there.
    """
    draft = path.with_name(f".{path.stem}.draft{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # The draft is made anew: whatever lies there, such as a link, is not written through.
        draft.unlink(missing_ok=True)
        draft.touch(exist_ok=False)
    except OSError as error:
        raise RecordingError(f"cannot write {path}: {reason(error)}") from error
    try:
        yield draft
        put_in_place(draft, path)
    except RecordingError:
        raise
    except OSError as error:
        raise RecordingError(f"cannot write {path}: {reason(error)}") from error
    finally:
        draft.unlink(missing_ok=True)
