"""Plant small faults one at a time and tell which of them the tests notice.

Kept tools were tried first. mutmut 3.8 changes only the bodies of plain functions: no property, no
table, constant or default of a class, which is where a standard's numbers stand; it has no seeded
sample. cosmic-ray 8.7 rewrites the file in the source tree and starts Python anew for each fault,
which with MuJoCo and SciPy costs more than most tests. Here the libraries are imported once; a
forked child gets the changed module from memory and runs, fastest first, those tests that entered
the changed function in a run without faults (all of the room's, where import runs it).

A fault is noticed when a test fails, a module cannot be imported, or the time is up. Faults that
change nothing a caller can see are listed with their reason in `equivalent.toml`.
"""

import argparse
import itertools
import os
import random
import sys
import tomllib
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", PYTHONHASHSEED="0")
from edits import Mutation, mutations
from trial import PACKAGE, ROOT, Fault, Passed, noticed, prepare, trace

EQUIVALENT = Path(__file__).with_name("equivalent.toml")
TESTS = {
    "drives": ("tests/drives/test_[!c]*.py", "tests/drives/test_c[!a]*.py"),
    "limits": ("tests/drives/test_[!c]*.py", "tests/drives/test_c[!a]*.py"),
    "commissioning": ("tests/drives/test_*.py",),
    "plant": ("tests/plant/test_*.py", "tests/drives/test_can_*.py"),
    "metrics": ("tests/metrics/test_*.py",),
    "recording": ("tests/recording/test_*.py",),
}
"""Room of the package -> where its tests are; `test_can_*` try the whole plant."""
OTHER_PROCESS = ("test_can_processes.py", "test_can_hardware.py", "test_channel_lock.py")
"""Tests of other processes, into which no fault is planted."""
STRICT = (
    *("limits/guard.py", "limits/safety.py", "drives/protocol/cia402.py"),
    *("drives/master/stop.py", "drives/master/stop_report.py", "drives/master/sdo_stop.py"),
    *("drives/master/cycle.py", "drives/master/start_up.py", "drives/master/supervisor.py"),
    "drives/master/outgoing.py",
)
"""Files of the package that a stop depends on: 97 % must be noticed there, 93 % elsewhere."""
STRICT_BOUND, BOUND = 0.97, 0.93
ROOMS = ("drives", "limits", "metrics", "recording", "commissioning")
BUDGET = 10.0
"""Tests that may notice a fault are tried for so long, timed under the trace [s]; 80 % fit in."""


def _chosen(tests: Sequence[Passed], module: str, mutation: Mutation) -> list[Passed]:
    """Those of the tests that a fault may reach, fastest first, as many as the budget allows."""
    reached = [t for t in tests if mutation.at_import or (module, mutation.scope) in t.entered]
    reached.sort(key=lambda test: test.seconds)
    spent = itertools.accumulate(test.seconds for test in reached)
    return [test for test, so_far in zip(reached, spent, strict=True) if so_far <= BUDGET]


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
    # Shuffled before they are left out, so that a new entry of the list moves no other fault.
    drawn = list(zip(every, keys, strict=True))
    random.Random(f"{seed} {module}").shuffle(drawn)
    kept = [edit for edit, key in drawn if key not in known]
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
    files = [file for pattern in TESTS[room] for file in sorted(ROOT.glob(pattern))]
    return [file for file in files if file.name not in OTHER_PROCESS]


def _files(names: Sequence[str]) -> list[Path]:
    found: list[Path] = []
    for name in names:
        path = (ROOT / name).resolve()
        found += sorted(path.rglob("*.py")) if path.is_dir() else [path]
    return [path for path in found if mutations(path.read_text())]


def main() -> int:
    """Plant faults in the files that the command line names; 1 if too few are noticed."""
    parser = argparse.ArgumentParser(description="Plant faults, count which are noticed.")
    parser.add_argument("files", nargs="*", default=[f"src/legbench/{room}" for room in ROOMS])
    parser.add_argument("--per-file", type=int, default=40, metavar="N", help="faults a file")
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--tests", nargs="+", type=Path, help="these files only, not the room")
    parser.add_argument("--jobs", type=int, default=1, help="processes at a time")
    chosen = parser.parse_args()
    prepare()
    files = _files(chosen.files)
    named = [(ROOT / file).resolve() for file in chosen.tests or ()]
    suites = {path: named or _tests_of(path) for path in files}
    needed = sorted({file for suite in suites.values() for file in suite})
    short = False
    with ProcessPoolExecutor(chosen.jobs, get_context("fork")) as pool:
        traced = dict(zip(needed, pool.map(trace, needed), strict=True))
        for path in files:
            tests = [test for file in suites[path] for test in traced[file]]
            faults = _faults(path, tests, chosen.seed, chosen.per_file)
            if not faults:
                print(f"{path.relative_to(ROOT)}: every fault is listed as equivalent")
                continue
            sound = replace(faults[0], changed=path.read_text())
            if pool.submit(noticed, sound).result():
                sys.exit(f"{path}: a test fails without any fault; run them with pytest first")
            seen = list(pool.map(noticed, faults))
            strict = path.relative_to(PACKAGE).as_posix() in STRICT
            bound = STRICT_BOUND if strict else BOUND
            score = sum(seen) / len(faults)
            short = short or score < bound
            verdict = "" if score >= bound else f"  below {bound:.0%}"
            print(f"{path.relative_to(ROOT)}: {sum(seen)} of {len(faults)}{verdict}")
            for fault, found in zip(faults, seen, strict=True):
                if not found:
                    print(fault.text)
            sys.stdout.flush()
    return int(short)


if __name__ == "__main__":
    sys.exit(main())
