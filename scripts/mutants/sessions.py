"""Sessions of pytest that run what they have collected in forks, and what their tests run."""

import importlib
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import pytest
from forks import in_background, in_fork
from probes import Probes
from tracing import PACKAGE, ROOT, LineTrace, Passed, load, save

TRACING = 600.0
"""The time that the tests of one file may take without faults [s]."""


class Session:
    """A plugin that does not run the tests that were collected in their order."""

    def pytest_sessionstart(self) -> None:
        """A failing example is enough, it need not be the smallest."""
        hypothesis = importlib.import_module("hypothesis")
        kept = (hypothesis.Phase.explicit, hypothesis.Phase.generate)
        hypothesis.settings.register_profile("mutants", phases=kept, database=None)
        hypothesis.settings.load_profile("mutants")


class _Trace(Session):
    """Runs each file of tests in a fork, and saves what its tests run."""

    def __init__(self, probes: Probes) -> None:
        self._probes = probes

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        for file in dict.fromkeys(item.path for item in session.items):
            chosen = [item for item in session.items if item.path == file]
            in_fork(self._work(file, chosen), TRACING)
        return True

    def _work(self, file: Path, items: Sequence[pytest.Item]) -> Callable[[], int]:
        def work() -> int:
            trace = LineTrace(self._probes)
            for _ in run_items(items, trace):
                pass
            save(file, trace.passed)
            return 0

        return work


def run_items(items: Sequence[pytest.Item], plugin: object) -> Iterator[pytest.Item]:
    """Run tests one after the other under a plugin of one's own; yield each once it has run."""
    for place, item in enumerate(items):
        if place == 0:
            item.config.pluginmanager.register(plugin)
        following = items[place + 1] if place + 1 < len(items) else None
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
        yield item


def run_pytest(folder: Path, files: Iterable[str], plugin: object, *more: str) -> int:
    """Collect files of tests under a plugin; its temporary files go below a folder."""
    os.chdir(ROOT)
    # A failure is not explained, only noticed: that takes ten times as long as to find it.
    usual = ["-q", "--assert=plain", "--tb=native", "-p", "no:cacheprovider", *more]
    return pytest.main(
        [*usual, f"--basetemp={folder / f't{os.getpid()}'}", *files], plugins=[plugin]
    )


def traced(files: Sequence[Path], folder: Path) -> list[Passed]:
    """What the tests of some files run, those that are not remembered traced anew.

    That is done in a process whose package has probes, and ends the program where it fails.
    """
    new = [file for file in files if load(file) is None]
    if new:
        probes = Probes(PACKAGE)

        def work() -> int:
            sys.meta_path.insert(0, probes)
            names = [str(file.relative_to(ROOT)) for file in new]
            return run_pytest(folder, names, _Trace(probes))

        os.waitpid(in_background(work), 0)
    found: list[Passed] = []
    for file in files:
        tests = load(file)
        if tests is None:
            sys.exit(f"{file}: its tests cannot be traced; run them with pytest")
        found += tests
    return found
