"""Integration of one compiled leg from event to event, each in its order and once.

    course = Course(model, probe=(-0.7, 0.7))
    course.fly(q, v, centre, velocity)
    course.hold(motor)
    what = course.go(until, Levels(upper=0.5))   # Watched, or None at `until`
    if what is Watched.CONTACT:
        course.switch()

A piece runs from one event to the next. A condition that holds already when a piece begins, because
something has jumped, is an event at that instant. On a model of dual numbers (`ops=DUAL`) time,
angles and rates are dual: the variational equations then follow piece by piece (`variation`).
"""

from typing import final

from legbench.analytic._heyoka import heyoka as hy
from legbench.analytic.compiled import TOLERANCE
from legbench.analytic.compiled_regime import (
    CONTACT,
    FELL_BACK,
    NEVER,
    RECOVER,
    SILENT,
    TURN,
    CompiledRegime,
    Levels,
)
from legbench.analytic.contact import MIN_PHASE
from legbench.analytic.contact_watch import ContactWatch
from legbench.analytic.dual import DUAL, floats
from legbench.analytic.equations import Pair, sweep_height, sweep_motion, touchdown
from legbench.analytic.event_detector import HIP_HIGH, SEEN, EventDetector
from legbench.analytic.model import LegModel
from legbench.analytic.moving_leg import MovingLeg
from legbench.analytic.parameters import HEIGHT, MOTOR, SPEED, Event, Watched
from legbench.analytic.state import Regime
from legbench.analytic.variation import Variation
from legbench.errors import PlantFault

EVENT_BUDGET = range(10_000)
"""Events that one integration may pass at most."""
MAX_STEPS = 100_000
"""Largest number of steps of one integration [-]; a leg takes about a hundred a second, a diverging
one any number."""
TIME_LIMIT = int(hy.taylor_outcome.time_limit)
EVENTS = len(Event)
"""Number of events that an integrator may watch [-]."""
TOUCHED, FLIGHT, STANCE = Watched.CONTACT, Regime.FLIGHT, Regime.STANCE


