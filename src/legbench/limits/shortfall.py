"""What became of a controller's wishes: how often and by how much the limits changed them."""

from collections.abc import Sequence
from typing import Any, final


@final
class Shortfall:
    """Counts commands that were let through otherwise than wished.

    Attributes:
        cycles: commands since `restart`, counted by the caller before `count`.
        limited: of these, how many were changed.
    """

    def __init__(self, period: float) -> None:
        """Count cycles of a period [s]."""
        self._period = period
        self.restart()

    def restart(self) -> None:
        """Forget everything; the next command is number 0."""
        self.cycles = self.limited = 0
        self._first: int | None = None
        self._motors: list[list[float]] = []

    def count(
        self, wish: Sequence[float], wanted: Sequence[float], applied: Sequence[float]
    ) -> None:
        """Take one command.

        Args:
            wish: what the controller asked for [rad].
            wanted: the same within the ranges [rad].
            applied: what was let through, slewed [rad].
        """
        if not self._motors:
            self._motors = [[0, 0, 0.0] for _ in wish]
        for motor, asked, clamped, given in zip(self._motors, wish, wanted, applied, strict=True):
            motor[0] += clamped != asked
            motor[1] += given != clamped
            motor[2] = max(motor[2], abs(asked - given))
        if self._first is None:
            self._first = self.cycles - 1
        self.limited += 1

    def told(self) -> dict[str, Any] | None:
        """Return the event's content, or None if every wish was let through."""
        if self._first is None:
            return None
        return {
            "cycles": self.limited,
            "of": self.cycles,
            "first": self._first * self._period,
            "clamped": [int(motor[0]) for motor in self._motors],
            "slewed": [int(motor[1]) for motor in self._motors],
            "worst": [motor[2] for motor in self._motors],
        }
