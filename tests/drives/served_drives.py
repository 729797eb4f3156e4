"""Emulated drives and masters in processes of their own, over AF_UNIX; bounded in time."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from can_rig import BUS, LIMITS, ROOT

PATIENCE = 30.0
"""Longest that anything may take on a busy machine [s]."""
LOOSE = {
    "lost_frames": 5000,
    "overrun_cycles": 5000,
    "following_cycles": 5000,
    "joint_speed": 1000.0,
    "standing": 6.0,
    "sway": 6.0,
}
"""Limits that act while a machine is busy. Drives that were kept waiting make up for it by 3 ms at
once: between two SYNCs their leg then moves three times as fast as it is."""
CALL = "import sys\nfrom legbench.cli import main\nsys.exit(main(sys.argv[1:]))"


@dataclass
class Served:
    """Emulated drives that other processes can reach."""

    folder: Path
    process: subprocess.Popen[str]
    seen: list[tuple[str, str]] = field(default_factory=list)

    def await_state(self, state: str, count: int = 2) -> None:
        """Read on until so many drives have come to a state."""
        assert self.process.stdout is not None
        found = 0
        while found < count:
            line = self.process.stdout.readline()
            assert line, f"the drives ended; seen: {self.seen}"
            told = json.loads(line)
            self.seen.append((told["node"], told["state"]))
            found += told["state"] == state


def calm(folder: Path, deadline_ms: int = 4000) -> Path:
    """The bench's files, patient enough for a machine that stands still for seconds."""
    text = BUS.read_text(encoding="utf-8")
    waived = 'waive = ["master watch", "drive heartbeat"]'
    text = text.replace("master_heartbeat_ms = 10", f"master_heartbeat_ms = 2000\n{waived}")
    # In cycles of 4 ms two processes in real time take a quarter of the processor time.
    text = text.replace("period_us = 1000", "period_us = 4000")
    text = text.replace("tpdo_deadline_us = 720", "tpdo_deadline_us = 2880")
    text = text.replace("heartbeat_ms = 20\n", "heartbeat_ms = 2000\n", 1)
    rpdo = '\n[[node.rpdo]]\nnumber = 1\nobjects = ["6040:00 u16", "607A:00 i32"]\n'
    text = text.replace(
        "\n[node.parameters]", rpdo + f"deadline_ms = {deadline_ms}\n\n[node.parameters]"
    )
    (folder / "leg.toml").write_text(text, encoding="utf-8")
    shutil.copy(LIMITS, folder / "limits.toml")
    loose = (folder / "limits.toml").read_text(encoding="utf-8")
    for name, value in LOOSE.items():
        loose = "\n".join(
            f"{name} = {value:g}" if line.startswith(name) else line for line in loose.splitlines()
        )
    waive = f"waive = {json.dumps(list(LOOSE))}\n"
    (folder / "limits.toml").write_text(loose + "\n" + waive, encoding="utf-8")
    return folder / "leg.toml"


def started(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", CALL, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
    )


def end(process: subprocess.Popen[str]) -> None:
    with suppress(ProcessLookupError):
        os.kill(process.pid, signal.SIGKILL)
    process.communicate()


@contextmanager
def served(
    folder: Path, *how: str, seconds: float = 3 * PATIENCE, deadline_ms: int = 4000
) -> Iterator[Served]:
    """Drives over AF_UNIX that end by themselves after a while [s]."""
    calm(folder, deadline_ms)
    process = started(
        folder,
        *("drives", "emulate", "--bus", "leg.toml", "--channel", "leg.sock", "--bare", "--json"),
        *how,
        *("--patience", "5000", "--seconds", str(seconds)),
        *("--design", str(ROOT / "models" / "optimal.toml")),
    )
    try:
        yield Served(folder, process)
    finally:
        end(process)


def master(folder: Path, out: str) -> subprocess.Popen[str]:
    return started(
        folder,
        *("run", "position-jump", "--plant", "can", "--bus", "leg.toml", "--duration", "25"),
        *("--interface", "legbench_unix", "--channel", "leg.sock", "--out", out),
        *("--design", str(ROOT / "models" / "optimal.toml")),
    )


@contextmanager
def leading(folder: Path, drives: Served, out: str = "runs") -> Iterator[subprocess.Popen[str]]:
    """A master in a process of its own, from when both drives are enabled and rows are written.

    The drives are without power when it is called.
    """
    run = master(folder, out)
    try:
        drives.await_state("operation enabled")
        rows_on_disk(folder / out)
        yield run
    finally:
        end(run)


def interrupted(drives: Served, run: subprocess.Popen[str]) -> str:
    """Stop a master by ^C and wait until both drives are off; what it said on stderr."""
    if run.poll() is not None:
        pytest.fail(f"the master ended by itself: {run.communicate()[1]}")
    os.kill(run.pid, signal.SIGINT)
    drives.await_state("switch on disabled")
    _, complaint = run.communicate(timeout=PATIENCE)
    assert run.returncode == 0, complaint
    return complaint


def run_folder(folder: Path, out: str = "runs") -> Path:
    return next((folder / out).iterdir())


def rows_on_disk(out: Path) -> None:
    """Wait until the recording has begun."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        found = list(out.glob("*/samples.arrows"))
        if found and found[0].stat().st_size > 20_000:
            return
        time.sleep(0.02)
    pytest.fail("no rows")
