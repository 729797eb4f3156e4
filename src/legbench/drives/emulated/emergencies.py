"""Emergency messages of an emulated drive on their way out (CiA 301, objects 1014h and 1015h)."""

from collections.abc import Mapping
from typing import final

from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.objects import Key

INHIBIT_NS = 100_000
"""Unit of the inhibit time 1015h [ns]."""


@final
class EmergencyOutlet:
    """Sends the emergency messages of a drive, not too fast and only while it may send.

    Attributes:
        ready: messages that `take` returns.
    """

    def __init__(self, values: Mapping[Key, int]) -> None:
        self._values = values
        self._free_ns = 0
        self._muted = False
        self._held: list[Frame] = []
        self.ready: list[tuple[int, Frame]] = []

    def put(self, frame: Frame | None, now_ns: int) -> None:
        """Send a message, if there is one, as soon as the inhibit time allows."""
        if frame is None:
            return
        if self._muted:
            self._held.append(frame)
            return
        at_ns = max(now_ns, self._free_ns)
        self._free_ns = at_ns + INHIBIT_NS * self._values[0x1015, 0]
        self.ready.append((at_ns, frame))

    def mute(self) -> None:
        """Keep messages back: the drive is off the bus, or boots."""
        self._muted = True

    def unmute(self, now_ns: int) -> None:
        """Send the messages that were kept back."""
        self._muted = False
        held, self._held = self._held, []
        for frame in held:
            self.put(frame, now_ns)

    def take(self) -> list[tuple[int, Frame]]:
        """Messages since the last call, each with the time at which it is ready [ns]."""
        out, self.ready = self.ready, []
        return out

    def clear(self) -> None:
        """Forget all messages, as after power-on."""
        self._held.clear()
        self.ready.clear()
        self._free_ns = 0
