"""Plant small faults one at a time and tell which of them the tests notice.

Kept tools were tried first. mutmut 3.8 changes only the bodies of plain functions: no property, no
table, constant or default of a class, which is where a standard's numbers stand; it has no seeded
sample. cosmic-ray 8.7 rewrites the file in the source tree and starts Python anew for each fault,
which with MuJoCo and SciPy costs more than most tests. Here the tests of a room are collected once;
a fork of that session changes one function and runs, fastest first, those tests that ran the
changed line in a run without faults.

A fault is noticed when a test fails, a module cannot be imported, or the time is up. Faults that
change nothing a caller can see are listed with their reason in `equivalent.toml`. Each result goes
to a text file at once; what stands there is not tried again while its file and its tests are the
same, so that a run of hours may be interrupted.
"""

import argparse
import ast
import itertools
import os
import random
import re
import sys
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")
from choosing import BUDGET, at_import, file_of, imports, in_function, runs_at_import, span
from edits import Mutation, mutations
from tracing import CACHE, PACKAGE, ROOT, Passed, digest
from trial import OPEN, Fault, Trials, prepare

EQUIVALENT = Path(__file__).with_name("equivalent.toml")
DRIVES = (
    *("tests/drives/test_[!c]*.py", "tests/drives/test_c[!a]*.py"),
    "tests/drives/test_can_unix_bus.py",
)
"""Tests of drives without most of `test_can_*`, which try the whole plant."""
TESTS = {
    "drives": DRIVES,
    "limits": DRIVES,
    "commissioning": (*DRIVES, "tests/drives/test_can_*.py"),
    "plant": ("tests/plant/test_*.py", "tests/drives/test_can_*.py"),
    "metrics": ("tests/metrics/test_*.py",),
    "recording": ("tests/recording/test_*.py",),
}
"""Room of the package -> where its tests are."""
OTHER_PROCESS = ("test_can_processes.py", "test_can_hardware.py", "test_channel_lock.py")
"""Tests of other processes, into which no fault is planted."""
STRICT = (
    *("limits/guard.py", "limits/safety.py", "limits/plausibility.py", "limits/knee.py"),
    *("limits/encoder_watch.py", "limits/shortfall.py", "limits/upper_ends.py"),
    *("limits/momentum.py", "limits/momentum_watch.py", "limits/support_watch.py"),
    *("limits/ground_contact.py", "limits/spring_mismatch.py"),
    *("drives/protocol/cia402.py", "drives/master/stop.py", "drives/master/stop_report.py"),
    *("drives/master/sdo_stop.py", "drives/master/cycle.py", "drives/master/start_up.py"),
    *("drives/master/supervisor.py", "drives/master/outgoing.py"),
)
"""Files of the package that a stop depends on: 97 % must be noticed there, 93 % elsewhere."""
STRICT_BOUND, BOUND = 0.97, 0.93
ROOMS = ("limits", "drives", "commissioning", "recording", "metrics")


def _equivalent(module: str) -> dict[tuple[str, str, str], str]:
    """Faults of a file that change nothing: scope, line before, line after -> why."""
    rows = tomllib.loads(EQUIVALENT.read_text())["equivalent"]
    mine = [row for row in rows if row["file"] == module]
    return {(row["scope"], row["before"], row["after"]): row["reason"] for row in mine}


def _sample(path: Path, seed: int, count: int) -> list[Mutation]:
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
    return [edit for edit, key in drawn if key not in known][:count]


def _faults(
    path: Path, edits: Sequence[Mutation], tests: Sequence[Passed], budget: float
) -> list[Fault]:
    source, module = path.read_text(), path.relative_to(PACKAGE).as_posix()
    tree = ast.parse(source)
    faults: list[Fault] = []
    for edit in edits:
        line = edit.line_number(source)
        before, after = edit.lines(source)
        importing = edit.at_import or runs_at_import(tree, tests, module, line)
        if importing:
            # The constant, field, member or function that a line begins with.
            name = next(word for word in re.findall(r"\w+", before) if word not in ("def", "self"))
            chosen = at_import(tests, budget, module, name, edit.scope)
        else:
            chosen = in_function(tests, budget, module, *span(tree, line))
        place = f"{path.relative_to(ROOT)}:{line} {edit.scope}"
        fault = Fault(
            path=path,
            changed=edit.apply(source),
            scope="" if importing else edit.scope,
            line=line,
            text=f"{place}\n  - {before}\n  + {after}",
            tests=chosen,
        )
        faults.append(fault)
    return faults