@final
class Course(MovingLeg):
    """Leg that is integrated through its regimes.

    Attributes:
        contact: the watch over touchdown and lift-off.
        detector: the events that are watched.
    """

    __slots__ = (
        "_air",
        "_min_phase",
        "_regimes",
        "_tolerance",
        "_variation",
        "contact",
        "detector",
    )

    def __init__(
        self,
        model: LegModel,
        *,
        probe: Pair | None = None,
        tolerance: float = TOLERANCE,
        min_phase: float = MIN_PHASE,
    ) -> None:
        super().__init__(model, probe)
        self._tolerance, self._min_phase = tolerance, min_phase
        self._regimes: dict[tuple[Regime, bool], CompiledRegime] = {}
        self._air: CompiledRegime | None = None
        self._variation = Variation(tolerance) if model.ops is DUAL else None
        self.contact = ContactWatch(self, min_phase)
        self.detector = EventDetector(self, self.contact)

    def begin(self, regime: Regime, q: Pair, v: Pair, point: Pair, drift: Pair) -> None:
        """Set angles and rates, and the steady point with its velocity, at the present `time`."""
        self._put(self._compiled_for(regime), q, v, point, drift, NEVER)

    def fly(self, q: Pair, v: Pair, centre: Pair, velocity: Pair, lean: float = NEVER) -> None:
        """Begin a flight at time zero, from the place and velocity of the centre of mass.

        `lean` is the largest |q1 + q2|, twice the polar angle, of a leg that has not fallen [rad].
        """
        self.time, self.since = 0.0, -self._min_phase
        air = self._air = self._air or self._compiled_for(FLIGHT)
        self._put(air, q, v, centre, velocity, lean)

    def apex_time(self) -> float:
        """Time at which the centre of mass is highest in this flight [s]."""
        return self.began + self.drift[1] / self.model.floating.gravity

    def foot_height(self, q: Pair) -> float:
        """Height of the foot tip over the centre of mass [m]."""
        return sweep_height(self.model.ops, q, self.arm)

    def hold(self, motor: Pair) -> None:
        """Set the motor positions, which are held until the next call [rad]."""
        if motor != self.motor:
            self.motor = self.plain_motor = motor
            if self._variation is not None:
                self.plain_motor = floats(motor)
            slots = self.compiled.slots
            slots[MOTOR], slots[MOTOR + 1] = self.plain_motor
            if self.stop_switches.touched:
                self._decide()

    def switch(self) -> None:
        """Apply a touchdown or lift-off: change the regime, and the rates by eq. (12)."""
        ops, model, compiled = self.model.ops, self.model, self.compiled
        arm, arm_vel = sweep_motion(ops, self.q, self.v, self.arm)
        if compiled.flies:
            (x, _), (dx, dz), elapsed = self.point, self.drift, self.time - self.began
            # The height is zero by definition, also if the foot went below it while unwatched.
            self.point, self.drift = (x + dx * elapsed + arm[0], 0.0), (0.0, 0.0)
            foot_vel = dx + arm_vel[0], dz - model.floating.gravity * elapsed + arm_vel[1]
            self.v, lost = touchdown(ops, model.stance, model.floating, self.q, self.v, foot_vel)
            self.lost += lost
            self.plain_v = self.v if self._variation is None else floats(self.v)
        else:
            self.point = self.point[0] - arm[0], self.point[1] - arm[1]
            self.drift = -arm_vel[0], -arm_vel[1]
        self.since = self.time
        if compiled.opposite is None:
            compiled.opposite = self._compiled_for(STANCE if compiled.flies else FLIGHT)
        self.contact.enter(self.since)
        self._load(compiled.opposite)

    def go(self, until: float, levels: Levels = SILENT) -> Watched | None:
        """Integrate to `until`, or to the first watched event, which is not yet applied.

        Raises:
            PlantFault: the integration failed.
        """
        self.told = None
        detector, contact = self.detector, self.contact
        if levels is not detector.levels:
            detector.lay(levels)
        for _ in EVENT_BUDGET:
            event = detector.due()
            if event is None:
                end = contact.earliest if contact.masked and contact.earliest < until else until
                if end > self.time:
                    event = self._piece(end)
            if event is None:
                if self.time >= until:
                    return None
            elif event <= FELL_BACK:
                if event == TURN:
                    detector.turned()
                return SEEN[event]
            elif self._handle(event):
                return TOUCHED
        why = f"integration failed at t = {self.time:.6f} s: the leg chatters"
        raise PlantFault("integration failed", why)

    def compiled_regimes(self) -> list[CompiledRegime]:
        """Compiled regimes in which the leg has been so far."""
        return list(self._regimes.values())

    def _piece(self, until: float) -> int | None:
        """Integrate to `until` or to the next event."""
        compiled = self.compiled
        length = until - self.began
        # max_steps is passed by position: a keyword costs a fifth of a short call.
        outcome = compiled.run(length, MAX_STEPS)[0].value
        q1, q2, v1, v2 = compiled.numbers
        q = self.plain_q = (q1, q2)
        v = self.plain_v = (v1, v2)
        if outcome == TIME_LIMIT:
            # Exactly `until`, since a time that is short of it by rounding is never reached.
            event, self.elapsed, time = None, length, until
        else:
            event, self.elapsed = -outcome - 1, compiled.integrator.time
            time = self.began + self.elapsed
            if not 0 <= event < EVENTS:
                why = f"integration failed at t = {time:.6f} s: the state runs away"
                raise PlantFault("integration failed", why)
        if self._variation is None:
            self.q, self.v, self.time = q, v, time
        else:
            self._variation.carry(self, q, v, until, event)
        return event

    def _handle(self, event: int) -> bool:
        """Handle an event of a stop, a held foot or the ground; true if contact is to change."""
        compiled = self.compiled
        if event <= HIP_HIGH:
            self.stop_switches.cross(compiled, event)
            self._decide()
        elif event == RECOVER:
            self._load(self._compiled_for(self.regime))
        elif event != CONTACT:
            self.stop_switches.flip(compiled, event)
        elif (beginning := self.contact.repeats()) is not None:
            self._go_back(*beginning)
            self.contact.mask()
        elif self.contact.ends_regime():
            return True
        elif not self.contact.masked:
            self._load(self._compiled_for(self.regime, held=True))
        return False

    def _go_back(self, time: float, q: Pair, v: Pair, point: Pair, drift: Pair) -> None:
        """Go back to the beginning of the last piece, which is to be taken again."""
        self.time, self.q, self.v, self.point, self.drift = time, q, v, point, drift
        self.plain_q, self.plain_v = floats(q), floats(v)
        self._load(self.compiled)

    def _put(
        self, compiled: CompiledRegime, q: Pair, v: Pair, point: Pair, drift: Pair, lean: float
    ) -> None:
        self.q, self.v, self.point, self.drift, self.lost = q, v, point, drift, 0.0
        self.plain_q, self.plain_v, self.plain_motor = q, v, self.motor
        if self._variation is not None:
            self.plain_q, self.plain_v, self.plain_motor = floats(q), floats(v), floats(self.motor)
        self.detector.begin(lean)
        self.stop_switches.find(self.plain_q, self.plain_v)
        self.contact.enter(self.since)
        self._load(compiled)

    def _load(self, compiled: CompiledRegime) -> None:
        """Load the present state into a compiled regime."""
        self.compiled, self.regime, self.terms = compiled, compiled.regime, compiled.terms
        self.began, self.elapsed, self.told = self.time, 0.0, None
        compiled.put(self.plain_q, self.plain_v, self.plain_motor)
        if compiled.flies:
            compiled.slots[HEIGHT], compiled.slots[SPEED] = self.point[1], self.drift[1]
        self.detector.move_to(compiled)
        if self.stop_switches.touched or compiled.pushed:
            self._decide()

    def _decide(self) -> None:
        """Set which stops push, after something has jumped."""
        self.stop_switches.decide(self.compiled, self.plain_motor, self.plain_q, self.plain_v)

    def _compiled_for(self, regime: Regime, *, held: bool = False) -> CompiledRegime:
        found = self._regimes.get((regime, held))
        if found is None:
            found = CompiledRegime(self.plain, regime, self.probe, self._tolerance, held=held)
            self._regimes[regime, held] = found
        return found
