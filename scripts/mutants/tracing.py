"""Which lines of the package each test runs, remembered until test or package changes."""

import hashlib
import json
import os
import sys
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src" / "legbench"
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "legbench-mutants"
TIMES = 100
"""A function is followed line by line until so many of its calls in one test showed nothing new."""


@dataclass(frozen=True, kw_only=True)
class Timed:
    """A test and the time of the processor that it took under the trace."""

    name: str
    seconds: float
    """Fixtures of its own included [s]."""


@dataclass(frozen=True, kw_only=True)
class Passed:
    """A test that passes without faults, and what it runs."""

    test: Timed
    lines: dict[str, int]
    """Module, as its path in the package -> the lines that ran, line n as bit n."""

    def runs(self, module: str, first: int, last: int) -> bool:
        """Whether it runs one of the lines from `first` to `last` of a module."""
        return bool(self.lines.get(module, 0) >> first & ((1 << (last + 1 - first)) - 1))


class LineTrace:
    """A plugin that notes which lines of the package each passing test runs."""

    def __init__(self) -> None:
        self._lines: dict[str, set[int]] = {}
        self._calls: dict[CodeType, int] = {}
        self._prepared: dict[str, set[int]] = {}
        """Run by fixtures; what they made may serve later tests, too."""
        self._began = 0.0
        self.passed: list[dict[str, Any]] = []

    def _on_call(self, frame: FrameType, _event: str, _: object) -> Callable[..., Any] | None:
        code = frame.f_code
        if not code.co_filename.startswith(str(PACKAGE)):
            return None
        calls = self._calls.get(code, 0)
        if calls > TIMES:
            return None
        self._calls[code] = calls + 1
        lines = self._lines.setdefault(code.co_filename, set())
        calls_of = self._calls

        def on_line(frame: FrameType, event: str, _: object) -> Callable[..., Any]:
            if event == "line" and frame.f_lineno not in lines:
                lines.add(frame.f_lineno)
                calls_of[code] = 0
            return on_line

        return on_line

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self) -> Any:
        """Trace one test with its fixtures."""
        self._lines, self._calls, self._began = {}, {}, _processor_time()
        threading.settrace(self._on_call)
        sys.settrace(self._on_call)
        try:
            return (yield)
        finally:
            sys.settrace(None)
            threading.settrace(None)  # pyright: ignore[reportArgumentType]

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep what a test ran once it has passed."""
        if report.when == "setup":
            _add(self._prepared, self._lines)
        elif report.when == "call" and report.passed:
            ran: dict[str, set[int]] = {}
            _add(ran, self._lines)
            _add(ran, self._prepared)
            lines = {_module(name): _bits(ran[name]) for name in sorted(ran)}
            seconds = _processor_time() - self._began
            test = {"name": report.nodeid, "seconds": seconds, "lines": lines}
            self.passed.append(test)


def _processor_time() -> float:
    """Time of the processor that this process and those that it has waited for took [s]."""
    children = os.times()
    return time.process_time() + children.children_user + children.children_system


def _add(total: dict[str, set[int]], lines: dict[str, set[int]]) -> None:
    for name, numbers in lines.items():
        total.setdefault(name, set()).update(numbers)


def _bits(lines: set[int]) -> str:
    return f"{sum(1 << line for line in lines):x}"


def _module(name: str) -> str:
    return Path(name).relative_to(PACKAGE).as_posix()


def digest(paths: Iterable[Path]) -> str:
    """A short text that changes with any of some files."""
    total = hashlib.sha256()
    for path in sorted(paths):
        total.update(path.read_bytes() if path.exists() else b"")
    return total.hexdigest()[:32]


def _kept(file: Path) -> Path:
    helpers = [path for path in file.parent.glob("*.py") if not path.name.startswith("test_")]
    return CACHE / f"{file.stem}-{digest([file, *helpers])}.json"


def save(file: Path, passed: Sequence[dict[str, Any]]) -> None:
    """Remember the trace of a file of tests."""
    modules = sorted({module for test in passed for module in test["lines"]})
    sources = {module: digest([PACKAGE / module]) for module in modules}
    kept = _kept(file)
    CACHE.mkdir(parents=True, exist_ok=True)
    part = kept.with_suffix(f".{os.getpid()}")
    part.write_text(json.dumps({"sources": sources, "passed": passed}))
    part.replace(kept)


def load(file: Path) -> list[Passed] | None:
    """The trace of a file of tests; none if it was never made, or of sources that have changed."""
    kept = _kept(file)
    if not kept.exists():
        return None
    stored = json.loads(kept.read_text())
    if any(digest([PACKAGE / module]) != was for module, was in stored["sources"].items()):
        return None
    return [
        Passed(
            test=Timed(name=test["name"], seconds=test["seconds"]),
            lines={module: int(bits, 16) for module, bits in test["lines"].items()},
        )
        for test in stored["passed"]
    ]
