"""Nodes of an emulated bus: participants that speak by themselves, and a master's controller."""

from collections import deque
from typing import NamedTuple, Protocol, final

from legbench.drives.protocol.frame import Frame


class Participant(Protocol):
    """A participant of the bus that sends frames by itself."""

    def receive(self, frame: Frame, now_ns: int) -> None:
        """Receive a frame of another node."""
        ...

    def take(self) -> list[tuple[int, Frame]]:
        """Frames to send, each with the time at which it is ready [ns]."""
        ...

    def tick(self, now_ns: int) -> float:
        """Check the timers, once a body period; returns the motor position of a drive [rad]."""
        ...


class Heard(NamedTuple):
    """A frame that a master's controller has received."""

    at_ns: int
    """Time of its end on the wire [ns]."""
    frame: Frame
    own: bool = False
    """Whether this controller has sent it itself."""


@final
class Station:
    """A master's controller: a queue of received frames and an error counter."""

    def __init__(
        self, tx_queue: int, bitrate: int, *, listen_only: bool = False, echo: bool = False
    ) -> None:
        self.received: deque[Heard] = deque()
        self.tx_queue, self.bitrate, self.listen_only = tx_queue, bitrate, listen_only
        self.echo = echo
        """Whether it receives its own frames, too, when they were on the wire."""
        self.waiting = 0
        """Number of frames that have not been on the wire yet."""
        self.unread = 0
        """Receive error counter: frames of others that made no sense here."""


Node = Participant | Station
