"""Which lines of the package each test runs, remembered until test or package changes."""

import hashlib
import json
import os
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from probes import Probes

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src" / "legbench"
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "legbench-mutants"


@dataclass(frozen=True, kw_only=True)
class Timed:
    """A test and the time of the processor that it took with probes."""

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

    def __init__(self, probes: Probes) -> None:
        self._probes = probes
        self._prepared: dict[str, int] = {}
        """Run by fixtures; what they made may serve later tests, too."""
        self._began = 0.0
        self.passed: list[dict[str, Any]] = []

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logstart(self) -> None:
        """Begin to note one test with its fixtures."""
        self._probes.reset()
        self._began = _processor_time()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep what a test ran once it has passed."""
        if report.when == "setup":
            self._prepared = _union(self._prepared, self._probes.lines())
        elif report.when == "call" and report.passed:
            seconds = _processor_time() - self._began
            ran = _union(self._prepared, self._probes.lines())
            lines = {name: f"{ran[name]:x}" for name in sorted(ran)}
            test = {"name": report.nodeid, "seconds": seconds, "lines": lines}
            self.passed.append(test)


def _processor_time() -> float:
    """Time of the processor that this process and those that it has waited for took [s]."""
    children = os.times()
    return time.process_time() + children.children_user + children.children_system


def _union(first: dict[str, int], second: dict[str, int]) -> dict[str, int]:
    names = first.keys() | second.keys()
    return {name: first.get(name, 0) | second.get(name, 0) for name in names}


def digest(paths: Iterable[Path], text: str = "") -> str:
    """A short text that changes with any of some files, and with another text."""
    total = hashlib.sha256(text.encode())
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
