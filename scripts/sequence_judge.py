"""What a sequence of faults may lead to, and what it must not; pure."""

from sequence_draw import Interrupt, Sequence, Strike, name_of
from sequence_trial import CONTROLLERS, MS, Seen

from legbench.drives.emulated.faults import (
    Babble,
    FrameFault,
    FrameFaultKind,
    NodeFault,
    NodeFaultKind,
)
from legbench.plant.start import PERIOD
from legbench.verdict import STOP_FAILED

WITHIN_NS = 50 * MS
"""From the beginning of a stop to no power, in a drive that hears its master."""
DEAF_WITHIN_NS = 150 * MS
"""The same in a drive that does not: 100 ms are its watchdogs', 40 ms its quick-stop ramp, the
rest is the master's own time to find what has come."""
UNNOTICED_NS = 6 * MS
"""A run may end complete whose drives have had no power for so long: two lost cycles are bridged,
a third is one too many, and quick-stop ramps take a while."""

_LOSSES = {
    "process data lost",
    "heartbeat lost",
    "drive emergency",
    "drive not enabled",
    "drive left operational",
    "temperature",
    STOP_FAILED,
}
_WIRE = _LOSSES | {"bus off", "command not sent", "command ignored", "following error"}
_MOTOR = {"following error", "moved while enabling", "motor range", "spring torque"}
_LINK = {"sway", "joint encoder", "joint speed", "joint range", "spring torque"}
_K = NodeFaultKind
_CAUSES = {
    _K.RESET: _LOSSES | {"drive reset"},
    _K.HEARTBEAT_LOSS: {"heartbeat lost"},
    _K.UNDER_VOLTAGE: {"drive emergency", "drive not enabled"},
    _K.OVER_TEMPERATURE: {"drive emergency", "drive not enabled", "temperature"},
    _K.BUS_OFF: _LOSSES,
    _K.SILENT: _LOSSES,
    _K.WARNING: set[str](),
    _K.JAMMED: _MOTOR | _LINK | {"drive emergency"},
    _K.MOTOR_FROZEN: _MOTOR,
    _K.MOTOR_STEP: _MOTOR,
    _K.MOTOR_DRIFT: _MOTOR,
    _K.LINK_FROZEN: _LINK,
    _K.LINK_STEP: _LINK,
    _K.LINK_DRIFT: _LINK,
    _K.REPEATING: _MOTOR | _LINK | {"command ignored", STOP_FAILED},
}
"""Causes by which a run may name each fault of a drive."""
_TALK = (None, 0x000, 0x080, 0x201, 0x202)
"""Identifiers without which a drive does not hear of a stop."""


def causes_of(strike: Strike) -> set[str]:
    """Return the causes by which a run may name a strike."""
    match strike:
        case Interrupt():
            return set()
        case NodeFault():
            return _CAUSES[strike.kind]
        case Babble():
            return _WIRE | _MOTOR | _LINK | {"second master", "drive reset"}
        case FrameFault():
            stale = _MOTOR | _LINK if strike.kind is FrameFaultKind.DELAY else set[str]()
            return _WIRE | stale


def _deafens(strike: Strike, since_ns: int, until_ns: int) -> bool:
    """Whether a strike keeps a drive from hearing its master within a time [ns]."""
    if isinstance(strike, Interrupt) or strike.start_ns > until_ns or strike.end_ns < since_ns:
        return False
    match strike:
        case NodeFault():
            return strike.kind in (_K.SILENT, _K.BUS_OFF, _K.RESET)
        case Babble():
            return True
        case FrameFault():
            # Error frames add up until their sender has left the bus, whoever that is.
            return strike.kind is FrameFaultKind.BAD_BITS or strike.cob_id in _TALK


def judge(sequence: Sequence, seen: Seen) -> list[str]:
    """Return what must not be, in words; nothing for a run that is as it should be."""
    return [*seen.violations, *seen.edges, *_power(sequence, seen), *_naming(sequence, seen)]


def _power(sequence: Sequence, seen: Seen) -> list[str]:
    """Drives that have power too long, or too short for a run that says it is complete."""
    bad = []
    if any(seen.powered):
        bad.append(f"power in the end: {seen.powered}")
    if any(seen.left) and seen.status != "fault":
        bad.append(f"power at the end of a run that is {seen.status}")
    stop_ns = seen.stop_ns()
    if stop_ns is not None:
        until_ns = stop_ns + WITHIN_NS
        deaf = any(_deafens(strike, 0, until_ns) for strike in sequence.strikes)
        late_ns = seen.power_ns - stop_ns
        if late_ns > (DEAF_WITHIN_NS if deaf else WITHIN_NS):
            bad.append(f"power {late_ns / MS:.0f} ms after the stop began")
        if (
            seen.status == "complete"
            and min(seen.lost_ns, default=stop_ns) < stop_ns - UNNOTICED_NS
        ):
            bad.append("complete, though a drive had lost its power")
    elif seen.power_ns:
        bad.append("there was power, and no stop")
    return bad


def _naming(sequence: Sequence, seen: Seen) -> list[str]:
    """What is told of the end must be true: its first cause is something that has struck."""
    _, duration = CONTROLLERS[sequence.controller]
    # A stop can fail of what strikes while it lasts; everything else has its cause before it.
    until_ns = seen.ended_ns if seen.cause == STOP_FAILED else seen.stop_ns() or seen.ended_ns
    struck = [strike for strike in sequence.strikes if strike.start_ns <= until_ns]
    names = ", ".join(map(name_of, struck)) or "nothing"
    if seen.status == "complete":
        short = seen.rows != round(duration / PERIOD)
        return [f"complete with {seen.rows} rows"] if short or seen.cause else []
    if seen.status == "interrupted":
        return [] if seen.interrupted else ["interrupted by nobody"]
    if not seen.message or "\n" in seen.message:
        return [f"told in {seen.message!r}"]
    if seen.status == "refused":
        return [] if struck else ["refused for nothing"]
    allowed = set[str]().union(*map(causes_of, struck))
    if seen.cause not in allowed:
        return [f"{names} was called '{seen.cause}': {seen.message}"]
    return []
