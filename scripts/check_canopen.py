"""Run the tests of canopen over our bus between processes, and say which fail that pass elsewhere.

    pip download --no-deps --no-binary :all: canopen     # unpack it
    python scripts/check_canopen.py canopen-2.4.1/test

They use python-can's `virtual` interface; here they are run over that and over emulated wires. On
a wire a frame takes time, as on a bus: a test that looks at once for what it has sent may fail.
Each test that fails over a wire alone is run a few times more. Exit status 1 if one never passes
that is not known to race with itself.
"""

import argparse
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

SCRIPTS = Path(__file__).parent
RESULT = re.compile(r"^(PASSED|FAILED|ERROR) (\S+::\S+)", re.MULTILINE)
TRIES = 5
"""Number of further tries of a test that fails."""
PATIENCE_S = 600.0
BESIDE = "two threads of the test read one bus, and either may get the frame"
RACES = {"test_time_producer": BESIDE, "test_scanner_search_limit": BESIDE}
"""Test -> why it may fail on any bus on which a frame takes time."""


def tried(tests: Sequence[str], folder: Path, *plugins: str) -> dict[str, bool]:
    """Run tests of a folder; test -> whether it has passed."""
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-rA", "-p", "no:cacheprovider", "-p", "no:xdist"]
        + [part for plugin in plugins for part in ("-p", plugin)]
        + ["-c", os.devnull, "--rootdir", str(folder), *tests],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": f"{SCRIPTS}:{os.environ.get('PYTHONPATH', '')}"},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    found = {name: word == "PASSED" for word, name in RESULT.findall(done.stdout)}
    if not found:
        raise SystemExit(f"no test was run: {done.stdout[-2000:]}{done.stderr[-2000:]}")
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare and print; 1 if a test fails over a wire alone, however often it is tried."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("tests", type=Path, help="folder `test` of canopen's source")
    folder = parser.parse_args(arguments).tests.resolve()
    usual = tried([str(folder)], folder.parent)
    ours = tried([str(folder)], folder.parent, "canopen_wire")
    for name, results in (("virtual", usual), ("legbench_unix", ours)):
        print(f"{name:<16}{sum(results.values())} of {len(results)} tests pass")
    never = 0
    for name in sorted(name for name, passed in ours.items() if not passed and usual.get(name)):
        passes = sum(
            tried([name], folder.parent, "canopen_wire").get(name, False) for _ in range(TRIES)
        )
        race = RACES.get(name.rpartition("::")[2])
        told = "" if race is None else f": {race}"
        print(f"  {name}: passes {passes} of {TRIES} further times{told}")
        never += passes == 0 and race is None
    return 1 if never else 0


if __name__ == "__main__":
    sys.exit(main())
