"""Time bases of a bus: what a time base is, and the machine's."""

import ctypes
import ctypes.util
import os
import time
from typing import Protocol, final

SECOND_NS = 1_000_000_000


class Timebase(Protocol):
    """Monotonic time, and waiting for a point of it."""

    def now_ns(self) -> int:
        """Now [ns]."""
        ...

    def wait_until(self, at_ns: int) -> None:
        """Return at `at_ns`, or at once if it has passed."""
        ...


class _Timespec(ctypes.Structure):
    _fields_ = (("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long))


@final
class SystemTime:
    """CLOCK_MONOTONIC with absolute sleeps; the last `spin_ns` are waited for awake."""

    def __init__(self, spin_ns: int = 0) -> None:
        self._spin_ns = spin_ns
        library = ctypes.CDLL(ctypes.util.find_library("c"), use_errno=True)
        self._sleep = library.clock_nanosleep
        self._timespec = _Timespec()

    def now_ns(self) -> int:
        """Now [ns]."""
        return time.monotonic_ns()

    def wait_until(self, at_ns: int) -> None:
        """Sleep to an absolute time, so that waking late never adds up.

        Raises:
            OSError: the kernel refuses the sleep.
        """
        spec = self._timespec
        spec.seconds, spec.nanoseconds = divmod(at_ns - self._spin_ns, SECOND_NS)
        if time.monotonic_ns() < at_ns - self._spin_ns:
            # TIMER_ABSTIME; a signal ends the sleep early, its handler has run, sleep again.
            while (code := self._sleep(time.CLOCK_MONOTONIC, 1, ctypes.byref(spec), None)) != 0:
                if code != 4:  # EINTR
                    raise OSError(code, os.strerror(code))
        while time.monotonic_ns() < at_ns:
            pass
