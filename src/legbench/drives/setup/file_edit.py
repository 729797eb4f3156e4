"""Changes of single values in a TOML file of a user; every other byte of it stays as it is."""

import tomllib
from collections.abc import Mapping, MutableMapping
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from legbench.errors import ConfigError
from legbench.reading import LARGEST_TOML, UnreadableError, read_file
from legbench.writing import write_whole

Place = tuple[str | int, ...]
"""Way to a value: names of tables and keys, and indices into lists of tables."""


def edited(text: str, changes: Mapping[Place, int | float | str]) -> str:
    """Return a TOML text with some values replaced or added.

    Comments, order, line ends and the notation of all other values are kept. A table on the way
    to a value that is not there is added.

    Raises:
        UnreadableError: the text is no TOML, or has no such list of tables.
    """
    try:
        document = tomlkit.parse(text)
    except TOMLKitError as error:
        raise UnreadableError(f"not valid TOML: {error}") from None
    for place, value in changes.items():
        _set(document, place, value)
    changed = document.as_string()
    if "\r\n" in text and "\n" not in text.replace("\r\n", ""):
        # Lines that are added end with a line feed alone.
        changed = changed.replace("\r\n", "\n").replace("\n", "\r\n")
    _check(text, changed, changes)
    return changed


def edit_file(
    path: Path, changes: Mapping[Place, int | float | str], out: Path | None = None
) -> Path:
    """Replace values of a file, whole or not at all; returns the file that was written.

    A symbolic link stays one, and the file behind it is the one that is changed. The rights of a
    file that is there are kept.

    Args:
        path: file to read.
        changes: place -> new value.
        out: file to write; by default the one that is read.

    Raises:
        ConfigError: it is no TOML, or has no such place.
        OSError: it cannot be written.
    """
    try:
        text = read_file(path, LARGEST_TOML).decode("utf-8")
        changed = edited(text, changes)
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file") from None
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: it is no UTF-8 text: {error}; save it as UTF-8") from None
    except UnreadableError as error:
        raise ConfigError(f"{path}: {error}") from None
    target = (out or path).resolve()
    mode = target.stat().st_mode & 0o777 if target.exists() else None
    write_whole(target, changed.encode("utf-8"))
    if mode is not None:
        target.chmod(mode)
    return out or path


def _set(document: MutableMapping[str, Any], place: Place, value: int | float | str) -> None:
    inner: Any = document
    for step in place[:-1]:
        if isinstance(step, str) and isinstance(inner, MutableMapping) and step not in inner:
            inner[step] = tomlkit.table()
        try:
            inner = inner[step]
        except (KeyError, IndexError, TypeError):
            raise UnreadableError(f"there is no {_name(place)}") from None
    if not isinstance(inner, MutableMapping):
        raise UnreadableError(f"there is no table for {_name(place)}")
    inner[place[-1]] = value


def _check(text: str, changed: str, changes: Mapping[Place, int | float | str]) -> None:
    """Refuse an edit whose result does not read as the old values with these changes."""
    wanted: dict[str, Any] = tomllib.loads(text)
    for place, value in changes.items():
        _set_plain(wanted, place, value)
    if tomllib.loads(changed) != wanted:
        raise UnreadableError("the values cannot be replaced in this layout; write them by hand")


def _set_plain(wanted: dict[str, Any], place: Place, value: int | float | str) -> None:
    inner: Any = wanted
    for step in place[:-1]:
        inner = inner.setdefault(step, {}) if isinstance(inner, dict) else inner[step]
    inner[place[-1]] = value


def _name(place: Place) -> str:
    return ".".join(f"[{step}]" if isinstance(step, int) else step for step in place)
