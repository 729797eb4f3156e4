"""Time for the loop: virtual, as fast as it goes, or the wall's, with absolute deadlines."""

import time
from abc import ABC, abstractmethod
from typing import final


class AbstractClock(ABC):
    """Says when a cycle may begin."""

    @abstractmethod
    def start(self) -> None:
        """Cycle 0 begins now."""

    @abstractmethod
    def wait(self, cycle: int) -> float:
        """Return when `cycle` is due; how late that is [s]."""


@final
class VirtualClock(AbstractClock):
    """Never waits, is never late."""

    def start(self) -> None:
        """Nothing to remember."""

    def wait(self, cycle: int) -> float:
        """At once."""
        return 0.0


@final
class WallClock(AbstractClock):
    """Cycle k is due k periods after the start, however long the others took."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._start = 0.0

    def start(self) -> None:
        """Lay the grid of deadlines."""
        self._start = time.perf_counter()

    def wait(self, cycle: int) -> float:
        """Sleep until the deadline, if it lies ahead."""
        due = self._start + cycle * self._period
        ahead = due - time.perf_counter()
        if ahead > 0.0:
            time.sleep(ahead)
        return max(0.0, time.perf_counter() - due)
