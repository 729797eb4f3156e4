"""Errors of an emulated drive: emergency messages, error register, history."""

from typing import final

from legbench.drives.protocol.emcy import Emergency, emcy_frame
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.objects import Key

REGISTER_BITS = {0x2: 1, 0x3: 2, 0x4: 3, 0x8: 4}
"""First digit of an error code -> bit of 1001h; bit 0 is set with any."""
PROFILE_BIT = 5
VENDOR_BIT = 7


def register_of(code: int) -> int:
    """Error register 1001h of one error code."""
    if code == 0:
        return 0
    if code >= 0xFF00:
        return 1 | 1 << VENDOR_BIT
    if code >> 8 == 0x86:
        return 1 | 1 << PROFILE_BIT
    return 1 | 1 << REGISTER_BITS.get(code >> 12, 0)


@final
class Alarms:
    """Errors of one node; they cannot be reset while the cause of one is present.

    Attributes:
        node_id: node id under which they are reported.
    """

    def __init__(self, node_id: int, values: dict[Key, int]) -> None:
        self.node_id, self._values = node_id, values
        self._standing: set[int] = set()
        self._shown: list[int] = []

    def raise_(self, code: int) -> Frame | None:
        """Record a new error; returns its emergency message, none if it has been sent."""
        if code in self._shown:
            return None
        self._shown.append(code)
        values = self._values
        values[0x603F, 0] = code
        values[0x1003, 0], values[0x1003, 1] = 1, code
        return self._message(code)

    def hold(self, code: int) -> None:
        """Record that the cause of an error is present."""
        self._standing.add(code)

    def release(self, code: int) -> None:
        """Record that the cause of an error is gone; the error stays until it is reset."""
        self._standing.discard(code)

    @property
    def standing(self) -> bool:
        """Whether the cause of any error is still present."""
        return bool(self._standing)

    def reset(self) -> Frame | None:
        """Clear all errors, unless a cause is present; returns the all-clear, if there were any."""
        if not self._shown or self._standing:
            return None
        self._shown.clear()
        self._values[0x603F, 0] = 0
        return self._message(0)

    def clear(self, code: int) -> Frame | None:
        """Clear a communication error, which ends by itself; returns the all-clear, if due.

        603Fh then shows the latest of the errors that are left.
        """
        if code not in self._shown:
            return None
        self._shown.remove(code)
        all_clear = self._message(0)
        self._values[0x603F, 0] = self._shown[-1] if self._shown else 0
        return None if self._shown else all_clear

    def _message(self, code: int) -> Frame:
        register = 0
        for shown in self._shown:
            register |= register_of(shown)
        self._values[0x1001, 0] = register
        return emcy_frame(Emergency(node_id=self.node_id, code=code, register=register))
