"""Faults planted in forks of a session of pytest whose tests were collected once.

A fault inside a function is planted by giving the function its changed code. One that runs when
its module is imported needs a fork in which nothing of the package is imported yet; that fork gets
the changed module from memory and collects its few tests anew. Nothing is written into the tree.
"""

import gc
import importlib
import importlib.abc
import importlib.machinery
import os
import shutil
import signal
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from types import CodeType, FunctionType, ModuleType

import pytest
from forks import FAILED, in_background, in_fork
from sessions import Session, run_items, run_pytest, traced
from tracing import PACKAGE, ROOT, Timed

HEAVY = (
    *("can", "canopen", "durand", "serial", "numpy", "scipy.integrate", "pyarrow.parquet"),
    *("mujoco", "tyro", "hypothesis", "_hypothesis_pytestplugin", "unittest.mock", "pdb"),
)
TIMES, GRACE = 3.0, 1.0
"""A test may take this many times its time without faults, and this long more [s]."""
COLLECTING = 8.0
"""The time that it may take to import and to collect the files of a few tests [s]."""
UNNOTICED = (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED)
NOT_SO = 71
"""Status of a child in which a fault cannot be planted by exchanging code."""
LEFT_OPEN = 72
"""Status of a child in which something that must be closed was not, at the end of its tests."""
TIME, IMPORT, OPEN = "its time was up", "a module could not be imported", "a file was left open"
"""What shows a fault besides a test that fails."""
UNUSABLE = (pytest.ExitCode.USAGE_ERROR, FAILED)


@dataclass(frozen=True, kw_only=True)
class Fault:
    """One mutation of one file with the tests that might notice."""

    path: Path
    changed: str
    """The whole source with the fault in it."""
    scope: str
    """Qualified name of the function that holds it; empty where an import runs it."""
    line: int
    text: str
    """Place, and the lines before and after."""
    tests: Sequence[Timed]


class _Planted(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Gives one module of the package from a changed text."""

    def __init__(self, path: Path, source: str) -> None:
        self._module, self._path, self._source = _name_of(path), path, source

    def find_spec(self, fullname: str, *_: object) -> importlib.machinery.ModuleSpec | None:
        if fullname != self._module:
            return None
        return importlib.machinery.ModuleSpec(fullname, self, origin=str(self._path))

    def exec_module(self, module: ModuleType) -> None:
        module.__file__ = str(self._path)
        exec(compile(self._source, str(self._path), "exec"), module.__dict__)


def _name_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT / "src").with_suffix("").parts)


def _codes(code: CodeType) -> Iterator[CodeType]:
    """A code object and all those inside it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)


Key = tuple[str, str, int]


def _key(code: CodeType) -> Key:
    return (code.co_filename, code.co_qualname, code.co_firstlineno)


def _functions() -> dict[Key, list[FunctionType]]:
    """All functions of the package that exist now."""
    found: dict[Key, list[FunctionType]] = {}
    # The tests freeze what they have imported, and what is frozen is not among these.
    gc.unfreeze()
    for thing in gc.get_objects():
        if type(thing) is FunctionType and thing.__code__.co_filename.startswith(str(PACKAGE)):
            found.setdefault(_key(thing.__code__), []).append(thing)
    return found


class _Outcome:
    """Writes down which test failed first, and ends the process with a test that takes too long."""

    def __init__(self, failed: Path, chosen: Sequence[Timed]) -> None:
        self.failed = False
        self._file = failed
        self._seconds = {test.name: test.seconds for test in chosen}

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        signal.setitimer(signal.ITIMER_PROF, GRACE + TIMES * self._seconds[nodeid])

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and not self.failed:
            self.failed = True
            self._file.write_text(report.nodeid)


class _Select(_Outcome):
    """Keeps chosen tests only, those that were fast first."""

    def __init__(self, failed: Path, chosen: Sequence[Timed]) -> None:
        super().__init__(failed, chosen)
        self._places = {test.name: place for place, test in enumerate(chosen)}

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        kept = [item for item in items if item.nodeid in self._places]
        kept.sort(key=lambda item: self._places[item.nodeid])
        items[:] = kept


class _Serve(Session):
    """Waits for faults, and tries each with its tests in a fork."""

    def __init__(self, wishes: Connection, failed: Path) -> None:
        self._wishes = wishes
        self._failed = failed
        self._trials = 0

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        items = {item.nodeid: item for item in session.items}
        functions = _functions()
        gc.freeze()
        self._wishes.send(None)
        while (wish := self._wishes.recv()) is not None:
            self._trials += 1
            files = self._failed.with_name(f"s{self._trials}")
            # What an earlier child left running may still write where its tests had their files.
            vars(session.config)["_tmp_path_factory"]._given_basetemp = files
            chosen = [items[test.name] for test in wish.tests]
            seconds = TIMES * sum(GRACE + test.seconds for test in wish.tests)
            outcome = _Outcome(self._failed, wish.tests)
            work = _plant_and_run(functions, wish, chosen, outcome)
            self._wishes.send(in_fork(work, seconds))
            shutil.rmtree(files, ignore_errors=True)
        return True


