"""Work in a fork of this process, ended when its time is up or when it sleeps for ever."""

import os
import resource
import signal
import time
from collections.abc import Callable
from pathlib import Path

FAILED = 70
"""Status of a child whose work raised."""
LOOK = 0.01
"""Time between two looks at a child [s]."""
ASLEEP = 4.0
"""A child that neither ran nor waited for a processor for so long waits for ever [s]."""


def in_background(work: Callable[[], int]) -> int:
    """Begin some work in a fork of this process that writes nothing out; return its id."""
    pid = os.fork()
    if pid == 0:
        silent = os.open(os.devnull, os.O_RDWR)
        os.dup2(silent, 1)
        status = FAILED
        try:
            status = int(work())
        finally:
            os._exit(status)
    return pid


def in_fork(work: Callable[[], int], seconds: float) -> int | None:
    """Exit status of some work in a silent fork of this process; none when it had to be ended.

    Its time is that of the processor [s], so that a busy machine ends nothing.
    """
    pid = os.fork()
    if pid == 0:
        _become_child(work, seconds)
    ran, since = -1, time.monotonic()
    while True:
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            _end_group(pid)
            return os.waitstatus_to_exitcode(status) if os.WIFEXITED(status) else None
        time.sleep(LOOK)
        now = time.monotonic()
        if now - since > ASLEEP:
            before, ran, since = ran, _scheduled(pid), now
            if ran == before:
                _end_group(pid)


def _become_child(work: Callable[[], int], seconds: float) -> None:
    os.setpgid(0, 0)
    limit = int(seconds) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
    silent = os.open(os.devnull, os.O_RDWR)
    for number in (0, 1, 2):
        os.dup2(silent, number)
    status = FAILED
    try:
        status = int(work())
    finally:
        os._exit(status)


def _scheduled(pid: int) -> int:
    """Tenths of a second that the threads of a process have run or waited for a processor."""
    total = 0
    for task in Path(f"/proc/{pid}/task").glob("*/schedstat"):
        try:
            on_processor, waiting, _ = task.read_text().split()
        except FileNotFoundError:
            continue
        total += int(on_processor) + int(waiting)
    return total // 100_000_000


def _end_group(pid: int) -> None:
    """End a child and what it may have left running."""
    try:
        os.killpg(pid, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        return
