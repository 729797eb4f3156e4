"""Virtual time of an emulated bus, led by the machine's clock."""

from collections.abc import Callable
from typing import Protocol, final

from legbench.drives.transport.timebase import Timebase

FORGIVEN_NS = 3_000_000
"""Longest step of virtual time at once; the rest of a longer pause is left out [ns]."""


class VirtualTime(Timebase, Protocol):
    """Virtual time of one network, or of several that pass it together."""

    def next_ns(self) -> int:
        """Time of the next event [ns]."""
        ...


@final
class Pacer:
    """Pacer that lets virtual time follow a clock."""

    def __init__(self, virtual: VirtualTime, now_ns: Callable[[], int]) -> None:
        self._virtual, self._now_ns = virtual, now_ns
        self._offset_ns = now_ns() - virtual.now_ns()

    def advance(self) -> None:
        """Advance virtual time to the present time of the clock."""
        now_ns, before_ns = self._now_ns() - self._offset_ns, self._virtual.now_ns()
        away_ns = now_ns - before_ns
        if away_ns > FORGIVEN_NS:
            self._offset_ns += away_ns - FORGIVEN_NS
            now_ns = before_ns + FORGIVEN_NS
        self._virtual.wait_until(now_ns)

    def wait_s(self) -> float:
        """Time until the next event [s]."""
        return max(0.0, 1e-9 * (self._virtual.next_ns() + self._offset_ns - self._now_ns()))
