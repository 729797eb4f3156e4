"""Joint stops of the compiled leg: which joint is beyond its limit, and whether its stop pushes.

By the law (`analytic.stops`) a stop acts beyond the limit, and only while it would push. The
compiled equations have switches in the place of these two comparisons. Each comparison is an event,
so the switches are constant between events. A switch is set by the law whenever something jumps,
and by its own event otherwise, never by the sign of a number that is zero up to rounding. So no
stop can pull.
"""

import math
from typing import final

from legbench.analytic.compiled_regime import NUDGE, OFF, CompiledRegime
from legbench.analytic.equations import SCALAR, Ops, Pair, Term, pair_acceleration, pair_share
from legbench.analytic.float_leg import FloatLeg
from legbench.analytic.model import LegModel
from legbench.analytic.parameters import FREE_PUSHES, PUSHES, Event
from legbench.analytic.stops import SQUARE, Stop
from legbench.analytic.terms import PairTerms

AT_LIMIT = 1e-12
"""Largest depth that may be rounding; the speed then says whether the stop is touched [rad]."""
FIRST = int(Event.KNEE_LOW)
"""Number of the first of the four events in which a joint meets or leaves a limit."""
KNEE_PUSH, KNEE_FREE = int(Event.KNEE_PUSH), int(Event.KNEE_FREE)
"""Numbers of the events of the knee's stop; those of the hip's come next."""

Acting = tuple[int, Stop]
"""Joint that is beyond a limit, 0 for the knee and 1 for the hip, and the stop that acts on it."""
Bounds = tuple[float, float, float, float]


