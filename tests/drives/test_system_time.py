"""The machine's time base by a clock of the test's own: what the kernel is asked, how often."""

import select
import socket
from types import SimpleNamespace
from typing import Any, final

import pytest

from legbench.drives.errors import BusError
from legbench.drives.transport import timebase
from legbench.drives.transport.system import require_linux

STEP = 10_000
"""Time that a look at the clock takes [ns]."""
EINTR, EINVAL = 4, 22
CLOCK_MONOTONIC, TIMER_ABSTIME = 1, 1


@final
class Kernel:
    """A clock that goes on by looking at it, and a sleep that ends as it was told."""

    def __init__(self, now: int, codes: list[int]) -> None:
        self.now, self.codes, self.looks = now, codes, 0
        self.asked: list[tuple[int, int, int, int]] = []

    def monotonic_ns(self) -> int:
        self.looks += 1
        self.now += STEP
        return self.now - STEP

    def clock_nanosleep(self, clock: int, flags: int, spec: Any, left: None) -> int:
        assert left is None
        until = spec._obj
        self.asked.append((clock, flags, until.seconds, until.nanoseconds))
        code = self.codes.pop(0)
        if code == 0:
            self.now = 1_000_000_000 * until.seconds + until.nanoseconds
        return code


def _waited(
    monkeypatch: pytest.MonkeyPatch, until: int, *, codes: list[int], now: int, spin_ns: int = 0
) -> Kernel:
    kernel = Kernel(now, codes)
    clock = SimpleNamespace(monotonic_ns=kernel.monotonic_ns, CLOCK_MONOTONIC=CLOCK_MONOTONIC)
    with monkeypatch.context() as patch:
        patch.setattr(timebase.ctypes, "CDLL", lambda _name, **_options: kernel)
        patch.setattr(timebase, "time", clock)
        timebase.SystemTime(spin_ns).wait_until(until)
    return kernel


def test_a_wait_sleeps_to_the_spin_and_stays_awake_for_the_rest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    until = 7_250_000_000
    kernel = _waited(monkeypatch, until, codes=[0], now=5_000_000_000, spin_ns=5 * STEP)
    assert kernel.asked == [(CLOCK_MONOTONIC, TIMER_ABSTIME, 7, 249_950_000)]
    # One look before the sleep; after it one at the start of each step, and one at the end itself.
    assert (kernel.looks, kernel.now) == (1 + 6, until + STEP)


def test_a_wait_that_is_due_within_the_spin_never_sleeps(monkeypatch: pytest.MonkeyPatch) -> None:
    until = 7_000_000_000
    kernel = _waited(monkeypatch, until, codes=[], now=until - 2 * STEP, spin_ns=2 * STEP)
    assert (kernel.asked, kernel.looks) == ([], 1 + 2)
    late = _waited(monkeypatch, until, codes=[], now=until + 1)
    assert (late.asked, late.looks) == ([], 2)


def test_a_signal_ends_a_sleep_that_is_taken_up_again(monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = _waited(monkeypatch, 3_000_000_001, codes=[EINTR, EINTR, 0], now=0)
    assert kernel.asked == [(CLOCK_MONOTONIC, TIMER_ABSTIME, 3, 1)] * 3


def test_a_sleep_that_the_kernel_refuses_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(OSError, match="Invalid argument") as caught:
        _waited(monkeypatch, 3_000_000_000, codes=[EINVAL], now=0)
    assert caught.value.errno == EINVAL


@pytest.mark.parametrize(("module", "name"), [(socket, "AF_UNIX"), (select, "poll")])
def test_a_system_that_lacks_either_of_the_two_is_refused(
    monkeypatch: pytest.MonkeyPatch, module: Any, name: str
) -> None:
    require_linux("A bus")
    with monkeypatch.context() as patch:
        patch.delattr(module, name)
        with pytest.raises(BusError, match="A bus needs AF_UNIX sockets"):
            require_linux("A bus")
