"""Tests in forks of one process: which functions each enters, and which notice a fault.

The libraries are imported once. A child gets the changed module from memory, before any test is
imported, and ends with the status of pytest; nothing is written into the source tree.
"""

import hashlib
import importlib
import importlib.abc
import importlib.machinery
import json
import os
import resource
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType, ModuleType
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src" / "legbench"
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "legbench-mutants"
HEAVY = (
    *("can", "canopen", "durand", "serial", "numpy", "scipy.integrate", "pyarrow.parquet"),
    *("mujoco", "tyro", "hypothesis", "_hypothesis_pytestplugin", "unittest.mock", "pdb"),
)
TIMES, GRACE = 3.0, 20.0
"""A child may take this many times the time of its tests without faults, and this long more [s]."""
QUICK = 3
"""Files of tests that are tried before all others."""
CHILD_FAILED = 70
"""Status of a child in which pytest could not be run."""
UNNOTICED = (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED)
UNUSABLE = (pytest.ExitCode.USAGE_ERROR, CHILD_FAILED)


@dataclass(frozen=True, kw_only=True)
class Passed:
    """A test that passes without faults."""

    name: str
    seconds: float
    entered: frozenset[tuple[str, str]]
    """Functions of the package that it entered: module and qualified name."""


@dataclass(frozen=True, kw_only=True)
class Fault:
    """One mutation of one file with the tests that might notice."""

    path: Path
    changed: str
    text: str
    """Place, and the lines before and after."""
    tests: Sequence[Passed]


