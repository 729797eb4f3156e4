"""Fault reset of drives (CiA 402-2, transition 15), over SDO; no drive is enabled."""

from collections.abc import Sequence
from dataclasses import dataclass

from legbench.drives.master.bring_up import BringUp
from legbench.drives.master.preparation import take_power
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import (
    Controlword,
    DriveState,
    decode_state,
    describe_statusword,
)
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.setup.config import NodeConfig

LOW_NS = 10_000_000
"""Time for which bit 7 is held low, then high [ns]: a drive with a loop of 4 ms sees the edge."""
PATIENCE_NS = 1_000_000_000
"""Longest wait until a drive has left its fault [ns]."""
WATCH_NS = 200_000_000
"""Time for which a drive must stay out of fault; a cause that is still there ends it [ns]."""
LOOK_NS = 5_000_000
"""Pause between two looks at a statusword [ns]."""
U16 = DataType.UNSIGNED16
FAULTY = (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultReset:
    """How the fault reset of one drive has ended."""

    node: str
    before: str
    """Statusword before, in words."""
    error: str
    """Error code before (603Fh), in words; empty where there was no fault."""
    after: str
    """Statusword afterwards, in words."""
    in_fault: bool
    """Whether the drive is in fault now, as the cause is still there."""


def reset(session: Session, nodes: Sequence[NodeConfig]) -> list[FaultReset]:
    """Give every drive that is in fault one rising edge of the fault reset bit, and look at it.

    A drive refuses the reset while the cause is there (CiA 402-2), and nothing is tried twice: who
    resets again and again drives a motor into what has stopped it. Drives that are found with power
    are stopped first.

    Raises:
        BusError: the channel has a master.
        PlantFault: somebody else leads these drives; nothing has been written since it was heard.
        DriveError: a drive does not answer, is another one, or keeps its power.
    """
    session.hold()
    up = session.bring_up()
    take_power(up)
    return [_reset(session, up, node) for node in nodes]


def _reset(session: Session, up: BringUp, node: NodeConfig) -> FaultReset:
    before, error = _look(up, node), ""
    after = before
    if decode_state(before) in FAULTY:
        error = up.error_text(node)
        after = _edge(session, up, node)
    return FaultReset(
        node=node.name,
        before=describe_statusword(before),
        error=error,
        after=describe_statusword(after),
        in_fault=decode_state(after) in FAULTY,
    )


def _edge(session: Session, up: BringUp, node: NodeConfig) -> int:
    """Send one rising edge of bit 7 and take it back; returns the statusword that has stayed."""
    sdo, timebase = up.sdo(node), session.timebase
    sdo.put(0x6040, 0, U16, Controlword.DISABLE_VOLTAGE)
    timebase.wait_until(timebase.now_ns() + LOW_NS)
    sdo.put(0x6040, 0, U16, Controlword.FAULT_RESET)
    timebase.wait_until(timebase.now_ns() + LOW_NS)
    word = _look(up, node)
    until_ns = timebase.now_ns() + PATIENCE_NS
    while decode_state(word) in FAULTY and timebase.now_ns() < until_ns:
        timebase.wait_until(timebase.now_ns() + LOOK_NS)
        word = _look(up, node)
    sdo.put(0x6040, 0, U16, Controlword.DISABLE_VOLTAGE)
    until_ns = timebase.now_ns() + WATCH_NS
    while decode_state(word) not in FAULTY and timebase.now_ns() < until_ns:
        timebase.wait_until(timebase.now_ns() + LOOK_NS)
        word = _look(up, node)
    return word


def _look(up: BringUp, node: NodeConfig) -> int:
    return up.sdo(node).get_int(0x6041, 0, U16)
