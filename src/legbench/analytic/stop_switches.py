"""Joint stops of the compiled leg: which joint is beyond its limit, and whether its stop pushes.

By the law (`analytic.stops`) a stop acts beyond the limit, and only while it would push. The
compiled equations have switches in the place of these two comparisons. Each comparison is an event,
so the switches are constant between events. A switch is set by the law whenever something jumps,
and by its own event otherwise, never by the sign of a number that is zero up to rounding. So no
stop can pull.
"""

import math
from operator import is_
from typing import final

from legbench.analytic.compiled_regime import NUDGE, OFF, CompiledRegime
from legbench.analytic.equations import SCALAR, Ops, Pair, Term, pair_acceleration, pair_share
from legbench.analytic.model import LegModel
from legbench.analytic.parameters import FREE_PUSHES, PUSHES, Event
from legbench.analytic.stops import TIME_CONSTANT, Stop
from legbench.analytic.terms import PairTerms

AT_LIMIT = 1e-12
"""Largest depth that may be rounding; the speed then says whether the stop is touched [rad]."""
FIRST = int(Event.KNEE_LOW)
"""Number of the first of the four events in which a joint meets or leaves a limit."""
KNEE_PUSH, KNEE_FREE = int(Event.KNEE_PUSH), int(Event.KNEE_FREE)
"""Numbers of the events of the knee's stop; those of the hip's come next."""


