"""One compiled leg under way: from event to event, in order, each once.

    course = Course(model, probe=(-0.7, 0.7))
    course.start(state)
    course.hold(motor)
    what = course.go(until, Levels(upper=0.5))   # Watched, or None at `until`
    if what is Watched.CONTACT:
        course.switch()

A condition that holds already when a piece begins, because something has jumped, is an event at
that instant. A model on dual numbers (`ops=DUAL`) makes time, angles and rates dual, too: the
variational equations then go the same way piece by piece (`variation`).
"""

from typing import NamedTuple, final

from legbench.analytic._heyoka import heyoka as hy
from legbench.analytic.bumpers import Bumpers
from legbench.analytic.compiled import TOLERANCE, foot_from_centre, parameters_of, terms_of
from legbench.analytic.contact import MIN_PHASE
from legbench.analytic.dual import DUAL, floats, without_gradients
from legbench.analytic.equations import (
    Pair,
    Term,
    contact_force,
    free_foot_acceleration,
    pair_acceleration,
    pair_kinetic,
    sweep,
    sweep_rate,
    touchdown_rates,
)
from legbench.analytic.model import LegModel
from legbench.analytic.places import HEIGHT, MOTOR, SPEED, Event, Kind, Watched
from legbench.analytic.state import LegState, Regime
from legbench.analytic.variation import Variation
from legbench.analytic.watch import NUDGE, OFF, Watch
from legbench.design.statics import GRAVITY
from legbench.errors import PlantFault

NEVER = 1e6
"""Level that is never reached [rad]."""
MAX_EVENTS = 10_000
"""Largest number of events that one integration may pass [-]."""
MAX_STEPS = 100_000
"""Largest number of steps of one integration [-]; a leg takes about a hundred a second, a diverging
one any number."""
TIME_LIMIT = int(hy.taylor_outcome.time_limit)
TIE = 1e-7
"""Acceleration over gravity below which the released foot counts as rising: on the radial mode it
vanishes together with the force [-]."""
SEEN = {
    Event.RISE: Watched.RISE,
    Event.FALL: Watched.FALL,
    Event.FELL: Watched.FELL,
    Event.FELL_BACK: Watched.FELL,
}
"""Conditions on angles, which may hold already when a piece begins."""
LINEAR = (
    *(Event.RISE, Event.FALL, Event.FELL, Event.FELL_BACK),
    *(Event.KNEE_LOW, Event.KNEE_HIGH, Event.HIP_LOW, Event.HIP_HIGH),
)
"""Events of angles; they can be near zero only where they were laid anew or the leg was put."""
PROBED = 2
"""Number of those that look at the probe [-]."""
KINDS = {Regime.FLIGHT: Kind.FLIGHT, Regime.STANCE: Kind.STANCE}
"""The compiled equations that a regime begins with; the fixed ones for all others."""


class Levels(NamedTuple):
    """Values of the probe at which an integration stops [rad]."""

    upper: float = NEVER
    lower: float = -NEVER
    turns: bool = False
    """Whether the probe's turns stop it, too."""


SILENT = Levels()


