"""TOML text of nested tables, with a comment behind a key where there is one."""

import json
import re
from collections.abc import Mapping
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml_text(tables: Mapping[str, Any], comments: Mapping[str, str]) -> str:
    """Text of the tables, plain keys first; numbers in full.

    Args:
        tables: what to write.
        comments: dotted key -> what to say behind its value.
    """
    return "\n".join(_lines(tables, comments, "")).strip("\n") + "\n"


def _lines(tables: Mapping[str, Any], comments: Mapping[str, str], at: str) -> list[str]:
    lines: list[str] = []
    inner = {key: value for key, value in tables.items() if isinstance(value, Mapping)}
    for key, value in tables.items():
        if key not in inner:
            comment = f"  # {comments[at + key]}" if at + key in comments else ""
            lines.append(f"{_key(key)} = {toml_value(value)}{comment}")
    for key, value in inner.items():
        name = f"{at}{key}"
        below = _lines(value, comments, f"{name}.")
        plain = any(not isinstance(entry, Mapping) for entry in value.values()) or not value
        head = ["", f"[{'.'.join(map(_key, name.split('.')))}]"] if plain else []
        lines += [*head, *below]
    return lines


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else toml_value(key)


def toml_value(value: object) -> str:
    """One value on one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml_value(entry) for entry in value) + "]"
    if isinstance(value, Mapping):
        entries = ", ".join(f"{_key(str(k))} = {toml_value(v)}" for k, v in value.items())
        return "{" + entries + "}"
    return repr(value)
