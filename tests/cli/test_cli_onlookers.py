"""A run goes on whatever becomes of the terminal it was started from."""

import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from commands import CALL, DESIGN, called

from legbench.control import Jump
from legbench.plant.sim import SimPlant
from legbench.recording.description import RunDescription
from legbench.recording.reader import load
from legbench.signals import Command, Observation

TERMINAL = """
import sys
class Gone:
    def isatty(self): return True
    def fileno(self): return 2
    def write(self, text): raise {error}
    def flush(self): pass
sys.stderr = Gone()
"""
"""A stderr that calls itself a terminal and takes nothing."""


def ran(
    tmp_path: Path, *arguments: str, before: str = "pass", redirect: str
) -> "subprocess.CompletedProcess[str]":
    """A run in a process of its own, started by a shell with a redirection."""
    code = CALL.format(before=before)
    command = [sys.executable, "-c", code, "run", "jump", *DESIGN, "--json", *arguments]
    command += ["--duration", "0.25", "--out", str(tmp_path / "runs")]
    line = f"{shlex.join(command)} {redirect}"
    return subprocess.run(
        ["sh", "-c", line], capture_output=True, text=True, timeout=300, cwd=tmp_path, check=False
    )


@pytest.mark.parametrize(
    ("before", "redirect"),
    [
        ("pass", "2>&-"),
        pytest.param("pass", "0<&- 2>&-", marks=pytest.mark.long),
        pytest.param("pass", "2>/dev/full", marks=pytest.mark.long),
        (TERMINAL.format(error="BrokenPipeError(32, 'Broken pipe')"), ""),
        *(
            pytest.param(TERMINAL.format(error=error), "", marks=pytest.mark.long)
            for error in ("ValueError('I/O operation on closed file')", "AttributeError('write')")
        ),
    ],
    ids=["closed", "all closed", "full", "broken pipe", "closed file", "no write"],
)
def test_a_stderr_that_takes_nothing_ends_no_run(
    tmp_path: Path, before: str, redirect: str
) -> None:
    done = ran(tmp_path, before=before, redirect=redirect)
    assert done.returncode == 0
    assert done.stdout.startswith("{")
    assert done.stdout.count("\n") == 1
    (run,) = (tmp_path / "runs").iterdir()
    recording = load(run)
    assert recording.complete
    assert len(recording.time) == 250


@pytest.mark.parametrize("redirect", ["2>&-", pytest.param("2>/dev/full", marks=pytest.mark.long)])
def test_a_note_that_nobody_can_read_is_dropped(tmp_path: Path, redirect: str) -> None:
    """Without a stderr, `print` would put the note into the JSON."""
    done = ran(
        tmp_path, "--view", redirect="2>&-", before="import os; os.environ.pop('DISPLAY', 0)"
    )
    assert done.returncode == 0
    assert done.stdout.startswith("{")
    assert done.stdout.count("\n") == 1


def failed(capfd: pytest.CaptureFixture[str], out: Path) -> tuple[str, RunDescription]:
    """What a run says whose guest fails, and the description of what it leaves."""
    done = called(capfd, "run", "jump", *DESIGN, "--json", "--duration", "0.25", "--out", out)
    assert done.status == 1
    assert "Traceback" not in done.err
    (run,) = out.iterdir()
    return done.err, load(run).description


def test_a_controller_that_fails_is_a_message_with_its_lines_and_no_traceback(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    usual = Jump.step

    def step(self: Jump, observation: Observation) -> Command:
        if observation.time > 0.2:
            raise LookupError("no such phase")
        return usual(self, observation)

    monkeypatch.setattr(Jump, "step", step)
    said, run = failed(capfd, tmp_path)
    assert "legbench: the controller failed at t = 0.201 s: LookupError: no such" in said
    assert "in step" in said
    assert (run.status, run.cause) == ("fault", "controller failed")


@pytest.mark.parametrize("where", ["reset", "step"])
def test_a_plant_that_fails_otherwise_is_a_message_and_no_traceback(
    tmp_path: Path, where: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("no such body")

    monkeypatch.setattr(SimPlant, where, broken)
    said, run = failed(capfd, tmp_path)
    assert "legbench: the plant failed" in said
    assert "RuntimeError: no such body" in said
    assert (run.status, run.cause) == ("fault", "plant failed")
