"""Table of the faults that are tried in mid-jump on the emulated leg, with expected results."""

from dataclasses import dataclass

from legbench.drives.emulated.faults import (
    FOREVER_NS,
    Babble,
    Fault,
    FrameFault,
    FrameFaultKind,
    NodeFault,
    NodeFaultKind,
)

STRIKE_NS = 1_000_000_000
"""Time at which a fault strikes, on the bus's clock: half a second into the run, in a jump [ns]."""
BRIEF_NS = 2_000_000
"""A disturbance that the link has to bridge."""
MS = 1_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultTrial:
    """Trial of one fault, and its expected result."""

    name: str
    faults: tuple[Fault, ...] = ()
    cause: str | None = None
    """Cause that has to end the run; None if the run has to bridge the fault."""
    or_cause: str | None = None
    """Cause that may end the run first, where two come in one cycle and the delays of the answers
    decide."""
    gone: bool = False
    """Whether the master itself stops without notice, as by SIGKILL or SIGSTOP."""
    interrupted: bool = False
    """Whether the run is interrupted by ^C."""
    viewer: bool = False
    """Whether the live view of the run is stopped by SIGSTOP."""


def _frame(
    kind: FrameFaultKind, cob_id: int | None, *, until_ns: int = FOREVER_NS, **how: int
) -> Fault:
    end_ns = STRIKE_NS + until_ns
    return FrameFault(kind=kind, cob_id=cob_id, start_ns=STRIKE_NS, end_ns=end_ns, **how)


def _node(kind: NodeFaultKind, node_id: int) -> Fault:
    return NodeFault(kind=kind, node_id=node_id, start_ns=STRIKE_NS)


def _part(kind: NodeFaultKind, node_id: int, size: float = 0.0) -> Fault:
    return NodeFault(kind=kind, node_id=node_id, start_ns=STRIKE_NS, size=size)


def _babble(every_us: int) -> Fault:
    return Babble(
        cob_id=1, start_ns=STRIKE_NS, end_ns=STRIKE_NS + 100 * MS, every_ns=1000 * every_us
    )


_F, _N = FrameFaultKind, NodeFaultKind
LOST, EMERGENCY, FOLLOWING = "process data lost", "drive emergency", "following error"
TRIALS = (
    FaultTrial(name="answers of a drive dropped", faults=(_frame(_F.DROP, 0x181),), cause=LOST),
    FaultTrial(
        name="answers dropped for 2 cycles",
        faults=(_frame(_F.DROP, 0x181, until_ns=BRIEF_NS),),
    ),
    FaultTrial(name="SYNC dropped", faults=(_frame(_F.DROP, 0x080),), cause=LOST),
    FaultTrial(
        name="commands of a drive dropped", faults=(_frame(_F.DROP, 0x202),), cause=EMERGENCY
    ),
    FaultTrial(
        name="master's heartbeat dropped", faults=(_frame(_F.DROP, 0x77E),), cause=EMERGENCY
    ),
    FaultTrial(name="cable pulled", faults=(_frame(_F.DROP, None),), cause=LOST),
    FaultTrial(
        name="answers 0.3 ms late",
        faults=(_frame(_F.DELAY, 0x181, delay_ns=300_000),),
        cause=LOST,
    ),
    FaultTrial(
        name="answers 0.7 ms late",
        faults=(_frame(_F.DELAY, 0x181, delay_ns=700_000),),
        cause=LOST,
    ),
    FaultTrial(
        name="answers 1 ms late",
        faults=(_frame(_F.DELAY, 0x181, delay_ns=1_000_000),),
        cause=LOST,
    ),
    FaultTrial(
        name="answers 2 ms late",
        faults=(_frame(_F.DELAY, 0x182, delay_ns=2_000_000),),
        cause=LOST,
    ),
    FaultTrial(
        name="answers of one cycle 1 ms late",
        faults=(_frame(_F.DELAY, 0x181, until_ns=MS, delay_ns=1_000_000),),
    ),
    FaultTrial(
        name="answers doubled",
        faults=(_frame(_F.DUPLICATE, 0x181, delay_ns=10_000),),
    ),
    FaultTrial(
        name="answers too short",
        faults=(_frame(_F.WRONG_LENGTH, 0x182, length=7),),
        cause=LOST,
    ),
    FaultTrial(
        name="commands too short",
        faults=(_frame(_F.WRONG_LENGTH, 0x202, length=5),),
        cause=EMERGENCY,
    ),
    FaultTrial(name="bits of answers flipped", faults=(_frame(_F.BAD_BITS, 0x181),), cause=LOST),
    FaultTrial(
        name="bits of commands flipped",
        faults=(_frame(_F.BAD_BITS, 0x201),),
        cause="bus off",
        or_cause=EMERGENCY,
    ),
    FaultTrial(name="a node babbles, wire full", faults=(_babble(100),), cause=LOST),
    FaultTrial(name="a node babbles, 1 frame/ms", faults=(_babble(1000),)),
    FaultTrial(name="drive bus-off", faults=(_node(_N.BUS_OFF, 1),), cause=LOST),
    FaultTrial(name="drive restarts", faults=(_node(_N.RESET, 2),), cause=LOST),
    FaultTrial(name="drive unplugged", faults=(_node(_N.SILENT, 2),), cause=LOST),
    FaultTrial(
        name="drive's heartbeat lost",
        faults=(_node(_N.HEARTBEAT_LOSS, 1),),
        cause="heartbeat lost",
    ),
    FaultTrial(name="under-voltage", faults=(_node(_N.UNDER_VOLTAGE, 1),), cause=EMERGENCY),
    FaultTrial(name="over-temperature", faults=(_node(_N.OVER_TEMPERATURE, 2),), cause=EMERGENCY),
    FaultTrial(name="drive warns", faults=(_node(_N.WARNING, 1),)),
    FaultTrial(name="jammed motor", faults=(_part(_N.JAMMED, 1),), cause=FOLLOWING),
    FaultTrial(name="frozen motor encoder", faults=(_part(_N.MOTOR_FROZEN, 2),), cause=FOLLOWING),
    FaultTrial(
        name="motor encoder steps 0.1 rad", faults=(_part(_N.MOTOR_STEP, 1, 0.1),), cause=FOLLOWING
    ),
    FaultTrial(
        name="motor encoder drifts 1 rad/s",
        faults=(_part(_N.MOTOR_DRIFT, 2, 1.0),),
        cause=FOLLOWING,
    ),
    FaultTrial(name="frozen link encoder", faults=(_part(_N.LINK_FROZEN, 1),), cause="sway"),
    FaultTrial(
        name="link encoder steps 0.1 rad",
        faults=(_part(_N.LINK_STEP, 2, 0.1),),
        cause="joint speed",
    ),
    FaultTrial(
        name="link encoder drifts 1 rad/s", faults=(_part(_N.LINK_DRIFT, 1, 1.0),), cause="sway"
    ),
    FaultTrial(name="process data repeated", faults=(_part(_N.REPEATING, 2),), cause="sway"),
    FaultTrial(name="master killed or frozen", gone=True, cause="master gone"),
    FaultTrial(name="^C", interrupted=True),
    FaultTrial(name="the viewer hangs", viewer=True),
)
