"""Plant small faults one at a time and tell which of them the tests notice.

Kept tools were tried first. mutmut 3.8 changes only the bodies of plain functions: no property, no
table, constant or default of a class, which is where a standard's numbers stand; it has no seeded
sample. cosmic-ray 8.7 rewrites the file in the source tree and starts Python anew for each fault,
which with MuJoCo and SciPy costs more than most tests. Here the libraries are imported once; a
forked child gets the changed module from memory and runs, fastest first, those tests that entered
the changed function in a run without faults (all of the room's, where import runs it).

A fault is noticed when a test fails, a module cannot be imported, or the time is up. Faults that
change nothing a caller can see are listed with their reason in `mutants_equivalent.toml`.
"""

import argparse
import hashlib
import importlib
import importlib.abc
import importlib.machinery
import itertools
import json
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import threading
import time
import tomllib
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from types import CodeType, FrameType, ModuleType
from typing import Any

os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", PYTHONHASHSEED="0")
import pytest
from mutations import Mutation, mutations

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "legbench"
EQUIVALENT = Path(__file__).with_name("mutants_equivalent.toml")
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "legbench-mutants"
HEAVY = (
    *("can", "canopen", "durand", "serial", "numpy", "scipy.integrate", "pyarrow.parquet"),
    *("mujoco", "tyro", "hypothesis", "_hypothesis_pytestplugin", "unittest.mock", "pdb"),
)
TESTS = {
    "drives": ("tests/drives", "tests/plant/test_plant_contract.py"),
    "commissioning": ("tests/drives",),
    "plant": ("tests/plant", "tests/drives"),
    "metrics": ("tests/metrics",),
    "recording": ("tests/recording",),
}
"""Room of the package -> where its tests are."""
OTHER_PROCESS = ("test_can_processes.py", "test_can_hardware.py")
"""Tests of other processes, into which no fault is planted."""
STRICT = ("limits.py", "stop.py", "cycle.py", "start_up.py", "cia402.py", "supervisor.py")
"""What a stop depends on; 97 % of the faults must be noticed there, 93 % elsewhere."""
STRICT_BOUND, BOUND = 0.97, 0.93
CHILD_FAILED = 70
"""Status of a child in which pytest could not be run."""
ROOMS = ("drives", "metrics", "recording", "commissioning")
BUDGET = 10.0
"""Tests that may notice a fault are tried for so long, as timed under the trace [s]; 80 % fit in."""
TIMES, GRACE = 3.0, 20.0
"""A child may take this many times the time of its tests without faults, and this long more [s]."""


@dataclass(frozen=True, kw_only=True)
class Passed:
    """A test that passes without faults."""

    name: str
    seconds: float
    entered: frozenset[tuple[str, str]]
    """Functions of the package that it entered: module and qualified name."""


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
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1,) * 2)
        silent = os.open(os.devnull, os.O_RDWR)
        for number in (0, 1, 2) if not os.environ.get("DBG") else ():
            os.dup2(silent, number)
        status = CHILD_FAILED
        try:
            status = int(work(folder))
        except BaseException:
            import traceback

            traceback.print_exc()
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


def _trace(file: Path) -> list[Passed]:
    """The passing tests of a file and what they enter; remembered until a test changes."""
    helpers = [path for path in file.parent.glob("*.py") if not path.name.startswith("test_")]
    kept = CACHE / f"{file.stem}-{_digest([file, *helpers])}.json"
    if not kept.exists():

        def work(folder: Path) -> int:
            trace = _Trace()
            status = _pytest(folder, [str(file.relative_to(ROOT))], trace)
            part = folder / "part"
            part.write_text(json.dumps(trace.passed))
            shutil.move(part, kept)
            return status

        CACHE.mkdir(parents=True, exist_ok=True)
        if _child(work, 600.0) != 0:
            sys.exit(f"{file}: its tests cannot be traced; run them with pytest first")
    return [
        Passed(
            name=test["name"],
            seconds=test["seconds"],
            entered=frozenset((module, name) for module, name in test["entered"]),
        )
        for test in json.loads(kept.read_text())
    ]


def _chosen(tests: Sequence[Passed], module: str, mutation: Mutation) -> list[Passed]:
    """Those of the tests that a fault may reach, fastest first, as many as the budget allows."""
    reached = [t for t in tests if mutation.at_import or (module, mutation.scope) in t.entered]
    reached.sort(key=lambda test: test.seconds)
    spent = itertools.accumulate(test.seconds for test in reached)
    return [test for test, so_far in zip(reached, spent, strict=True) if so_far <= BUDGET]


