"""Network management and heartbeat (CiA 301, 7.2.8)."""

from collections.abc import Mapping
from enum import IntEnum
from typing import final

from legbench.drives.protocol.frame import HEARTBEAT_BASE, LAST_NODE, NMT_ID, Frame


class NmtCommand(IntEnum):
    """Command specifiers of the NMT service."""

    START = 1
    STOP = 2
    ENTER_PRE_OPERATIONAL = 128
    RESET_NODE = 129
    RESET_COMMUNICATION = 130


class NmtState(IntEnum):
    """NMT states as a heartbeat reports them; 0 is the boot-up message."""

    BOOT_UP = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


ORDERED: Mapping[NmtCommand, NmtState] = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}
"""State that a command leads to, unless it is a reset."""
_COMMANDS = {int(command): command for command in NmtCommand}
_STATES = {int(state): state for state in NmtState}


def nmt_frame(command: NmtCommand, node_id: int = 0) -> Frame:
    """Frame of an NMT command to one node, or to all of them (0)."""
    return Frame(NMT_ID, bytes((command, node_id)))


def decode_nmt(data: bytes) -> tuple[NmtCommand, int] | None:
    """Command and node (0: all); none when the bytes are no NMT order."""
    if len(data) != 2 or data[1] > LAST_NODE or data[0] not in _COMMANDS:
        return None
    return _COMMANDS[data[0]], data[1]


def heartbeat_frame(node_id: int, state: NmtState) -> Frame:
    """Frame of a heartbeat, or of the boot-up message, of a node."""
    return Frame(HEARTBEAT_BASE + node_id, bytes((state,)))


def decode_heartbeat(data: bytes) -> NmtState | None:
    """State of the producer; bit 7 toggles in node guarding and is ignored."""
    if len(data) != 1:
        return None
    return _STATES.get(data[0] & 0x7F)


@final
class HeartbeatWatch:
    """Times one producer; it counts from the start, so a node never seen is lost, too."""

    def __init__(self, timeout_ns: int, now_ns: int) -> None:
        self.timeout_ns = timeout_ns
        self.last_ns = now_ns

    def feed(self, now_ns: int) -> None:
        """Restart the time-out at a heartbeat."""
        self.last_ns = now_ns

    def lost(self, now_ns: int) -> bool:
        """Whether the heartbeat is overdue."""
        return now_ns - self.last_ns > self.timeout_ns
