"""Faults to inject into an emulated bus, each in a window of virtual time; pure."""

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

from legbench.drives.protocol.frame import Frame

FOREVER_NS = 1 << 62


class FrameFaultKind(Enum):
    """Kinds of fault that a frame may have."""

    DROP = "dropped"
    """The frame is acknowledged on the wire, but no node receives it."""
    DELAY = "delayed"
    DUPLICATE = "duplicated"
    WRONG_LENGTH = "wrong length"
    BAD_BITS = "corrupted"
    """The frame is destroyed and sent again; the sender's error counter rises by 8."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameFault:
    """A fault of all frames with an identifier, or of all frames, in a window of time."""

    family: ClassVar[str] = "frame"
    kind: FrameFaultKind
    cob_id: int | None = None
    start_ns: int = 0
    end_ns: int = FOREVER_NS
    delay_ns: int = 0
    """Delay of a delayed frame, or of the copy of a duplicated one [ns]."""
    length: int = 0
    """Length that a frame of wrong length is cut or filled to [bytes]."""

    def hits(self, frame: Frame, now_ns: int) -> bool:
        """Whether this fault applies to a frame at this time."""
        return self.start_ns <= now_ns < self.end_ns and self.cob_id in (None, frame.cob_id)


class NodeFaultKind(Enum):
    """Kinds of fault that a drive may have."""

    RESET = "reset"
    HEARTBEAT_LOSS = "heartbeat loss"
    UNDER_VOLTAGE = "under-voltage"
    OVER_TEMPERATURE = "over-temperature"
    BUS_OFF = "bus-off"
    SILENT = "silent"
    """The drive's connector is unplugged: it neither receives nor sends, and does not notice."""
    WARNING = "warning"
    """The warning bit (bit 7) of the drive's statusword is set."""
    JAMMED = "jammed motor"
    MOTOR_FROZEN = "frozen motor encoder"
    LINK_FROZEN = "frozen link encoder"
    REPEATING = "process data repeated"
    """The drive repeats its last process data bit for bit, the statusword included."""
    MOTOR_STEP = "step of the motor encoder"
    LINK_STEP = "step of the link encoder"
    MOTOR_DRIFT = "drift of the motor encoder"
    LINK_DRIFT = "drift of the link encoder"


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeFault:
    """A fault of one drive, which its node id names, in a window of time."""

    family: ClassVar[str] = "node"
    kind: NodeFaultKind
    node_id: int
    start_ns: int
    end_ns: int = FOREVER_NS
    """Time at which the cause of the fault is gone [ns]; a reset happens once, at the start."""
    size: float = 0.0
    """Size of an encoder's step [rad] or drift [rad/s]; other kinds do not use it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Babble:
    """A babbling node: it sends a frame every `every_ns`, whatever other nodes send."""

    family: ClassVar[str] = "babble"
    cob_id: int
    start_ns: int
    end_ns: int
    every_ns: int
    data: bytes = bytes(8)


Fault = FrameFault | NodeFault | Babble
"""Anything that may be injected."""
