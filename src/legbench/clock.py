"""Time for the loop: virtual, as fast as it goes, or the wall's, with absolute deadlines."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable
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
        """Return at once."""
        return 0.0


@final
class WallClock(AbstractClock):
    """Cycle k is due k periods after the start, however long the others took."""

    def __init__(
        self,
        period: float,
        now: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Periods, and what `now` and `sleep` count in, are seconds."""
        self._period, self._now, self._sleep = period, now, sleep
        self._start = 0.0

    def start(self) -> None:
        """Lay the grid of deadlines."""
        self._start = self._now()

    def wait(self, cycle: int) -> float:
        """Sleep until the deadline, if it lies ahead."""
        due = self._start + cycle * self._period
        ahead = due - self._now()
        if ahead > 0.0:
            self._sleep(ahead)
        return max(0.0, self._now() - due)