@final
class StopSwitches:
    """State of the joint stops of one leg, at the lower and upper ends of knee and hip.

    A leg without stops is never touched.

    Attributes:
        touched: whether a joint is beyond a limit.
    """

    def __init__(self, model: LegModel) -> None:
        self._model, self._stops = model, model.stops
        self._touched = [False] * len(model.stops)
        self._pushing, self._free = [False, False], [False, False]
        self._acting: list[Stop | None] = [None, None]
        """Stop that acts on each joint, or none within the limits."""
        self.touched, self._version = False, 0
        self._asked_at: tuple[PairTerms, Pair, Pair, Pair] | None = None
        """Objects for which `_answer` has been computed."""
        self._answer: list[float] = [0.0, 0.0]
        ends = [stop.limit + stop.sign * NUDGE for stop in model.stops]
        self._ends = tuple(ends) or (-math.inf, math.inf) * 2

    def clear(self, knee: float, hip: float) -> bool:
        """Whether no joint at these angles [rad] is at a limit or beyond one."""
        knee_low, knee_high, hip_low, hip_high = self._ends
        return not self.touched and knee_low < knee < knee_high and hip_low < hip < hip_high

    def find(self, q: Pair, v: Pair) -> None:
        """Determine by the law which limits a joint is beyond, for a leg set to a new state."""
        found = []
        for stop in self._stops:
            depth = stop.depth(q)
            found.append(depth > AT_LIMIT or (depth > -AT_LIMIT and stop.speed(v) > 0.0))
        if found != self._touched:
            self._touched = found
            self._changed()

    def lay(self, compiled: CompiledRegime) -> None:
        """Set the four events of the limits: to go beyond each, or to come back from beyond it."""
        if compiled.version == self._version:
            return
        compiled.version = self._version
        for event, (stop, beyond) in enumerate(zip(self._stops, self._touched, strict=True), FIRST):
            gain = stop.sign if beyond else -stop.sign
            if compiled.gain[event] != gain:
                compiled.lay(event, gain, gain * stop.limit)

    def cross(self, event: int) -> None:
        """Note that a joint has gone beyond a limit, or has come back."""
        self._touched[event - FIRST] ^= True
        self._changed()

    def _changed(self) -> None:
        self._acting = [None, None]
        for index, (stop, beyond) in enumerate(zip(self._stops, self._touched, strict=True)):
            if beyond:
                self._acting[index // 2] = stop
        self.touched = True in self._touched
        self._version += 1
        self._asked_at = None

    def decide(
        self, compiled: CompiledRegime, terms: PairTerms, motor: Pair, q: Pair, v: Pair
    ) -> None:
        """Set the switches of the pushes by the law, after something has jumped."""
        if not self.touched:
            if compiled.pushed:
                self._silence(compiled)
            return
        compiled.pushed = True
        asked = self._asked(terms, motor, q, v)
        self._pushing = [push > 0.0 for push in asked]
        if compiled.held:
            asked = self._asked(self._model.falling, motor, q, v)
            self._free = [push > 0.0 for push in asked]
        self._switch(compiled)

    def flip(self, compiled: CompiledRegime, event: int) -> None:
        """Note that a stop begins or ends to push, or would if the foot were released."""
        if event >= KNEE_FREE:
            self._free[event - KNEE_FREE] ^= True
        else:
            self._pushing[event - KNEE_PUSH] ^= True
        self._switch(compiled)

    def guard(
        self, compiled: CompiledRegime, terms: PairTerms, motor: Pair, q: Pair, v: Pair
    ) -> None:
        """Set and guard the events of the pushes, for the joints that are beyond a limit."""
        found = [(KNEE_PUSH, terms, self._pushing)]
        if compiled.held:
            found.append((KNEE_FREE, self._model.falling, self._free))
        for first, inertia, pushing in found:
            asked = self._asked(inertia, motor, q, v)
            for joint in (0, 1):
                stop, event = self._acting[joint], first + joint
                if stop is None:
                    if compiled.gain[event] != 0.0:
                        compiled.lay(event, *OFF)
                    continue
                gain = -stop.sign if pushing[joint] else stop.sign
                if compiled.gain[event] != gain:
                    compiled.lay(event, gain, 0.0)
                compiled.guard(event, stop.sign * asked[joint])

    def _silence(self, compiled: CompiledRegime) -> None:
        """Switch all pushes and their events off, as no joint is beyond a limit."""
        compiled.pushed = False
        compiled.slots[PUSHES] = compiled.slots[PUSHES + 2] = 0.0
        for event in (KNEE_PUSH, KNEE_PUSH + 1):
            compiled.lay(event, *OFF)
        if compiled.held:
            compiled.slots[FREE_PUSHES] = compiled.slots[FREE_PUSHES + 1] = 0.0
            for event in (KNEE_FREE, KNEE_FREE + 1):
                compiled.lay(event, *OFF)

    def _switch(self, compiled: CompiledRegime) -> None:
        for joint in (0, 1):
            stop = self._acting[joint]
            place = PUSHES + 2 * joint
            compiled.slots[place] = float(stop is not None and self._pushing[joint])
            compiled.slots[place + 1] = 0.0 if stop is None else stop.limit
            if compiled.held:
                compiled.slots[FREE_PUSHES + joint] = float(stop is not None and self._free[joint])

    def turns(
        self, ops: Ops, terms: PairTerms, torque: Pair, q: Pair, v: Pair, *, free: bool = False
    ) -> tuple[list[Term], Pair]:
        """Readings of the events of each joint's stop, and the accelerations of the angles.

        The stops act that are switched on; if `free`, those switched on for the leg in the air.
        A reading is the acceleration by which the law turns the joint back, times the square of
        the stop's time constant [rad]. Accelerations are in rad/s^2.
        """
        return self._turns(ops, terms, torque, q, v, self._free if free else self._pushing)

    def released(self, terms: PairTerms, torque: Pair, q: Pair, v: Pair) -> Pair:
        """Accelerations of the angles where every touched stop acts that would push [rad/s^2]."""
        return self._turns(SCALAR, terms, torque, q, v, None)[1]

    def _asked(self, terms: PairTerms, motor: Pair, q: Pair, v: Pair) -> list[float]:
        """Readings of the events of each joint's stop where every stop acts that would push."""
        at = (terms, motor, q, v)
        if self._asked_at is None or not all(map(is_, at, self._asked_at)):
            torque = self._model.torque(motor, q, v)
            self._asked_at, self._answer = at, self._turns(SCALAR, terms, torque, q, v, None)[0]
        return self._answer

    def _turns(
        self,
        ops: Ops,
        terms: PairTerms,
        torque: Pair,
        q: Pair,
        v: Pair,
        pushing: list[bool] | None,
    ) -> tuple[list[Term], Pair]:
        a = pair_acceleration(ops, terms, q, v, torque)
        found: list[Term] = [0.0, 0.0]
        for joint in (0, 1):
            stop = self._acting[joint]
            if stop is None:
                continue
            turn = stop.turn(q, v, a)
            found[joint] = TIME_CONSTANT**2 * turn
            if pushing[joint] if pushing is not None else turn > 0.0:
                share = pair_share(ops, terms, q, stop.normal)
                a = a[0] + share[0] * turn, a[1] + share[1] * turn
        return found, a

    def sign(self, joint: int) -> float:
        """Direction in which a joint's stop pushes: 1 at the lower limit, -1 at the upper, or 0."""
        stop = self._acting[joint]
        return 0.0 if stop is None else stop.sign
