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
from legbench.analytic.stops import TIME_CONSTANT, Stop
from legbench.analytic.terms import PairTerms

AT_LIMIT = 1e-12
"""Largest depth that may be rounding; the speed then says whether the stop is touched [rad]."""
FIRST = int(Event.KNEE_LOW)
"""Number of the first of the four events in which a joint meets or leaves a limit."""
KNEE_PUSH, KNEE_FREE = int(Event.KNEE_PUSH), int(Event.KNEE_FREE)
"""Numbers of the events of the knee's stop; those of the hip's come next."""
SQUARE = TIME_CONSTANT**2
"""Factor of a stop's acceleration in its reading [s^2]."""

NOTHING = (None, None, None, None)
"""Objects for which no answer has been computed."""
Bounds = tuple[float, float, float, float]


@final
class StopSwitches:
    """State of the joint stops of one leg, at the lower and upper ends of knee and hip.

    A leg without stops is never touched.

    Attributes:
        touched: whether a joint is beyond a limit.
        clear: angles of knee and hip between which no event of a limit is near: lowest and highest
            of the knee, then of the hip [rad].
    """

    __slots__ = (
        "_acting",
        "_answer",
        "_asked_at",
        "_beyond",
        "_floats",
        "_free",
        "_known",
        "_model",
        "_pushing",
        "_range",
        "_stops",
        "clear",
        "touched",
    )

    def __init__(self, model: LegModel, floats: FloatLeg) -> None:
        self._model, self._stops, self._floats = model, model.stops, floats
        self._pushing, self._free = [False, False], [False, False]
        self._known: dict[tuple[bool, ...], tuple[list[Stop | None], Bounds]] = {}
        self._asked_at: tuple[PairTerms, Pair, Pair, Pair] | tuple[None, ...] = NOTHING
        """Objects for which `_answer` has been computed."""
        self._answer: list[float] = [0.0, 0.0]
        within = (False,) * len(model.stops)
        self._change(within)
        low, high, back, front = self.clear
        margin = 2.0 * AT_LIMIT
        self._range = (low + margin, high - margin, back + margin, front - margin)

    def find(self, q: Pair, v: Pair) -> None:
        """Determine by the law which limits a joint is beyond, for a leg set to a new state."""
        low, high, back, front = self._range
        if low < q[1] - q[0] < high and back < q[0] < front:
            if self.touched:
                self._change((False,) * len(self._stops))
            return
        found = []
        for stop in self._stops:
            depth = stop.depth(q)
            found.append(depth > AT_LIMIT or (depth > -AT_LIMIT and stop.speed(v) > 0.0))
        self._change(tuple(found))

    def lay(self, compiled: CompiledRegime) -> None:
        """Set the four events of the limits: to go beyond each, or to come back from beyond it."""
        if compiled.beyond != self._beyond:
            compiled.beyond = self._beyond
            for event in range(FIRST, FIRST + len(self._stops)):
                self._lay_limit(compiled, event)

    def _lay_limit(self, compiled: CompiledRegime, event: int) -> None:
        stop = self._stops[event - FIRST]
        gain = stop.sign if self._beyond[event - FIRST] else -stop.sign
        compiled.lay(event, gain, gain * stop.limit)

    def cross(self, compiled: CompiledRegime, event: int) -> None:
        """Note that a joint has gone beyond a limit, or has come back, and watch the way back."""
        beyond = list(self._beyond)
        beyond[event - FIRST] ^= True
        self._change(tuple(beyond))
        self._lay_limit(compiled, event)
        compiled.beyond = self._beyond

    def _change(self, beyond: tuple[bool, ...]) -> None:
        """Set which limits a joint is beyond."""
        if beyond not in self._known:
            self._known[beyond] = self._within(beyond)
        self._acting, self.clear = self._known[beyond]
        self._beyond, self.touched, self._asked_at = beyond, True in beyond, NOTHING

    def _within(self, touched: tuple[bool, ...]) -> tuple[list[Stop | None], Bounds]:
        """Stop that acts on each joint, and the angles at which no limit is near."""
        acting: list[Stop | None] = [None, None]
        bounds = [-math.inf, math.inf, -math.inf, math.inf]
        for index, (stop, beyond) in enumerate(zip(self._stops, touched, strict=True)):
            if beyond:
                acting[index // 2] = stop
            # A lower end bounds a joint from below, and one that is beyond it from above. Either way
            # a joint that has just crossed is clear, since levels are lower for falling.
            place = index ^ beyond
            pick = min if place % 2 else max
            bounds[place] = pick(bounds[place], stop.limit - NUDGE)
        low, high, back, front = bounds
        return acting, (low, high, back, front)

    def decide(
        self, compiled: CompiledRegime, terms: PairTerms, motor: Pair, q: Pair, v: Pair
    ) -> None:
        """Set the switches of the pushes by the law, after something has jumped."""
        if self.touched:
            knee, hip = self._asked(terms, motor, q, v)
            self._pushing = [knee > 0.0, hip > 0.0]
            if compiled.held:
                knee, hip = self._asked(self._model.falling, motor, q, v)
                self._free = [knee > 0.0, hip > 0.0]
        compiled.pushed = self.touched
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
        """Guard the events of the pushes, for the joints that are beyond a limit."""
        asked = self._asked(terms, motor, q, v)
        for joint, stop in enumerate(self._acting):
            if stop is not None:
                compiled.guard(KNEE_PUSH + joint, stop.sign * asked[joint])
        if compiled.held:
            asked = self._asked(self._model.falling, motor, q, v)
            for joint, stop in enumerate(self._acting):
                if stop is not None:
                    compiled.guard(KNEE_FREE + joint, stop.sign * asked[joint])

    def _switch(self, compiled: CompiledRegime) -> None:
        """Set the switches in the equations, and the events in which they change."""
        slots = compiled.slots
        for joint, stop in enumerate(self._acting):
            event, place = KNEE_PUSH + joint, PUSHES + 2 * joint
            if stop is None:
                if compiled.gain[event] != 0.0:
                    slots[place] = 0.0
                    compiled.lay(event, *OFF)
            elif self._pushing[joint]:
                slots[place], slots[place + 1] = 1.0, stop.limit
                compiled.lay(event, -stop.sign, 0.0)
            else:
                slots[place], slots[place + 1] = 0.0, stop.limit
                compiled.lay(event, stop.sign, 0.0)
            if compiled.held:
                self._switch_free(compiled, joint, stop)

    def _switch_free(self, compiled: CompiledRegime, joint: int, stop: Stop | None) -> None:
        """Set the switch and the event of a stop on the foot as if it were released."""
        pushes, event = self._free[joint], KNEE_FREE + joint
        compiled.slots[FREE_PUSHES + joint] = float(stop is not None and pushes)
        if stop is None:
            compiled.lay(event, *OFF)
        else:
            compiled.lay(event, -stop.sign if pushes else stop.sign, 0.0)

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

    def _asked(self, terms: PairTerms, motor: Pair, q: Pair, v: Pair) -> list[float]:
        """Readings of the events of each joint's stop where every stop acts that would push."""
        inertia, held, angles, rates = self._asked_at
        if q is not angles or v is not rates or motor is not held or terms is not inertia:
            self._asked_at, self._answer = (terms, motor, q, v), self._ask(terms, motor, q, v)
        return self._answer

    def _ask(self, terms: PairTerms, motor: Pair, q: Pair, v: Pair) -> list[float]:
        knee, hip = self._acting
        if knee is not None and hip is not None:
            return self._turns(SCALAR, terms, self._floats.torque(motor, q, v), q, v, None)[0]
        a = self._floats.accelerations(terms, motor, q, v)
        if knee is not None:
            return [SQUARE * knee.turn(q, v, a), 0.0]
        return [0.0, SQUARE * hip.turn(q, v, a) if hip is not None else 0.0]

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
