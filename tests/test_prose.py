"""Laws over the prose and the size of the sources."""

import ast
import re
from collections.abc import Iterator

from source_trees import SOURCES, tree_of

FIRST_WORDS = re.compile(
    r"(of|and|that|with|in|on|at|by|for|from|to|into|onto|under|over|between|beside|beyond|but|or"
    r"|so|like|as|than|then|after|before|until|while|where|when|within|without|through|against"
    r"|across|along|among|around|behind|below|above|if|because|though|although|since|nor|yet"
    r"|the same)\b",
    re.IGNORECASE,
)
"""Prepositions and conjunctions: a docstring that begins with one leans on its neighbour."""
MOST_LINES, MOST_FUNCTION_LINES = 300, 50
"""Longest source file, and longest function with its docstring and without its decorators."""


def docstrings(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and text of every docstring, those of attributes and constants included."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if not isinstance(body, list):
            continue
        for before, here in zip([None, *body], body, strict=False):
            first = before is None and not isinstance(node, ast.If | ast.For | ast.While | ast.With)
            value = here.value if isinstance(here, ast.Expr) else None
            if not isinstance(value, ast.Constant) or not isinstance(value.value, str):
                continue
            if first or isinstance(before, ast.Assign | ast.AnnAssign):
                yield here.lineno, value.value.strip()


def test_docstrings_can_be_read_alone() -> None:
    found = [
        f"{path.name}:{line}: {text.splitlines()[0]}"
        for path in SOURCES
        for line, text in docstrings(tree_of(path))
        if FIRST_WORDS.match(text)
    ]
    assert found == []


def test_no_file_is_too_long_to_be_read_at_once() -> None:
    found = [
        f"{path.parent.name}/{path.name}: {count} lines"
        for path in SOURCES
        if (count := len(path.read_text(encoding="utf-8").splitlines())) > MOST_LINES
    ]
    assert found == []


def test_no_function_is_too_long_to_be_seen_at_once() -> None:
    found = [
        f"{path.name}:{node.lineno}: {node.name}, {size} lines"
        for path in SOURCES
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and (size := (node.end_lineno or node.lineno) - node.lineno + 1) > MOST_FUNCTION_LINES
    ]
    assert found == []
