"""^C while the processes of a basin map start: status 130, one line, and nobody is left."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

DESIGN = Path(__file__).parents[2] / "models" / "prototype.toml"
PATIENCE = 90.0
"""Longest time that anything may take [s]; the map ends in a few."""


@pytest.mark.parametrize("delay", [0.0, pytest.param(0.4, marks=pytest.mark.long)])
def test_an_interrupt_while_workers_start_is_one_line(delay: float, tmp_path: Path) -> None:
    out = tmp_path / "map"
    command = [sys.executable, "-m", "legbench", "hop", str(DESIGN), "--hops", "10"]
    command += ["--basin", "30", "--workers", "2", "--out", str(out)]
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        end = time.monotonic() + PATIENCE
        # The rows' file is opened right before the workers are started.
        while not (out / "basin.jsonl").exists():
            assert process.poll() is None
            assert time.monotonic() < end
            time.sleep(0.005)
        time.sleep(delay)
        os.killpg(process.pid, signal.SIGINT)
        said, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert said == ""
    lines = [line for line in errors.splitlines() if not line.startswith("wrote ")]
    assert lines == ["legbench: interrupted"]
    # The tracker of shared resources ends a moment after the process that it is for.
    while living(process.pid):
        assert time.monotonic() < end
        time.sleep(0.02)


def living(group: int) -> bool:
    """Whether a process of a group is there that has not ended."""
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            state, _, own = (folder / "stat").read_text().rpartition(")")[2].split()[:3]
            if int(own) == group and state not in ("Z", "X"):
                return True
    return False