def _noticed(fault: "Fault") -> bool:
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


QUICK = 3
"""Files of tests that are tried before all others."""
UNNOTICED = (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED)
UNUSABLE = (pytest.ExitCode.INTERNAL_ERROR, pytest.ExitCode.USAGE_ERROR, CHILD_FAILED)


@dataclass(frozen=True, kw_only=True)
class Fault:
    """One mutation of one file with the tests that might notice."""

    path: Path
    changed: str
    text: str
    """Place, and the lines before and after."""
    tests: Sequence[Passed]


def _equivalent(module: str) -> dict[tuple[str, str, str], str]:
    """Faults of a file that change nothing: scope, line before, line after -> why."""
    rows = tomllib.loads(EQUIVALENT.read_text())["equivalent"]
    mine = [row for row in rows if row["file"] == module]
    return {(row["scope"], row["before"], row["after"]): row["reason"] for row in mine}


def _faults(path: Path, tests: Sequence[Passed], seed: int, count: int) -> list[Fault]:
    """A seeded sample of a file's faults, without those that change nothing."""
    source, module = path.read_text(), path.relative_to(PACKAGE).as_posix()
    every = mutations(source)
    known = _equivalent(module)
    keys = [(edit.scope, *edit.lines(source)) for edit in every]
    for key in known.keys() - set(keys):
        sys.exit(f"{EQUIVALENT.name}: no fault of {module} is {key}; mend or remove the entry")
    kept = [edit for edit, key in zip(every, keys, strict=True) if key not in known]
    # Shuffled by their own seed, so that a new entry of the list moves no other fault.
    random.Random(f"{seed} {module}").shuffle(kept)
    return [_fault(path, source, edit, _chosen(tests, module, edit)) for edit in kept[:count]]


def _fault(path: Path, source: str, edit: Mutation, tests: Sequence[Passed]) -> Fault:
    before, after = edit.lines(source)
    place = f"{path.relative_to(ROOT)}:{edit.line_number(source)} {edit.scope}"
    text = f"{place}\n  - {before}\n  + {after}"
    return Fault(path=path, changed=edit.apply(source), text=text, tests=tests)


def _tests_of(path: Path) -> list[Path]:
    room = path.relative_to(PACKAGE).parts[0]
    if room not in TESTS:
        sys.exit(f"{path}: no tests are named for {room}; there are {', '.join(TESTS)}")
    found = [ROOT / place for place in TESTS[room]]
    files = [file for place in found for file in sorted(place.glob("test_*.py")) or [place]]
    return [file for file in files if file.name not in OTHER_PROCESS]


def _files(names: Sequence[str]) -> list[Path]:
    found: list[Path] = []
    for name in names:
        path = (ROOT / name).resolve()
        found += sorted(path.rglob("*.py")) if path.is_dir() else [path]
    return [path for path in found if mutations(path.read_text())]


def main() -> int:
    """Plant faults in the files that the command line names; 1 if too few are noticed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", default=[f"src/legbench/{room}" for room in ROOMS])
    parser.add_argument("--per-file", type=int, default=40, metavar="N", help="faults a file")
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--jobs", type=int, default=1, help="processes at a time")
    chosen = parser.parse_args()
    sys.path.insert(0, str(ROOT / "src"))
    for name in HEAVY:
        importlib.import_module(name)
    files = _files(chosen.files)
    suites = {path: _tests_of(path) for path in files}
    needed = sorted({file for suite in suites.values() for file in suite})
    short = False
    with ProcessPoolExecutor(chosen.jobs, get_context("fork")) as pool:
        traced = dict(zip(needed, pool.map(_trace, needed), strict=True))
        for path in files:
            tests = [test for file in suites[path] for test in traced[file]]
            faults = _faults(path, tests, chosen.seed, chosen.per_file)
            noticed = list(pool.map(_noticed, faults))
            bound = STRICT_BOUND if path.name in STRICT else BOUND
            score = sum(noticed) / len(faults)
            short = short or score < bound
            verdict = "" if score >= bound else f"  below {bound:.0%}"
            print(f"{path.relative_to(ROOT)}: {sum(noticed)} of {len(faults)}{verdict}")
            for fault, seen in zip(faults, noticed, strict=True):
                if not seen:
                    print(fault.text)
            sys.stdout.flush()
    return int(short)


if __name__ == "__main__":
    sys.exit(main())
