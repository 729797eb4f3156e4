"""What is wrong with a drive: emergency messages, error register, history."""

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
    """Errors of one node; those whose cause stands cannot be reset."""

    def __init__(self, node_id: int, values: dict[Key, int]) -> None:
        self._node_id, self._values = node_id, values
        self._standing: set[int] = set()
        self._shown: set[int] = set()

    def raise_(self, code: int) -> Frame | None:
        """An error has come; its message, once."""
        if code in self._shown:
            return None
        self._shown.add(code)
        values = self._values
        values[0x603F, 0] = code
        values[0x1003, 0], values[0x1003, 1] = 1, code
        return self._message(code)

    def hold(self, code: int) -> None:
        """The cause of an error stands."""
        self._standing.add(code)

    def release(self, code: int) -> None:
        """The cause has gone; the error stays until it is reset."""
        self._standing.discard(code)

    @property
    def standing(self) -> bool:
        """Whether any cause is still there."""
        return bool(self._standing)

    def reset(self) -> Frame | None:
        """Forget the errors whose causes have gone; the all-clear, if there were any."""
        if not self._shown or self._standing:
            return None
        self._shown.clear()
        self._values[0x603F, 0] = 0
        return self._message(0)

    def clear(self, code: int) -> Frame | None:
        """A communication error is over by itself; the all-clear, if it was the last."""
        if code not in self._shown:
            return None
        self._shown.discard(code)
        if self._shown:
            return None
        self._values[0x603F, 0] = 0
        return self._message(0)

    def _message(self, code: int) -> Frame:
        register = 0
        for shown in self._shown:
            register |= register_of(shown)
        self._values[0x1001, 0] = register
        return emcy_frame(Emergency(node_id=self._node_id, code=code, register=register))
