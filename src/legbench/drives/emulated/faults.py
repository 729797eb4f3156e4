"""Faults to inject into an emulated bus, each in a window of virtual time; pure."""

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

from legbench.drives.protocol.frame import Frame

FOREVER_NS = 1 << 62


class FrameFaultKind(Enum):
    """What may happen to a frame."""

    DROP = "dropped"
    """Acknowledged by somebody, received by nobody."""
    DELAY = "delayed"
    DUPLICATE = "duplicated"
    WRONG_LENGTH = "wrong length"
    BAD_BITS = "corrupted"
    """Error frame, then sent again; the sender's error counter rises by 8."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameFault:
    """Happens to frames with an identifier, or to all."""

    family: ClassVar[str] = "frame"
    kind: FrameFaultKind
    cob_id: int | None = None
    start_ns: int = 0
    end_ns: int = FOREVER_NS
    delay_ns: int = 0
    """Of a delayed or duplicated frame."""
    length: int = 0
    """Of a frame of wrong length [bytes]."""

    def hits(self, frame: Frame, now_ns: int) -> bool:
        """Whether this frame is meant."""
        return self.start_ns <= now_ns < self.end_ns and self.cob_id in (None, frame.cob_id)


class NodeFaultKind(Enum):
    """What may happen to a drive."""

    RESET = "reset"
    HEARTBEAT_LOSS = "heartbeat loss"
    UNDER_VOLTAGE = "under-voltage"
    OVER_TEMPERATURE = "over-temperature"
    BUS_OFF = "bus-off"
    SILENT = "silent"
    """Its plug is pulled: it neither hears nor speaks, and does not know."""
    WARNING = "warning"
    """Bit 7 of its statusword."""
    JAMMED = "jammed motor"
    MOTOR_FROZEN = "frozen motor encoder"
    LINK_FROZEN = "frozen link encoder"
    REPEATING = "process data repeated"
    """Its process data repeat themselves to the bit, the statusword included."""
    MOTOR_STEP = "step of the motor encoder"
    LINK_STEP = "step of the link encoder"
    MOTOR_DRIFT = "drift of the motor encoder"
    LINK_DRIFT = "drift of the link encoder"


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeFault:
    """Happens to a drive, by node id."""

    family: ClassVar[str] = "node"
    kind: NodeFaultKind
    node_id: int
    start_ns: int
    end_ns: int = FOREVER_NS
    """When its cause is gone; a reset happens once."""
    size: float = 0.0
    """Of a step [rad] or a drift [rad/s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Babble:
    """A node that shouts: a frame every so often, whatever the others have to say."""

    family: ClassVar[str] = "babble"
    cob_id: int
    start_ns: int
    end_ns: int
    every_ns: int
    data: bytes = bytes(8)


Fault = FrameFault | NodeFault | Babble
"""Anything that may be injected."""
