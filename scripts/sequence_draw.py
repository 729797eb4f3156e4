"""Random sequences of one to three faults in one run on the emulated leg; pure."""

import random
from dataclasses import dataclass
from typing import final

from legbench.drives.emulated.faults import (
    FOREVER_NS,
    Babble,
    Fault,
    FrameFault,
    FrameFaultKind,
    NodeFault,
    NodeFaultKind,
)

MS = 1_000_000
NODES = (1, 2)
"""Drives of the bench's bus file, whose master is 126."""
COB_IDS = {
    "NMT": (0x000,),
    "SYNC": (0x080,),
    "EMCY": (0x081, 0x082),
    "TPDO": (0x181, 0x182),
    "RPDO": (0x201, 0x202),
    "SDO answer": (0x581, 0x582),
    "SDO request": (0x601, 0x602),
    "heartbeat": (0x701, 0x702, 0x77E),
    "all": (None,),
}
"""Identifiers on the wire by what they carry; each kind of frame is hit as often as another."""
SHOUTED = (0x001, 0x07F, 0x100, 0x300, 0x500, 0x7FF, 0x080, 0x181, 0x182, 0x201, 0x202, 0x702)
"""What a babbling node sends: strange identifiers, and those of others."""
STEPS, DRIFTS = (0.005, 0.5), (0.1, 5.0)
"""Sizes of an encoder's step [rad] and drift [rad/s], of either sign."""
TOGETHER = 0.6
"""Share of further faults that strike near the first one, so also while the drives stop [-]."""
AFTER_MS = (0.0, 2.2)
"""Decimal logarithms of the shortest and the longest time from a fault to one near it [ms]: it is
found after some milliseconds, the stop takes 50 ms at most."""
PHASES = ("open", "start", "run", "rest", "stop")
"""The bus is opened and drives are configured; they are enabled and go to the start posture; the
run; the way to rest; the stop, which faults bring at other times, too."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Interrupt:
    """^C from a moment on: the next call of the bus or its clock is interrupted."""

    start_ns: int


Strike = Fault | Interrupt
"""Whatever may come."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sequence:
    """One run and what strikes it.

    Attributes:
        number: of the sequence in its series.
        controller: kind of the controller.
        rests: whether the run ends with its way to rest, or with a stop at once.
        strikes: in the order in which they begin, on the time of the bus.
    """

    number: int
    controller: str
    rests: bool
    strikes: tuple[Strike, ...]


Schedule = dict[str, tuple[int, int]]
"""When each phase of a run without faults begins and ends [ns]."""


def name_of(strike: Strike) -> str:
    """Return the kind of a strike, as in the table."""
    match strike:
        case Interrupt():
            return "^C"
        case Babble():
            return "babbling node"
        case FrameFault():
            return f"frames {strike.kind.value}"
        case NodeFault():
            return strike.kind.value


def describe(sequence: Sequence) -> str:
    """A sequence in words, to find it again."""
    end = "rest" if sequence.rests else "stop"
    strikes = "; ".join(_words(strike) for strike in sequence.strikes)
    return f"sequence {sequence.number}, {sequence.controller}, end {end}: {strikes}"


def _words(strike: Strike) -> str:
    at = f"{name_of(strike)} at {strike.start_ns / MS:.1f} ms"
    if isinstance(strike, Interrupt):
        return at
    if strike.end_ns < FOREVER_NS:
        at += f" for {(strike.end_ns - strike.start_ns) / MS:.1f} ms"
    if isinstance(strike, NodeFault):
        return f"{at}, node {strike.node_id}, size {strike.size:.3g}"
    cob_id = "all" if strike.cob_id is None else f"{strike.cob_id:03X}h"
    if isinstance(strike, Babble):
        return f"{at}, {cob_id} every {strike.every_ns / MS:.2f} ms"
    return f"{at}, {cob_id}, delay {strike.delay_ns / MS:.2f} ms, length {strike.length}"


def draw(number: int, seed: int, schedules: dict[tuple[str, bool], Schedule]) -> Sequence:
    """Draw a sequence; the same number and seed give the same one.

    Args:
        number: of the sequence.
        seed: of the series.
        schedules: of healthy runs, by controller and by whether they end at rest.
    """
    artist = _Artist(random.Random(f"{seed}/{number}"))
    controller, rests = artist.chance.choice(sorted(schedules))
    schedule = schedules[controller, rests]
    first = artist.strike(artist.moment(schedule))
    strikes = [first]
    for _ in range(artist.chance.randrange(3)):
        near = artist.chance.random() < TOGETHER
        at_ns = first.start_ns + round(MS * 10 ** artist.chance.uniform(*AFTER_MS))
        strikes.append(artist.strike(at_ns if near else artist.moment(schedule)))
    ordered = tuple(sorted(strikes, key=lambda strike: strike.start_ns))
    return Sequence(number=number, controller=controller, rests=rests, strikes=ordered)


@final
class _Artist:
    """Draws single strikes from a stream of random numbers."""

    def __init__(self, chance: random.Random) -> None:
        self.chance = chance

    def moment(self, schedule: Schedule) -> int:
        """Draw a moment: every phase is as likely as another [ns]."""
        phase = self.chance.choice([name for name in PHASES if name in schedule])
        return self.chance.randrange(*schedule[phase])

    def strike(self, at_ns: int) -> Strike:
        """Draw something that begins then [ns]."""
        what = self.chance.choices(("frame", "node", "babble", "interrupt"), (10, 16, 2, 2))[0]
        if what == "frame":
            return self._frame(at_ns)
        if what == "node":
            return self._node(at_ns)
        return self._babble(at_ns) if what == "babble" else Interrupt(start_ns=at_ns)

    def _end(self, at_ns: int) -> int:
        """Draw when something is over: soon, some time later, or never [ns]."""
        span_ms = self.chance.choice((self.chance.uniform(0.5, 5), self.chance.uniform(5, 150), 0))
        return at_ns + round(span_ms * MS) if span_ms else FOREVER_NS

    def _frame(self, at_ns: int) -> FrameFault:
        return FrameFault(
            kind=self.chance.choice(list(FrameFaultKind)),
            cob_id=self.chance.choice(COB_IDS[self.chance.choice(list(COB_IDS))]),
            start_ns=at_ns,
            end_ns=self._end(at_ns),
            delay_ns=round(10 ** self.chance.uniform(4.0, 6.7)),
            length=self.chance.randrange(9),
        )

    def _node(self, at_ns: int) -> NodeFault:
        kind = self.chance.choice(list(NodeFaultKind))
        size = 0.0
        if kind in (NodeFaultKind.MOTOR_STEP, NodeFaultKind.LINK_STEP):
            size = self.chance.uniform(*STEPS) * self.chance.choice((-1, 1))
        elif kind in (NodeFaultKind.MOTOR_DRIFT, NodeFaultKind.LINK_DRIFT):
            size = self.chance.uniform(*DRIFTS) * self.chance.choice((-1, 1))
        node_id, end_ns = self.chance.choice(NODES), self._end(at_ns)
        return NodeFault(kind=kind, node_id=node_id, start_ns=at_ns, end_ns=end_ns, size=size)

    def _babble(self, at_ns: int) -> Babble:
        return Babble(
            cob_id=self.chance.choice(SHOUTED),
            start_ns=at_ns,
            end_ns=at_ns + round(self.chance.uniform(1, 150) * MS),
            every_ns=round(10 ** self.chance.uniform(4.7, 6.3)),
        )
