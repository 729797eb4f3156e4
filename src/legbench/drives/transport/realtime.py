"""What the operating system grants a loop that has to be on time."""

import ctypes
import ctypes.util
import gc
import os
import platform
from dataclasses import dataclass
from pathlib import Path

PRIORITY = 80
"""Priority under SCHED_FIFO, above every process that is not the kernel's own."""
SPIN_NS = 100_000
"""Last part of every wait that is spent awake, where SCHED_FIFO is granted [ns]."""
MCL_CURRENT, MCL_FUTURE, MCL_ONFAULT = 1, 2, 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Granted:
    """Real-time services asked for and granted by the system; none of them is required."""

    fifo: str
    """Result of asking for SCHED_FIFO, such as `priority 80` or the refusal."""
    mlockall: str
    affinity: str
    spin_us: int
    kernel: str
    preemption: str


def ask(cpu: int | None = None, priority: int = PRIORITY) -> Granted:
    """Ask for real-time scheduling, locked memory and a processor of one's own.

    Garbage collection is switched off as well. All of it stays so until the process ends.

    Args:
        cpu: processor to stay on; none leaves the choice to the kernel.
        priority: priority under SCHED_FIFO.
    """
    fifo, granted = _fifo(priority)
    gc.collect()
    gc.freeze()
    gc.disable()
    return Granted(
        fifo=fifo,
        mlockall=_lock_memory(),
        affinity=_pin(cpu),
        # On a single processor whoever spins keeps the others from answering.
        spin_us=SPIN_NS // 1000 if granted and len(os.sched_getaffinity(0)) > 1 else 0,
        kernel=platform.release(),
        preemption=_preemption(),
    )


def _fifo(priority: int) -> tuple[str, bool]:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    except OSError as error:
        return f"refused ({error.strerror}); see hardware/limits.conf", False
    return f"priority {priority}", True


def _lock_memory() -> str:
    """Lock present memory at once and later memory when it is first used; returns the result.

    Without MCL_ONFAULT an allocator that reserves a gigabyte in advance, as Arrow's does, would get
    all of it, half a second later.
    """
    library = ctypes.CDLL(ctypes.util.find_library("c"), use_errno=True)
    if all(
        library.mlockall(flags) == 0
        for flags in (MCL_CURRENT, MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT)
    ):
        return "granted"
    return f"refused ({os.strerror(ctypes.get_errno())}); see hardware/limits.conf"


def _pin(cpu: int | None) -> str:
    allowed = sorted(os.sched_getaffinity(0))
    if cpu is None:
        return f"not asked for, {len(allowed)} processors"
    try:
        os.sched_setaffinity(0, {cpu})
    except OSError as error:
        return f"refused ({error.strerror}); there are {', '.join(map(str, allowed))}"
    return f"processor {cpu} of {len(allowed)}"


def _preemption() -> str:
    if Path("/sys/kernel/realtime").exists():
        return "PREEMPT_RT"
    words = platform.version().split()
    return next((word for word in words if word.startswith("PREEMPT")), "voluntary or none")