class _Planted(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Gives one module of the package from a changed text."""

    def __init__(self, module: str, path: Path, source: str) -> None:
        self._module, self._path, self._source = module, path, source

    def find_spec(self, fullname: str, *_: object) -> importlib.machinery.ModuleSpec | None:
        if fullname != self._module:
            return None
        return importlib.machinery.ModuleSpec(fullname, self, origin=str(self._path))

    def exec_module(self, module: ModuleType) -> None:
        module.__file__ = str(self._path)
        exec(compile(self._source, str(self._path), "exec"), module.__dict__)


class _Select:
    """Keeps chosen tests only, those that were fast first."""

    def __init__(self, chosen: Sequence[Passed]) -> None:
        self._seconds = {test.name: test.seconds for test in chosen}

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        kept = [item for item in items if item.nodeid in self._seconds]
        # Tests of one speed stay together, so that their fixtures are made once.
        kept.sort(key=lambda item: sum(self._seconds[item.nodeid] > s for s in (0.03, 0.3, 1.0)))
        items[:] = kept


class _Trace:
    """Notes which functions of the package each passing test of a file enters."""

    def __init__(self) -> None:
        self._entered: set[CodeType] = set()
        self._prepared: set[CodeType] = set()
        """Entered by fixtures; what they made may serve later tests, too."""
        self.passed: list[dict[str, Any]] = []

    def _note(self, frame: FrameType, event: str, _: object) -> None:
        self._entered.add(frame.f_code)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self) -> Any:
        self._entered = set()
        threading.settrace(self._note)
        sys.settrace(self._note)
        try:
            return (yield)
        finally:
            sys.settrace(None)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        entered = self._entered.copy()
        if report.when == "setup":
            self._prepared |= entered
        elif report.when == "call" and report.passed:
            places = sorted(filter(None, map(_place, entered | self._prepared)))
            test = {"name": report.nodeid, "seconds": report.duration, "entered": places}
            self.passed.append(test)


def _place(code: CodeType) -> tuple[str, str] | None:
    """Module and qualified name of a function of the package."""
    path = Path(code.co_filename)
    if not path.is_relative_to(PACKAGE):
        return None
    return (path.relative_to(PACKAGE).as_posix(), code.co_qualname)


def _child(work: Callable[[Path], int], seconds: float) -> int | None:
    """Status of some work in a fork of this process; none when its time was up."""
    folder = Path(tempfile.mkdtemp(prefix="mutant-"))
    pid = os.fork()
    if pid == 0:
        os.setpgid(0, 0)
        # Time of the processor for loops without an end, so that a busy machine fails nothing.
        limit = int(seconds) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
        silent = os.open(os.devnull, os.O_RDWR)
        for number in (0, 1, 2):
            os.dup2(silent, number)
        status = CHILD_FAILED
        try:
            status = int(work(folder))
        finally:
            os._exit(status)
    until = time.monotonic() + 4.0 * seconds
    try:
        while time.monotonic() < until:
            done, status = os.waitpid(pid, os.WNOHANG)
            if done:
                return os.waitstatus_to_exitcode(status) if os.WIFEXITED(status) else None
            time.sleep(0.01)
        os.killpg(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
        return None
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _pytest(folder: Path, files: Iterable[str], plugin: object, *more: str) -> int:
    os.chdir(ROOT)
    hypothesis = importlib.import_module("hypothesis")
    kept = (hypothesis.Phase.explicit, hypothesis.Phase.generate)
    hypothesis.settings.register_profile("mutants", phases=kept, database=None)
    hypothesis.settings.load_profile("mutants")
    # Hypothesis is imported before pytest can rewrite its assertions, and that is no matter.
    silent = ["-q", "-W", "ignore::pytest.PytestAssertRewriteWarning", "-p", "no:cacheprovider"]
    usual = [*silent, f"--basetemp={folder / 't'}", *more]
    return pytest.main([*usual, *sorted(files)], plugins=[plugin])


def _digest(paths: Iterable[Path]) -> str:
    total = hashlib.sha256()
    for path in sorted(paths):
        total.update(path.read_bytes())
    return total.hexdigest()[:32]


def trace(file: Path) -> list[Passed]:
    """The passing tests of a file and what they enter; remembered until a test changes."""
    helpers = [path for path in file.parent.glob("*.py") if not path.name.startswith("test_")]
    kept = CACHE / f"{file.stem}-{_digest([file, *helpers])}.json"
    if not kept.exists():

        def work(folder: Path) -> int:
            entered = _Trace()
            status = _pytest(folder, [str(file.relative_to(ROOT))], entered)
            part = folder / "part"
            part.write_text(json.dumps(entered.passed))
            shutil.move(part, kept)
            return status

        CACHE.mkdir(parents=True, exist_ok=True)
        status = _child(work, 600.0)
        if not kept.exists():
            sys.exit(f"{file}: its tests cannot be traced; run them with pytest first")
        if status != 0:
            # Such as one that looks at a process of its own while all are slow under the trace.
            print(f"{file.name}: a test fails under the trace and is left out", file=sys.stderr)
    return [
        Passed(
            name=test["name"],
            seconds=test["seconds"],
            entered=frozenset((module, name) for module, name in test["entered"]),
        )
        for test in json.loads(kept.read_text())
    ]


def noticed(fault: Fault) -> bool:
    """Whether a test fails under a fault."""
    tests = fault.tests
    name = ".".join(fault.path.relative_to(ROOT / "src").with_suffix("").parts)
    seconds: dict[str, float] = {}
    for test in tests:
        file = test.name.split("::")[0]
        seconds[file] = seconds.get(file, 0.0) + test.seconds
    # Those that name the module know it best.
    files = sorted(seconds, key=lambda file: (name not in (ROOT / file).read_text(), seconds[file]))

    def work(folder: Path) -> int:
        sys.meta_path.insert(0, _Planted(name, fault.path, fault.changed))
        # Most faults are noticed at once; the other files need not be imported for them.
        for some in (files[:QUICK], files[QUICK:]):
            status = _pytest(folder, some, _Select(tests), "-x") if some else 0
            if status not in UNNOTICED:
                return status
        return 0

    if not files:
        return False
    status = _child(work, GRACE + TIMES * sum(test.seconds for test in tests))
    if status in UNUSABLE:
        sys.exit(f"{fault.path}: pytest ended with {status} under {fault.text}")
    return status not in UNNOTICED


def prepare() -> None:
    """Import what every child needs and no fault is planted in."""
    sys.path.insert(0, str(ROOT / "src"))
    for name in HEAVY:
        importlib.import_module(name)