@final
class Course:
    """A leg that is followed through its regimes.

    Attributes:
        model: the leg.
        plain: the leg without derivatives, on which decisions are made.
        time: where it is [s].
        regime: which equations hold.
        q: angles [rad].
        v: rates [rad/s].
        motor: motor positions [rad].
        since: time at which the regime began [s].
        point: the steady point when the present integration began (forward, up) [m].
        drift: velocity of the steady point then [m/s].
        watch: the compiled regime.
        bumpers: the joint stops.
    """

    def __init__(
        self,
        model: LegModel,
        *,
        probe: Pair | None = None,
        tolerance: float = TOLERANCE,
        min_phase: float = MIN_PHASE,
    ) -> None:
        self.model: LegModel = model
        self.plain: LegModel = without_gradients(model)
        self.probe: Pair = probe or (0.0, 0.0)
        self.bumpers = Bumpers(self.plain)
        self._tolerance, self._min_phase = tolerance, min_phase
        self._arm = foot_from_centre(model)
        self._plain_arm = floats(self._arm)
        self._weight = self.plain.floating.mass * GRAVITY
        self._watches: dict[tuple[Regime, bool], Watch] = {}
        self._variation = Variation(tolerance) if model.ops is DUAL else None
        self._levels, self._turn, self._blind, self._lean = SILENT, 0.0, 0.0, NEVER
        self._fresh = 0
        self.motor: Pair = (0.0, 0.0)

    def start(self, state: LegState) -> None:
        """Put the leg somewhere."""
        ops, along = self.model.ops, self._along(state.regime)
        x, z = sweep(ops, state.q, along)
        point, drift = (state.trunk_pos[0] + x, state.trunk_pos[1] + z), (0.0, 0.0)
        if state.regime is Regime.FLIGHT:
            x, z = sweep_rate(ops, state.q, state.v, along)
            drift = state.trunk_vel[0] + x, state.trunk_vel[1] + z
        self.time, self.since = state.time, state.since
        self._put(state.regime, state.q, state.v, point, drift)

    def fly(self, q: Pair, v: Pair, centre: Pair, velocity: Pair, lean: float = NEVER) -> None:
        """Put the leg into the air at time zero, by its centre of mass.

        `lean` is the largest |q1 + q2|, twice the polar angle, of a leg that has not fallen [rad].
        """
        self.time, self.since = 0.0, -self._min_phase
        self._put(Regime.FLIGHT, q, v, centre, velocity, lean)

    def state(self) -> LegState:
        """The leg as a state."""
        ops, along = self.model.ops, self._along(self.regime)
        (x, z), (dx, dz) = self.centre() if self.watch.flies else (self.point, self.drift)
        inner, inner_vel = sweep(ops, self.q, along), sweep_rate(ops, self.q, self.v, along)
        return LegState(
            time=self.time,
            regime=self.regime,
            q=self.q,
            v=self.v,
            trunk_pos=(x - inner[0], z - inner[1]),
            trunk_vel=(dx - inner_vel[0], dz - inner_vel[1]),
            since=self.since,
        )

    def centre(self) -> tuple[Pair, Pair]:
        """Place [m] and velocity [m/s] of the centre of mass in flight."""
        (x, z), (dx, dz) = self.point, self.drift
        elapsed = self.time - self.began
        fallen = self.model.floating.gravity * elapsed
        return (x + dx * elapsed, z + (dz - 0.5 * fallen) * elapsed), (dx, dz - fallen)

    def apex_time(self) -> float:
        """Time at which the centre of mass is highest in this flight [s]."""
        return self.began + self.drift[1] / self.model.floating.gravity

    def foot_from_centre(self, q: Pair) -> Pair:
        """Foot tip seen from the centre of mass (forward, up) [m]."""
        return sweep(self.model.ops, q, self._arm)

    def kinetic_energy(self) -> Term:
        """Of the leg in flight or stance [J]."""
        model, ops = self.model, self.model.ops
        if not self.watch.flies:
            return pair_kinetic(ops, model.stance, self.q, self.v)
        dx, dz = self.centre()[1]
        own = 0.5 * model.floating.mass * (dx * dx + dz * dz)
        return own + pair_kinetic(ops, model.falling, self.q, self.v)

    def hold(self, motor: Pair) -> None:
        """Put the motors somewhere [rad]."""
        if motor != self.motor:
            self.motor, self.plain_motor = motor, floats(motor)
            self.watch.pars[MOTOR : MOTOR + 2] = motor
            if self.bumpers.touched:
                self._decide()

    def switch(self) -> None:
        """Go over to the other side of a touchdown or lift-off."""
        ops, model = self.model.ops, self.model
        arm, arm_vel = sweep(ops, self.q, self._arm), sweep_rate(ops, self.q, self.v, self._arm)
        if self.watch.flies:
            (x, z), (dx, dz) = self.centre()
            self.point, self.drift = (x + arm[0], z + arm[1]), (0.0, 0.0)
            foot_vel = dx + arm_vel[0], dz + arm_vel[1]
            self.v = touchdown_rates(ops, model.stance, model.floating, self.q, self.v, foot_vel)
            regime = Regime.STANCE
        else:
            self.point = self.point[0] - arm[0], self.point[1] - arm[1]
            self.drift = -arm_vel[0], -arm_vel[1]
            regime = Regime.FLIGHT
        self.since = self.time
        self._enter(regime)

    def go(self, until: float, levels: Levels = SILENT) -> Watched | None:
        """Go on to `until` or to the first thing watched, just before it takes effect.

        Raises:
            PlantFault: the integration failed.
        """
        if levels is not self._levels:
            self._lay(levels)
        for _ in range(MAX_EVENTS):
            event = self._due()
            if event is None:
                end = min(self._blind, until) if self.time < self._blind else until
                if end > self.time:
                    event = self._piece(end)
            if event is not None:
                seen = self._meaning(event)
                if seen is not None:
                    return seen
            elif self.time >= until:
                return None
        raise PlantFault(
            "integration failed", f"integration failed at t = {self.time:.6f} s: the leg chatters"
        )

    def march(self, step: float, count: int) -> None:
        """Take steps of one length whatever the error, blind to events."""
        for _ in range(count):
            self.watch.integrator.step(step)
        self.time = self.began + count * step
        q1, q2, v1, v2 = self.watch.state.tolist()
        self.q = self._q = (q1, q2)
        self.v = self._v = (v1, v2)

    def _due(self) -> int | None:
        """Guard every event against the zero it starts on; one whose condition holds already."""
        watch = self.watch
        if watch.moved:
            watch.restore()
        due = self._near() if self._fresh else None
        if self.bumpers.touched:
            self.bumpers.guard(watch, self.terms, self.plain_motor, self._q, self._v)
        if self._free:
            contact = self._contact()
            due = contact if due is None else due
        return due

    def _near(self) -> int | None:
        """Guard what has been laid anew or jumped; one whose condition holds already."""
        guard, (q1, q2), (p1, p2) = self.watch.guard, self._q, self.probe
        reading, lean, knee = p1 * q1 + p2 * q2, q1 + q2, q2 - q1
        due = None
        for event, value in zip(
            LINEAR[: self._fresh], (reading, reading, lean, lean, knee, knee, q1, q1), strict=False
        ):
            if guard(event, value) and event in SEEN and due is None:
                due = event
        if self._levels.turns:
            self._guard_turn()
        if due is None:
            self._fresh = 0
        return due

    def _contact(self) -> int | None:
        """Guard touchdown or lift-off; the event if the leg cannot stay in its regime."""
        watch = self.watch
        if self.time < self._blind:
            if watch.gain[Event.CONTACT] != 0.0:
                watch.lay(Event.CONTACT, *OFF)
            return None
        if watch.flies:
            return self._touchdown()
        force = self._force()
        if not watch.held:
            if force < 0.0:
                return Event.CONTACT
            self._expect(force)
            return None
        released = self._released()
        if force > 0.0 or released > -TIE:
            return Event.RECOVER if force > 0.0 else Event.CONTACT
        for event, reading in ((Event.CONTACT, released), (Event.RECOVER, force)):
            watch.lay(event, 1.0, 0.0)
            watch.guard(event, reading)
        return None

    def _touchdown(self) -> int | None:
        """Guard touchdown; the event if the foot is through the ground and sinking."""
        watch, elapsed = self.watch, float(self.watch.integrator.time)
        z, dz = float(self.point[1]), float(self.drift[1])
        fallen = self.plain.floating.gravity * elapsed
        height = z + (dz - 0.5 * fallen) * elapsed
        height += sweep(self.plain.ops, self._q, self._plain_arm)[1]
        if height > 0.0:
            self._expect(height)
            return None
        arm_vel = sweep_rate(self.plain.ops, self._q, self._v, self._plain_arm)
        if dz - fallen + arm_vel[1] < 0.0:
            return Event.CONTACT
        self._blind = self.time + self._min_phase  # under the ground and rising: look later
        watch.lay(Event.CONTACT, *OFF)
        return None

    def _expect(self, reading: float) -> None:
        """Watch height or force fall to zero."""
        if self.watch.gain[Event.CONTACT] != -1.0:
            self.watch.lay(Event.CONTACT, -1.0, 0.0)
        if reading < NUDGE:
            self.watch.guard(Event.CONTACT, reading)

    def _force(self) -> float:
        """Vertical force on the standing foot, over the weight."""
        plain, q, v = self.plain, self._q, self._v
        a = self._accelerations()
        return contact_force(plain.ops, plain.floating, q, v, a)[1] / self._weight

    def _released(self) -> float:
        """Acceleration that the standing foot would have if it were let go, over gravity."""
        plain, q, v = self.plain, self._q, self._v
        torque = plain.torque(self.plain_motor, q, v)
        a = self.bumpers.released(plain.falling, torque, q, v)
        return free_foot_acceleration(plain.ops, plain.floating, q, v, a)[1] / GRAVITY

    def _accelerations(self) -> Pair:
        """Accelerations of the angles, where those stops act that are known to."""
        plain, q, v = self.plain, self._q, self._v
        torque = plain.torque(self.plain_motor, q, v)
        if self.bumpers.touched:
            return self.bumpers.turns(plain.ops, self.terms, torque, q, v)[1]
        return pair_acceleration(plain.ops, self.terms, q, v, torque)

    def _guard_turn(self) -> None:
        """Watch the probe's next turn, which is the other kind after one that has just been."""
        (p1, p2), (v1, v2) = self.probe, self._v
        rate = p1 * v1 + p2 * v2
        if self._turn == 0.0:
            towards = rate
            if abs(rate) <= NUDGE:
                a = self._accelerations()
                towards = p1 * a[0] + p2 * a[1]
            self._turn = -1.0 if towards > 0.0 else 1.0
        if self.watch.gain[Event.TURN] != self._turn:
            self.watch.lay(Event.TURN, self._turn, 0.0)
        if self._turn * rate > -NUDGE:
            self.watch.guard(Event.TURN, rate)

    def _piece(self, until: float) -> int | None:
        """Integrate to `until` or to the next event."""
        integrator = self.watch.integrator
        # max_steps by its place: by name it costs a fifth of a short call.
        outcome = int(integrator.propagate_until(float(until - self.began), MAX_STEPS)[0])
        event = None if outcome == TIME_LIMIT else -outcome - 1
        if event is not None and not 0 <= event < len(Event):
            raise PlantFault(
                "integration failed",
                f"integration failed at t = {self.began + integrator.time:.6f} s: the state runs "
                "away",
            )
        q1, q2, v1, v2 = self.watch.state.tolist()
        self._q, self._v = (q1, q2), (v1, v2)
        if self._variation is not None:
            self._variation.carry(self, self._q, self._v, until, event)
            return event
        self.q, self.v = self._q, self._v
        # The end to the last bit, or whoever waits for it waits for ever.
        self.time = until if event is None else self.began + float(integrator.time)
        return event

    def _meaning(self, event: int) -> Watched | None:
        """What an event says to the outside; those of the stops are dealt with here."""
        watch = self.watch
        if event in SEEN:
            return SEEN[Event(event)]
        if event == Event.TURN:
            self._turn = -self._turn
            watch.lay(Event.TURN, self._turn, 0.0)
            return Watched.TURN
        if event <= Event.HIP_HIGH:
            self.bumpers.cross(event)
            self.bumpers.lay(watch)
            self._decide()
        elif event == Event.RECOVER:
            self._load(held=False)
        elif event != Event.CONTACT:
            self.bumpers.flip(watch, event)
        elif watch.flies or watch.held or self._released() > -TIE:
            return Watched.CONTACT
        else:
            self._load(held=True)
        return None

    def _put(
        self, regime: Regime, q: Pair, v: Pair, point: Pair, drift: Pair, lean: float = NEVER
    ) -> None:
        self.q, self.v, self.point, self.drift, self._lean = q, v, point, drift, lean
        self.bumpers.find(floats(q), floats(v))
        self._enter(regime)

    def _enter(self, regime: Regime) -> None:
        """Begin a regime here and now."""
        self.regime = regime
        self.terms = terms_of(self.plain, regime)
        self._free = regime in KINDS
        self._blind = self.since + self._min_phase if self._free else self.since
        self._turn = 0.0
        self._load(held=False)

    def _load(self, *, held: bool) -> None:
        """Put where the leg is into the integrator of its regime."""
        watch = self.watch = self._watch_of(held=held)
        self._q, self._v, self.plain_motor = floats(self.q), floats(self.v), floats(self.motor)
        self.began = self.time
        watch.integrator.time = 0.0
        watch.integrator.reset_cooldowns()
        watch.state[:] = (*self._q, *self._v)
        watch.pars[MOTOR : MOTOR + 2] = self.plain_motor
        if watch.flies:
            watch.pars[HEIGHT], watch.pars[SPEED] = self.point[1], self.drift[1]
        self._fresh = len(LINEAR)
        watch.restore()
        watch.lay_bounds(Event.FELL, Event.FELL_BACK, -self._lean, self._lean, NEVER)
        self.bumpers.lay(watch)
        self._lay(self._levels)
        self._decide()

    def _lay(self, levels: Levels) -> None:
        """Watch other levels."""
        self._levels, watch = levels, self.watch
        self._fresh = max(self._fresh, PROBED)
        watch.lay_bounds(Event.FALL, Event.RISE, levels.lower, levels.upper, NEVER)
        if not levels.turns:
            self._turn = 0.0
            if watch.gain[Event.TURN] != 0.0:
                watch.lay(Event.TURN, *OFF)

    def _decide(self) -> None:
        self.bumpers.decide(self.watch, self.terms, self.plain_motor, self._q, self._v)

    def _watch_of(self, *, held: bool) -> Watch:
        found = self._watches.get((self.regime, held))
        if found is None:
            kind = Kind.HELD if held else KINDS.get(self.regime, Kind.FIXED)
            values = parameters_of(self.plain, self.regime, self.probe)
            found = self._watches[self.regime, held] = Watch(kind, values, self._tolerance)
        return found

    def _along(self, regime: Regime) -> Pair:
        """The steady point seen from the hip, per direction of the angles [m]."""
        floating = self.model.floating
        match regime:
            case Regime.FLIGHT:
                return floating.first[0] / floating.mass, floating.first[1] / floating.mass
            case Regime.HANGING:
                return 0.0, 0.0
            case _:
                return floating.reach, floating.reach
