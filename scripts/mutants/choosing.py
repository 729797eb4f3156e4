"""Choice of the tests that a fault is tried with: those that run its line, the fastest first."""

import ast
import re
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from functools import cache
from pathlib import Path

from tracing import ROOT, Passed, Timed

BUDGET = 2.5
"""Tests that run a changed line are tried for so long, timed with probes [s]."""
IMPORTING_FILES = 10
"""A fault that an import runs is tried with the tests of so many files."""


def span(tree: ast.Module, line: int) -> tuple[int, int]:
    """First and last line of the statement at a line; of one that holds others, its head."""
    first, last = line, line
    for node in ast.walk(tree):
        if isinstance(node, ast.stmt) and node.lineno <= line <= (node.end_lineno or 0):
            body = getattr(node, "body", None)
            end = body[0].lineno - 1 if body else node.end_lineno
            if end is not None and end >= line and node.lineno >= first - 30:
                first, last = node.lineno, max(end, node.lineno)
    return first, last


def runs_at_import(tree: ast.Module, tests: Sequence[Passed], module: str, line: int) -> bool:
    """Whether the function around a line is run by no test itself, as one that makes a table."""
    around = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and node.lineno <= line <= (node.end_lineno or 0)
    ]
    outermost = min(around, key=lambda node: node.lineno, default=None)
    if outermost is None:
        return False
    first, last = outermost.body[0].lineno, outermost.end_lineno or line
    return not any(passed.runs(module, first, last) for passed in tests)


def _affordable(tests: Iterable[Timed], budget: float, near: Collection[str] = ()) -> list[Timed]:
    """Tests for a budget's time: the cheaper, and the fewer of its file come before, the sooner.

    Files differ in what they look at, so that many of them find more than all tests of a few.
    Those of some near files get half of the time for themselves.
    """
    taken: Counter[str] = Counter()
    ranked: list[tuple[float, str, Timed]] = []
    for test in sorted(tests, key=lambda test: test.seconds):
        file = file_of(test)
        taken[file] += 1
        ranked.append((taken[file] * test.seconds, test.name, test))
    reached = [test for *_, test in sorted(ranked, key=lambda entry: entry[:2])]
    kept = _within(budget / 2, (test for test in reached if file_of(test) in near))
    known = {test.name for test in kept}
    left = budget - sum(test.seconds for test in kept)
    kept += _within(left, (test for test in reached if test.name not in known))
    # Tests of one speed and file stay together, so that their fixtures are made once.
    return sorted(
        kept, key=lambda test: (sum(test.seconds > s for s in (0.03, 0.3, 1.0)), test.name)
    )


def _within(budget: float, tests: Iterable[Timed]) -> list[Timed]:
    """The first of some tests that fit into a time, those left out that do not."""
    kept: list[Timed] = []
    for test in tests:
        if test.seconds <= budget:
            budget -= test.seconds
            kept.append(test)
    return kept


def in_function(
    tests: Sequence[Passed], budget: float, module: str, first: int, last: int
) -> list[Timed]:
    """Tests that run one of the lines from `first` to `last` of a module."""
    running = [test.test for test in tests if test.runs(module, first, last)]
    near = {file for file in map(file_of, running) if imports(ROOT / file, module)}
    return _affordable(running, budget, near)


def at_import(
    tests: Sequence[Passed], budget: float, module: str, name: str, holder: str
) -> list[Timed]:
    """Tests of a module, those files first that say the name that is changed, or import it.

    A table of a standard's numbers is often compared as a whole, by the name of what holds it.
    """
    seconds: dict[str, float] = {}
    for passed in tests:
        if module in passed.lines:
            file = file_of(passed.test)
            seconds[file] = seconds.get(file, 0.0) + passed.test.seconds
    every = {file_of(passed.test) for passed in tests}
    near = {file for file in every if imports(ROOT / file, module)}
    named = {file for file in near | seconds.keys() if _says(ROOT / file, name)}
    held = {file for file in near if holder and _says(ROOT / file, holder)}

    def order(file: str) -> tuple[int, bool, float]:
        # Who says the very name comes before who says that of what holds it.
        closeness = 2 * (file in named) + (file in held) + (file in near)
        return -closeness, file not in near, seconds.get(file, 0.0)

    chosen = sorted(near | seconds.keys(), key=order)[:IMPORTING_FILES]
    some = (passed.test for passed in tests if file_of(passed.test) in chosen)
    return _affordable(some, budget, named | held | near)


@cache
def _text(file: Path) -> str:
    return file.read_text()


@cache
def _says(file: Path, name: str) -> bool:
    return re.search(rf"\b{re.escape(name)}\b", _text(file)) is not None


def file_of(test: Timed) -> str:
    """File of a test, as pytest names it."""
    return test.name.split("::")[0]


@cache
def imports(file: Path, module: str) -> bool:
    """Whether a file of tests imports a module of the package by its name."""
    name = "legbench." + module.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    room, _, last = name.rpartition(".")
    return bool(re.search(rf"\b{name}\b|from {room} import .*\b{last}\b", _text(file)))
