"""Master and drives in processes of their own on vcan0, forked from one that has imported all.

Nothing here measures. In the guest time is virtual: a sleep takes as long as it says, however busy
the machine is.
"""

import json
import os
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from legbench.cli import main

CHANNEL, SECOND = "vcan0", "vcan1"
BUS = ("--interface", "socketcan", "--channel", CHANNEL)
PATIENCE = 3600.0
"""Longest that anything may take to happen [s]. An hour of the guest's time is half a minute of the
machine's when nobody has anything to do, such as while a file is fetched from outside."""


class TooLateError(Exception):
    """What was waited for has not happened."""


def ip(*words: str) -> None:
    """Set an interface up; raises CalledProcessError."""
    subprocess.run(["ip", *words], check=True)


@dataclass
class Child:
    """A fork of this process, and what it prints."""

    pid: int
    output: Path
    status: int | None = None

    @property
    def text(self) -> str:
        """What it has printed so far."""
        return self.output.read_text(encoding="utf-8")

    def ended(self) -> bool:
        """Whether it is over."""
        if self.status is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.status = os.waitstatus_to_exitcode(status)
        return self.status is not None

    def wait_for(self, happened: Callable[[], bool]) -> None:
        """Until something has happened while it runs; raises TooLateError."""
        until = time.monotonic() + PATIENCE
        while not happened():
            if self.ended() or time.monotonic() > until:
                raise TooLateError(f"process {self.pid} has not got so far: {self.text}")
            time.sleep(0.01)

    def wait(self) -> int:
        """Exit status in the end; raises TooLateError."""
        until = time.monotonic() + PATIENCE
        while not self.ended():
            if time.monotonic() > until:
                raise TooLateError(f"process {self.pid} does not end: {self.text}")
            time.sleep(0.01)
        assert self.status is not None
        return self.status

    def signal(self, number: signal.Signals) -> None:
        """Send it a signal."""
        os.kill(self.pid, number)

    def end(self) -> None:
        """Kill it, if it still runs."""
        if not self.ended():
            with suppress(ProcessLookupError):
                self.signal(signal.SIGKILL)
            self.wait()

    @property
    def spent_ns(self) -> int:
        """Processor time of its main thread so far."""
        return int(Path(f"/proc/{self.pid}/schedstat").read_text().split()[0])


def forked(output: Path, work: Callable[[], int]) -> Child:
    """Do some work in a fork; its value is the exit status."""
    output.touch()
    pid = os.fork()
    if pid:
        return Child(pid, output)
    status = 70
    try:
        sys.stdout = sys.stderr = output.open("w", encoding="utf-8", buffering=1)
        status = work()
    except SystemExit as error:
        status = error.code if isinstance(error.code, int) else 1
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
    os._exit(status)


def legbench(output: Path, *arguments: str) -> Child:
    """Run a command in a fork."""
    return forked(output, lambda: main(list(arguments)))


@dataclass
class Drives:
    """Both emulated drives on the interface, and what they tell of their states."""

    child: Child
    read: int = 0
    states: dict[str, list[str]] = field(default_factory=dict)

    def are(self, state: str) -> bool:
        """Whether both are in a state now."""
        lines = [line for line in self.child.text.splitlines() if line.startswith("{")]
        for line in lines[self.read :]:
            told = json.loads(line)
            self.states.setdefault(told["node"], []).append(told["state"])
        self.read = len(lines)
        return len(self.states) == 2 and all(seen[-1] == state for seen in self.states.values())

    def wait_for(self, state: str) -> None:
        """Until both are in a state; raises TooLateError."""
        until = time.monotonic() + PATIENCE
        while not self.are(state):
            if self.child.ended() or time.monotonic() > until:
                raise TooLateError(
                    f"the drives never were in {state!r}: {self.states}; {self.child.text[-500:]}"
                )
            time.sleep(0.005)


@contextmanager
def drives_on(folder: Path, *options: str, bus: tuple[str, ...] = BUS) -> Iterator[Drives]:
    """`legbench drives emulate` on the interface, or on that of other flags, ready."""
    child = legbench(folder / "drives.txt", "drives", "emulate", *bus, "--json", *options)
    try:
        drives = Drives(child)
        drives.wait_for("switch on disabled")
        yield drives
    finally:
        child.end()