def _plant_and_run(
    functions: dict[Key, list[FunctionType]],
    fault: Fault,
    items: Sequence[pytest.Item],
    outcome: _Outcome,
) -> Callable[[], int]:
    def work() -> int:
        if _name_of(fault.path) in sys.modules:
            if not _exchange(functions, fault):
                return NOT_SO
        else:
            sys.meta_path.insert(0, _Planted(fault.path, fault.changed))
        for item in run_items(items, outcome):
            if outcome.failed:
                item.session._setupstate.teardown_exact(None)
                break
        return int(outcome.failed) or _left_open()

    return work


def _left_open() -> int:
    """Look for what must be closed and was not, as pytest does at the end of a session."""
    found: list[object] = []
    sys.unraisablehook = found.append
    warnings.simplefilter("error", ResourceWarning)
    gc.collect()
    return LEFT_OPEN if found else 0


def _exchange(functions: dict[Key, list[FunctionType]], fault: Fault) -> bool:
    """Give the function of a fault its changed code, where its closure allows."""
    outermost = fault.scope.split(".<locals>.")[0]
    changed = compile(fault.changed, str(fault.path), "exec")
    fitting = [
        code
        for code in _codes(changed)
        if code.co_qualname == outermost and code.co_firstlineno <= fault.line
    ]
    code = max(fitting, key=lambda code: code.co_firstlineno)
    exchanged = functions.get(_key(code), [])
    if any(function.__code__.co_freevars != code.co_freevars for function in exchanged):
        return False
    for function in exchanged:
        function.__code__ = code
    return bool(exchanged)


class Trials:
    """Plants faults: forks of this process and of one whose tests are collected already."""

    def __init__(self, files: Sequence[Path]) -> None:
        """Collect files of tests, and trace those that have not been."""
        self._folder = Path(tempfile.mkdtemp(prefix="mutants-"))
        self._failed = self._folder / "failed"
        self._wishes, theirs = Pipe()
        names = [str(file.relative_to(ROOT)) for file in files]
        serve = _Serve(theirs, self._failed)

        def work() -> int:
            # So that the session ends with this process, however that ends.
            self._wishes.close()
            return run_pytest(self._folder, names, serve)

        self._pid = in_background(work)
        theirs.close()
        self._wishes.recv()
        self.tests = traced(files, self._folder)

    def close(self) -> None:
        """End the session."""
        self._wishes.send(None)
        os.waitpid(self._pid, 0)
        shutil.rmtree(self._folder, ignore_errors=True)

    def noticed(self, fault: Fault) -> str | None:
        """The test that fails under a fault, or what else shows it; none if nothing does."""
        if not fault.tests:
            return None
        self._failed.unlink(missing_ok=True)
        status = NOT_SO
        if fault.scope:
            self._wishes.send(fault)
            status = self._wishes.recv()
        if status == NOT_SO:
            seconds = COLLECTING + TIMES * sum(GRACE + test.seconds for test in fault.tests)
            status = in_fork(lambda: self._import_and_run(fault), seconds)
        if status in UNNOTICED:
            return None
        # What a test leaves may fail, too, when it is taken down.
        if self._failed.exists():
            return self._failed.read_text()
        if status in UNUSABLE:
            sys.exit(f"{fault.path}: pytest ended with {status} under {fault.text}")
        return {None: TIME, LEFT_OPEN: OPEN}.get(status, IMPORT)

    def _import_and_run(self, fault: Fault) -> int:
        sys.meta_path.insert(0, _Planted(fault.path, fault.changed))
        files = dict.fromkeys(test.name.split("::")[0] for test in fault.tests)
        try:
            status = run_pytest(self._folder, files, _Select(self._failed, fault.tests), "-x")
        except (pytest.PytestUnraisableExceptionWarning, ExceptionGroup):
            return LEFT_OPEN
        # A module that cannot be imported is noticed, and pytest calls that a wrong usage.
        return pytest.ExitCode.TESTS_FAILED if status == pytest.ExitCode.USAGE_ERROR else status


def prepare() -> None:
    """Import what every child needs and no fault is planted in."""
    sys.path.insert(0, str(ROOT / "src"))
    for name in HEAVY:
        importlib.import_module(name)
