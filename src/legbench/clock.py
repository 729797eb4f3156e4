"""Time for the loop: virtual, as fast as it goes, or the wall's, with absolute deadlines."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import final


class AbstractClock(ABC):
    """Clock that says when a cycle may begin."""

    @abstractmethod
    def start(self) -> None:
        """Begin cycle 0 now."""

    @abstractmethod
    def wait(self, cycle: int) -> float:
        """Wait until `cycle` is due; returns how late it is then [s]."""


@final
class VirtualClock(AbstractClock):
    """Clock in virtual time, which never waits and is never late."""

    def start(self) -> None:
        """Begin cycle 0, which needs no time."""

    def wait(self, cycle: int) -> float:
        """Return at once."""
        return 0.0


@final
class WallClock(AbstractClock):
    """Clock in wall time: cycle k is due k periods after the start, whatever the others took."""

    def __init__(
        self,
        period: float,
        now: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Prepare to pace cycles; the period, `now` and `sleep` count in seconds."""
        self._period, self._now, self._sleep = period, now, sleep
        self._start = 0.0

    def start(self) -> None:
        """Lay the grid of deadlines."""
        self._start = self._now()

    def wait(self, cycle: int) -> float:
        """Sleep until the deadline, if it lies ahead; returns how late the cycle is then [s]."""
        due = self._start + cycle * self._period
        ahead = due - self._now()
        if ahead > 0.0:
            self._sleep(ahead)
        return max(0.0, self._now() - due)
