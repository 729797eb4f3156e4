"""Docstrings under the fields of a dataclass."""

import ast
import inspect
import re
import textwrap
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import lru_cache
from itertools import pairwise
from types import MappingProxyType
from typing import Any

_UNIT = re.compile(r"\[([^\[\]]+)\]\.?\s*$")


@lru_cache(maxsize=256)
def field_docs(kind: type[Any]) -> Mapping[str, str]:
    """Docstring of each field on one line; empty where the source cannot be read.

    To find a class in its source takes 3 ms, and a command line asks for several.
    """
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(kind)))
    except (OSError, TypeError, SyntaxError):
        return MappingProxyType({})
    (body,) = [node.body for node in tree.body if isinstance(node, ast.ClassDef)]
    found: dict[str, str] = {}
    for entry, after in pairwise(body):
        if isinstance(entry, ast.AnnAssign) and isinstance(entry.target, ast.Name):
            text = after.value if isinstance(after, ast.Expr) else None
            if isinstance(text, ast.Constant) and isinstance(text.value, str):
                found[entry.target.id] = " ".join(text.value.split())
    return MappingProxyType(found)


def unit_comments(value: Any, tables: Mapping[str, Any], at: str = "") -> dict[str, str]:
    """Unit in brackets of each dotted key, for the tables that were made of a dataclass."""
    found: dict[str, str] = {}
    docs = field_docs(type(value))
    for entry in fields(value):
        if entry.name not in tables:
            continue
        inner, below = getattr(value, entry.name), tables[entry.name]
        if unit := _UNIT.search(docs.get(entry.name, "")):
            found[f"{at}{entry.name}"] = f"[{unit[1]}]"
        if is_dataclass(inner) and isinstance(below, Mapping):
            settings = "settings" in below and "kind" in below
            content = below["settings"] if settings else below
            name = f"{at}{entry.name}." + ("settings." if settings else "")
            found |= unit_comments(inner, content, name)
    return found