class _Results:
    """A text file of results: state of the source, state of the tests, fault, what noticed it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        rows = [line.split("\t") for line in path.read_text().splitlines()] if path.exists() else []
        self._known = {(row[0], row[2]): (row[1], row[3]) for row in rows}

    def get(self, fault: Fault) -> str | None:
        """What noticed a fault, empty if nothing did; none if that is to be tried."""
        tests, seen = self._known.get(_key(fault), ("", ""))
        # What was not noticed may be by a test that is new or has changed.
        return seen if seen or tests == _state(fault) else None

    def put(self, fault: Fault, seen: str) -> None:
        """Write a result down."""
        source, text = _key(fault)
        self._known[source, text] = (_state(fault), seen)
        with self._path.open("a") as file:
            file.write(f"{source}\t{_state(fault)}\t{text}\t{seen}\n")


def _key(fault: Fault) -> tuple[str, str]:
    return digest([fault.path])[:12], " ".join(fault.text.split())


def _state(fault: Fault) -> str:
    """A text that changes with the choice of tests, and with what they say."""
    files = {ROOT / file_of(test) for test in fault.tests}
    names = "\n".join(sorted(test.name for test in fault.tests))
    return digest(files, names)[:12] if files else "-"


def _try_file(
    path: Path, edits: Sequence[Mutation], trials: Trials, results: _Results, budget: float
) -> bool:
    """Print the score of a file and what was not noticed; whether its bound is kept."""
    name, module = path.relative_to(ROOT), path.relative_to(PACKAGE).as_posix()
    faults = _faults(path, edits, trials.tests, budget)
    seen: list[str] = []
    fresh: list[tuple[Fault, str]] = []
    for fault in faults:
        known = results.get(fault)
        if known is None:
            known = trials.noticed(fault) or ""
            results.put(fault, known)
            fresh.append((fault, known))
        seen.append(known)
    _check(path, fresh, trials)
    found = sum(map(bool, seen))
    score = found / len(faults)
    bound = STRICT_BOUND if module in STRICT else BOUND
    verdict = "" if score >= bound else f"  below {bound:.0%}"
    equal = len(_equivalent(module))
    print(f"{name}: {found} of {len(faults)}, {equal} equivalent, {score:.1%}{verdict}")
    for fault, by in zip(faults, seen, strict=True):
        if not by:
            print(fault.text)
    sys.stdout.flush()
    return score >= bound


def _check(path: Path, fresh: Sequence[tuple[Fault, str]], trials: Trials) -> None:
    """Run the tests that noticed faults without any, for which they must pass."""
    for importing in (False, True):
        some = [(fault, by) for fault, by in fresh if (not fault.scope) is importing]
        names = {by for _, by in some}
        known = {test.name: test for fault, _ in some for test in fault.tests}
        tests = [known[name] for name in known if name in names]
        if tests:
            sound = replace(some[0][0], changed=path.read_text(), tests=tests)
            if by := trials.noticed(sound):
                print(f"{path.name}: {by} fails without a fault, too; what it noticed is void")
    # What was left open is told of no single test.
    for fault in [fault for fault, by in fresh if by == OPEN]:
        if trials.noticed(replace(fault, changed=path.read_text())):
            print(f"{path.name}: {OPEN} without a fault, too; void is {fault.text}")


def _tests_of(path: Path) -> tuple[Path, ...]:
    room = path.relative_to(PACKAGE).parts[0]
    if room not in TESTS:
        sys.exit(f"{path}: no tests are named for {room}; there are {', '.join(TESTS)}")
    files = [file for pattern in TESTS[room] for file in sorted(ROOT.glob(pattern))]
    return tuple(dict.fromkeys(file for file in files if file.name not in OTHER_PROCESS))


def _near(suite: Sequence[Path], paths: Sequence[Path]) -> list[Path]:
    modules = [path.relative_to(PACKAGE).as_posix() for path in paths]
    return [file for file in suite if any(imports(file, module) for module in modules)]


def _files(names: Sequence[str]) -> list[Path]:
    found: list[Path] = []
    for name in names:
        path = (ROOT / name).resolve()
        found += sorted(path.rglob("*.py")) if path.is_dir() else [path]
    return found


def main() -> int:
    """Plant faults in the files that the command line names; 1 if too few are noticed."""
    parser = argparse.ArgumentParser(description="Plant faults, count which are noticed.")
    parser.add_argument("files", nargs="*", default=[f"src/legbench/{room}" for room in ROOMS])
    parser.add_argument("--per-file", type=int, default=40, metavar="N", help="faults a file")
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--tests", nargs="+", type=Path, help="these files only, not the room")
    parser.add_argument("--near", action="store_true", help="only tests that import a file")
    parser.add_argument("--budget", type=float, default=BUDGET, metavar="S", help="of a fault")
    parser.add_argument("--results", type=Path, default=CACHE / "results.txt", help="text file")
    chosen = parser.parse_args()
    named = tuple((ROOT / file).resolve() for file in chosen.tests or ())
    samples = {path: _sample(path, chosen.seed, chosen.per_file) for path in _files(chosen.files)}
    results = _Results(chosen.results)
    prepare()
    kept = True
    for suite, group in itertools.groupby(
        [path for path in samples if samples[path]], lambda path: named or _tests_of(path)
    ):
        paths = list(group)
        trials = Trials(_near(suite, paths) if chosen.near else suite)
        try:
            for path in paths:
                kept = _try_file(path, samples[path], trials, results, chosen.budget) and kept
        finally:
            trials.close()
    return int(not kept)


if __name__ == "__main__":
    sys.exit(main())