@final
class StopSwitches:
    """State of the joint stops of one leg, at the lower and upper ends of knee and hip.

    A leg without stops is never touched.

    Attributes:
        touched: whether a joint is beyond a limit.
        beyond: the limits that joints are beyond, as bits.
        clear: angles of knee and hip between which no event of a limit is near: lowest and highest
            of the knee, then of the hip [rad].
    """

    __slots__ = (
        "_acting",
        "_answer",
        "_floats",
        "_free",
        "_joints",
        "_model",
        "_pushing",
        "_range",
        "_sets",
        "_stops",
        "beyond",
        "clear",
        "touched",
    )

    def __init__(self, model: LegModel, floats: FloatLeg) -> None:
        self._model, self._stops, self._floats = model, model.stops, floats
        self._pushing, self._free = [False, False], [False, False]
        self._sets = tuple(self._set_of(beyond) for beyond in range(1 << len(model.stops)))
        self._answer: tuple[float, float] | None = None
        """Readings on which the last decision was made, until they have been guarded."""
        self._change(0)
        (low, high, back, front), margin = self.clear, 2.0 * AT_LIMIT
        self._range = (low + margin, high - margin, back + margin, front - margin)

    def _set_of(self, beyond: int) -> tuple[tuple[Acting, ...], list[Stop | None], Bounds]:
        """Joints at work, and angles that are clear, while some limits are exceeded."""
        acting: list[Stop | None] = [None, None]
        bounds = [-math.inf, math.inf, -math.inf, math.inf]
        for index, stop in enumerate(self._stops):
            exceeded = beyond >> index & 1
            if exceeded:
                acting[index // 2] = stop
            # A lower end bounds a joint from below, and one that is exceeded from above. Either way
            # a joint that has just crossed is clear, since levels are lower for falling.
            place = index ^ exceeded
            pick = min if place % 2 else max
            bounds[place] = pick(bounds[place], stop.limit - NUDGE)
        low, high, back, front = bounds
        joints = tuple((joint, stop) for joint, stop in enumerate(acting) if stop is not None)
        return joints, acting, (low, high, back, front)

    def find(self, q: Pair, v: Pair) -> None:
        """Determine by the law which limits a joint is beyond, for a leg set to a new state."""
        low, high, back, front = self._range
        beyond = 0
        if not (low < q[1] - q[0] < high and back < q[0] < front):
            for index, stop in enumerate(self._stops):
                depth = stop.depth(q)
                if depth > AT_LIMIT or (depth > -AT_LIMIT and stop.speed(v) > 0.0):
                    beyond |= 1 << index
        if beyond != self.beyond:
            self._change(beyond)

    def lay(self, compiled: CompiledRegime) -> None:
        """Set the four events of the limits: to go beyond each, or to come back from beyond it."""
        compiled.beyond = self.beyond
        for index in range(len(self._stops)):
            self._lay_limit(compiled, index)

    def _lay_limit(self, compiled: CompiledRegime, index: int) -> None:
        stop = self._stops[index]
        gain = stop.sign if self.beyond >> index & 1 else -stop.sign
        compiled.lay(FIRST + index, gain, gain * stop.limit)

    def cross(self, compiled: CompiledRegime, event: int) -> None:
        """Note that a joint has gone beyond a limit, or has come back, and watch the way back."""
        index = event - FIRST
        self._change(self.beyond ^ 1 << index)
        self._lay_limit(compiled, index)
        compiled.beyond = self.beyond

    def _change(self, beyond: int) -> None:
        """Set which limits a joint is beyond."""
        self._joints, self._acting, self.clear = self._sets[beyond]
        self.beyond, self.touched = beyond, beyond != 0

    def decide(self, compiled: CompiledRegime, motor: Pair, q: Pair, v: Pair) -> None:
        """Set the switches of the pushes by the law, after something has jumped."""
        if self.touched:
            self._answer = knee, hip = self._ask(compiled.terms, motor, q, v)
            self._pushing = [knee > 0.0, hip > 0.0]
            if compiled.held:
                knee, hip = self._ask(self._model.falling, motor, q, v)
                self._free = [knee > 0.0, hip > 0.0]
        if compiled.pushed & ~self.beyond:
            self._silence(compiled)
        compiled.pushed = self.beyond
        self._switch(compiled)

    def flip(self, compiled: CompiledRegime, event: int) -> None:
        """Note that a stop begins or ends to push, or would if the foot were released."""
        if event >= KNEE_FREE:
            self._free[event - KNEE_FREE] ^= True
        else:
            self._pushing[event - KNEE_PUSH] ^= True
        self._switch(compiled)

    def guard(self, compiled: CompiledRegime, motor: Pair, q: Pair, v: Pair) -> None:
        """Guard the events of the pushes, for the joints that are beyond a limit."""
        asked = self._answer or self._ask(compiled.terms, motor, q, v)
        self._answer = None
        for joint, stop in self._joints:
            compiled.guard(KNEE_PUSH + joint, stop.sign * asked[joint])
        if compiled.held:
            asked = self._ask(self._model.falling, motor, q, v)
            for joint, stop in self._joints:
                compiled.guard(KNEE_FREE + joint, stop.sign * asked[joint])

    def _silence(self, compiled: CompiledRegime) -> None:
        """Switch off the pushes, and their events, of joints that are within their limits."""
        for joint, stop in enumerate(self._acting):
            if stop is None and compiled.gain[KNEE_PUSH + joint] != 0.0:
                compiled.slots[PUSHES + 2 * joint] = 0.0
                compiled.lay(KNEE_PUSH + joint, *OFF)
                if compiled.held:
                    compiled.slots[FREE_PUSHES + joint] = 0.0
                    compiled.lay(KNEE_FREE + joint, *OFF)

    def _switch(self, compiled: CompiledRegime) -> None:
        """Set the switches of joints beyond a limit, and the events in which they change."""
        slots = compiled.slots
        for joint, stop in self._joints:
            pushes, place = self._pushing[joint], PUSHES + 2 * joint
            slots[place], slots[place + 1] = 1.0 if pushes else 0.0, stop.limit
            gain = -stop.sign if pushes else stop.sign
            if compiled.gain[KNEE_PUSH + joint] != gain:
                compiled.lay(KNEE_PUSH + joint, gain, 0.0)
            if compiled.held:
                pushes = self._free[joint]
                slots[FREE_PUSHES + joint] = 1.0 if pushes else 0.0
                compiled.lay(KNEE_FREE + joint, -stop.sign if pushes else stop.sign, 0.0)

    def turns(
        self, ops: Ops, terms: PairTerms, torque: Pair, q: Pair, v: Pair, *, free: bool = False
    ) -> tuple[list[Term], Pair]:
        """Readings of the events of each joint's stop, and the accelerations of the angles.

        The stops act that are switched on; if `free`, those switched on for the leg in the air.
        A reading is the acceleration by which the law turns the joint back, times the square of
        the stop's time constant [rad]. Accelerations are in rad/s^2.
        """
        return self._turns(ops, terms, torque, q, v, self._free if free else self._pushing)

    def accelerations(self, terms: PairTerms, motor: Pair, q: Pair, v: Pair) -> Pair:
        """Accelerations of the angles, with the stops that are switched on [rad/s^2]."""
        if not self.touched:
            return self._floats.accelerations(terms, motor, q, v)
        return self.turns(SCALAR, terms, self._floats.torque(motor, q, v), q, v)[1]

    def released(self, terms: PairTerms, torque: Pair, q: Pair, v: Pair) -> Pair:
        """Accelerations of the angles where every touched stop acts that would push [rad/s^2]."""
        return self._turns(SCALAR, terms, torque, q, v, None)[1]

    def _ask(self, terms: PairTerms, motor: Pair, q: Pair, v: Pair) -> tuple[float, float]:
        """Readings of the events of each joint's stop where every stop acts that would push."""
        knee, hip = self._acting
        if knee is not None and hip is not None:
            torque = self._floats.torque(motor, q, v)
            first, second = self._turns(SCALAR, terms, torque, q, v, None)[0]
            return first, second
        a = self._floats.accelerations(terms, motor, q, v)
        if knee is not None:
            return SQUARE * knee.turn(q, v, a), 0.0
        return 0.0, SQUARE * hip.turn(q, v, a) if hip is not None else 0.0

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
            found[joint] = SQUARE * turn
            if pushing[joint] if pushing is not None else turn > 0.0:
                share = pair_share(ops, terms, q, stop.normal)
                a = a[0] + share[0] * turn, a[1] + share[1] * turn
        return found, a

    def sign(self, joint: int) -> float:
        """Direction in which a joint's stop pushes: 1 at the lower limit, -1 at the upper, or 0."""
        stop = self._acting[joint]
        return 0.0 if stop is None else stop.sign
