"""Calling the commands as a user would: what came out, what was complained of, what status."""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from legbench.cli import main

MODELS = Path(__file__).parents[2] / "models"
DESIGN = ("--design", str(MODELS / "prototype.toml"))


@dataclass(frozen=True, kw_only=True)
class Done:
    status: int
    out: str
    err: str

    def refused(self, *words: str) -> None:
        """One clear message, no traceback, nothing on stdout, a status that says so.

        The table of bad inputs tells which: 2 where it was refused as it was asked, else 1.
        """
        assert self.status in (1, 2), self.err
        assert self.out == ""
        assert self.err.startswith("legbench: "), self.err
        assert self.err.count("\n") == 1, self.err
        for word in words:
            assert word in self.err


def called(capfd: pytest.CaptureFixture[str], *arguments: str | Path) -> Done:
    """In this process."""
    capfd.readouterr()
    try:
        status = main([str(argument) for argument in arguments])
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
    seen = capfd.readouterr()
    return Done(status=status, out=seen.out, err=seen.err)


CALL = "import sys\n{before}\nfrom legbench.cli import main\nsys.exit(main(sys.argv[1:]))"


def started(
    *arguments: str | Path, before: str = "pass", without: Sequence[str] = (), cwd: Path
) -> Done:
    """In a process of its own, some environment variables removed, some code run before."""
    environment = {name: value for name, value in os.environ.items() if name not in without}
    done = subprocess.run(
        [sys.executable, "-c", CALL.format(before=before), *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env=environment,
        cwd=cwd,
    )
    return Done(status=done.returncode, out=done.stdout, err=done.stderr)


TOGETHER = """
import contextlib, io, json, sys
{before}
from legbench.cli import main
found = []
for words in json.loads(sys.argv[1]):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = main(words)
        except SystemExit as end:
            status = end.code or 0
    found.append(dict(status=status, out=out.getvalue(), err=err.getvalue(), loaded=[*sys.modules]))
print(json.dumps(found))
"""


@dataclass(frozen=True, kw_only=True)
class DoneTogether(Done):
    loaded: list[str]
    """All modules that the process had loaded by then."""


def started_together(
    lines: Sequence[Sequence[str | Path]], *, before: str = "pass", cwd: Path
) -> list[DoneTogether]:
    """Command lines one after another in one process of their own, some code run before."""
    words = json.dumps([[str(word) for word in line] for line in lines])
    done = subprocess.run(
        [sys.executable, "-c", TOGETHER.format(before=before), words],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [DoneTogether(**found) for found in json.loads(done.stdout)]
