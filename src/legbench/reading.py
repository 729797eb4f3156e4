"""Files that a user hands over: read once, bounded in size and depth, whatever they are."""

import codecs
import json
import os
import stat
import tomllib
from pathlib import Path
from typing import Any

from legbench.errors import LegbenchError

LARGEST_TOML = 1 << 18
"""Largest TOML file [bytes]; the shipped ones have 2 000."""
LARGEST_JSON = 1 << 24
"""Largest JSON document [bytes]; a run's has 5 000."""
LARGEST_EVENTS = 1 << 28
"""Largest file with one JSON object a line [bytes]: a million events."""
LONGEST_LINE = 8192
"""Longest line of a TOML file [bytes]: the parser's time grows with the square of a dotted key."""
DEEPEST = 32
"""Largest number of tables or lists within each other; the shipped files have 4."""
# Without O_NONBLOCK a FIFO that nobody writes to would never be opened; each system has some.
_FLAGS = os.O_RDONLY
for _name in ("O_NONBLOCK", "O_NOCTTY", "O_CLOEXEC", "O_BINARY"):
    _FLAGS |= getattr(os, _name, 0)
_MARKS = {
    codecs.BOM_UTF8: "UTF-8",
    # The marks of UTF-32 begin with those of UTF-16.
    codecs.BOM_UTF32_LE: "UTF-32",
    codecs.BOM_UTF32_BE: "UTF-32",
    codecs.BOM_UTF16_LE: "UTF-16",
    codecs.BOM_UTF16_BE: "UTF-16",
}
"""First bytes of texts in other encodings than plain UTF-8."""
_KINDS = (
    (stat.S_ISDIR, "a directory"),
    (stat.S_ISFIFO, "a FIFO"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


class UnreadableError(LegbenchError, ValueError):
    """Error of a file or a text that its reader cannot take; callers put the path in front."""


def read_file(path: Path, largest: int) -> bytes:
    """Return the bytes of a regular file.

    Args:
        path: what to read.
        largest: longest content that is read [bytes].

    Raises:
        FileNotFoundError: there is no such file.
        UnreadableError: it is a directory, FIFO, socket or device, too large, or unreadable.
    """
    try:
        fd = os.open(path, _FLAGS)
    except (FileNotFoundError, NotADirectoryError):
        raise FileNotFoundError(str(path)) from None
    except (OSError, ValueError) as error:
        raise UnreadableError(f"cannot be read: {_reason(error)}") from None
    mode = os.fstat(fd).st_mode
    if not stat.S_ISREG(mode):
        os.close(fd)
        kind = next((words for is_kind, words in _KINDS if is_kind(mode)), "no regular file")
        raise UnreadableError(f"cannot be read: it is {kind}; give a regular file")
    with os.fdopen(fd, "rb") as file:
        try:
            content = file.read(largest + 1)
        except OSError as error:
            raise UnreadableError(f"cannot be read: {_reason(error)}") from None
    if len(content) > largest:
        raise UnreadableError(
            f"has more than {largest} bytes, the limit for such a file; is it the right one?"
        )
    return content


def _reason(error: Exception) -> str:
    """Say why a system call failed."""
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def read_toml(path: Path) -> dict[str, Any]:
    """Return the tables of a TOML file.

    Raises:
        FileNotFoundError: there is no such file.
        UnreadableError: it cannot be read, is no UTF-8 or no TOML, empty, too large, too wide or
            too deep.
    """
    return parse_toml(read_file(path, LARGEST_TOML))


def parse_toml(content: bytes) -> dict[str, Any]:
    """Return the tables of a TOML text.

    Raises:
        UnreadableError: it is no UTF-8 or no TOML, too wide or too deep; or it is empty, as files
            are that a full disk has cut off.
    """
    if not content.strip():
        raise UnreadableError("is empty; write it anew, or leave it out")
    for mark, encoding in _MARKS.items():
        if content.startswith(mark):
            raise UnreadableError(
                f"begins with the byte order mark of {encoding}; save it as UTF-8 without one"
            )
    longest = max(map(len, content.split(b"\n")))
    if longest > LONGEST_LINE:
        raise UnreadableError(
            f"has a line of {longest} bytes, the limit is {LONGEST_LINE}; break it"
        )
    try:
        tables = tomllib.loads(content.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise UnreadableError(
            f"cannot be read: it is no UTF-8 text: {error}; save it as UTF-8"
        ) from None
    except RecursionError:
        raise _too_deep() from None
    except ValueError as error:  # TOMLDecodeError, or a whole number of thousands of digits
        raise UnreadableError(f"not valid TOML: {error}") from None
    _check_depth(tables)
    return tables


def parse_json(content: bytes | str) -> Any:
    """Return the value of a JSON text.

    Raises:
        UnreadableError: it is no UTF-8 or no JSON, or too deep.
    """
    try:
        value = json.loads(content)
    except RecursionError:
        raise _too_deep() from None
    except ValueError as error:  # JSONDecodeError, UnicodeDecodeError, or thousands of digits
        raise UnreadableError(f"not valid JSON: {error}") from None
    _check_depth(value)
    return value


def _check_depth(value: object) -> None:
    """Refuse what those who walk through it, or print it, could not; without recursion."""
    level: list[object] = [value]
    for _ in range(DEEPEST + 1):
        level = [
            inner
            for outer in level
            if isinstance(outer, dict | list)
            for inner in (outer.values() if isinstance(outer, dict) else outer)
        ]
        if not level:
            return
    raise _too_deep()


def _too_deep() -> UnreadableError:
    return UnreadableError(
        f"tables or lists lie deeper than {DEEPEST} within each other, the limit; flatten them"
    )
