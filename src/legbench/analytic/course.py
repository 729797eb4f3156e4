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

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from legbench.analytic._heyoka import heyoka as hy
from legbench.analytic.bumpers import Bumpers
from legbench.analytic.compiled import TOLERANCE, foot_from_centre, parameters_of, terms_of
from legbench.analytic.contact import MIN_PHASE
from legbench.analytic.dual import DUAL, Dual, gradient, without_gradients
from legbench.analytic.equations import (
    SCALAR,
    Pair,
    contact_force,
    free_foot_acceleration,
    sweep,
    sweep_rate,
    touchdown_rates,
)
from legbench.analytic.model import LegModel
from legbench.analytic.places import HEIGHT, MOTOR, SPEED, Event, Kind, Watched
from legbench.analytic.state import LegState, Regime
from legbench.analytic.variation import Variation, duals
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Levels:
    """Values at which an integration stops [rad], and whether the probe's turns stop it, too."""

    upper: float = NEVER
    lower: float = -NEVER
    turns: bool = False
    lean: float = NEVER
    """Largest |q1 + q2|, twice the polar angle, of a leg that has not fallen [rad]."""


SILENT = Levels()
KINDS = {Regime.FLIGHT: Kind.FLIGHT, Regime.STANCE: Kind.STANCE}
"""The compiled equations that a regime begins with; the fixed ones for all others."""


@final
class Course:
    """A leg that is followed through its regimes.

    Attributes:
        time: where it is [s].
        regime: which equations hold.
        q: angles [rad].
        v: rates [rad/s].
        motor: motor positions [rad].
        since: time at which the regime began [s].
    """

    def __init__(
        self,
        model: LegModel,
        *,
        probe: Pair | None = None,
        tolerance: float = TOLERANCE,
        min_phase: float = MIN_PHASE,
    ) -> None:
        self.model, self._plain = model, without_gradients(model)
        self._timed = replace(self._plain, ops=DUAL)
        self._probe: Pair = probe or (0.0, 0.0)
        self._tolerance, self._min_phase = tolerance, min_phase
        self._centre_to_foot = foot_from_centre(model)
        self._bumpers = Bumpers(self._plain)
        self._watches: dict[tuple[Regime, bool], Watch] = {}
        self._variation = Variation(tolerance) if model.ops is DUAL else None
        self._levels, self._turn, self._blind = SILENT, 0.0, 0.0
        self.motor: Pair = (0.0, 0.0)

    def start(self, state: LegState) -> None:
        """Put the leg somewhere."""
        self.q, self.v, self.time, self.since = state.q, state.v, state.time, state.since
        along = self._along(state.regime)
        x, z = sweep(self.model.ops, state.q, along)
        self.point = state.trunk_pos[0] + x, state.trunk_pos[1] + z
        self.drift: Pair = (0.0, 0.0)
        if state.regime is Regime.FLIGHT:
            x, z = sweep_rate(self.model.ops, state.q, state.v, along)
            self.drift = state.trunk_vel[0] + x, state.trunk_vel[1] + z
        self._bumpers.find(_floats(state.q), _floats(state.v))
        self._enter(state.regime)

    def state(self) -> LegState:
        """The leg as a state."""
        ops, along = self.model.ops, self._along(self.regime)
        (x, z), (dx, dz) = self.centre() if self.regime is Regime.FLIGHT else (self.point, (0, 0))
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
        elapsed = self.time - self._began
        fallen = self.model.floating.gravity * elapsed
        return (x + dx * elapsed, z + (dz - 0.5 * fallen) * elapsed), (dx, dz - fallen)

    def hold(self, motor: Pair) -> None:
        """Put the motors somewhere [rad]."""
        if motor != self.motor:
            self.motor, self._motor = motor, _floats(motor)
            self._watch.pars[MOTOR : MOTOR + 2] = motor
            if self._bumpers.touched:
                self._decide()

    def switch(self) -> None:
        """Go over to the other side of a touchdown or lift-off."""
        ops, model, along = self.model.ops, self.model, self._centre_to_foot
        arm, arm_vel = sweep(ops, self.q, along), sweep_rate(ops, self.q, self.v, along)
        if self.regime is Regime.FLIGHT:
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
        free = self.regime in (Regime.FLIGHT, Regime.STANCE)
        for _ in range(MAX_EVENTS):
            event = self._due(looking=free and self.time >= self._blind)
            if event is None:
                end = min(self._blind, until) if free and self.time < self._blind else until
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
            self._watch.integrator.step(step)
        self.time = self._began + count * step
        q1, q2, v1, v2 = self._watch.state.tolist()
        self.q = self._q = (q1, q2)
        self.v = self._v = (v1, v2)

    def _due(self, *, looking: bool) -> int | None:
        """Guard every event against the zero it starts on; one whose condition holds already."""
        watch, (q1, q2), (v1, v2) = self._watch, self._q, self._v
        watch.restore()
        (p1, p2), gain, level = self._probe, watch.gain, watch.level
        reading, lean, knee = p1 * q1 + p2 * q2, q1 + q2, q2 - q1
        rate = p1 * v1 + p2 * v2
        if self._levels.turns:
            self._watch_turn(rate)
        due = None
        readings = (reading, reading, rate, lean, lean, knee, knee, q1, q1)
        for event, value in enumerate(readings):
            if gain[event] * value - level[event] > -NUDGE:
                beyond = watch.guard(event, value)
                if beyond and event in SEEN and due is None:
                    due = event
        if self._bumpers.touched:
            self._bumpers.guard(watch, self._terms, self._motor, self._q, self._v)
        else:
            self._bumpers.silence(watch)
        if looking:
            contact = self._contact()
            due = contact if due is None else due
        elif watch.gain[Event.CONTACT] != 0.0:
            watch.lay(Event.CONTACT, *OFF)
        return due

    def _contact(self) -> int | None:
        """Guard touchdown or lift-off; the event if the leg cannot stay in its regime."""
        watch, q, v = self._watch, self._q, self._v
        if watch.flies:
            elapsed = float(watch.integrator.time)
            gravity = self._plain.floating.gravity
            z, dz = float(self.point[1]), float(self.drift[1])
            height = z + (dz - 0.5 * gravity * elapsed) * elapsed
            height += sweep(self._plain.ops, q, self._foot)[1]
            if height > 0.0:
                watch.lay(Event.CONTACT, -1.0, 0.0)
                watch.guard(Event.CONTACT, height)
                return None
            rise = dz - gravity * elapsed + sweep_rate(self._plain.ops, q, v, self._foot)[1]
            if rise < 0.0:
                return Event.CONTACT
            self._blind = self.time + self._min_phase  # under the ground and rising: look later
            watch.lay(Event.CONTACT, *OFF)
            return None
        force = self._plain.stance_force(self._motor, q, v)[1] / self._weight
        if not watch.held:
            if force < 0.0:
                return Event.CONTACT
            watch.lay(Event.CONTACT, -1.0, 0.0)
            watch.guard(Event.CONTACT, force)
            return None
        if force > 0.0:
            return Event.RECOVER
        released = self._released()
        if released > -TIE:
            return Event.CONTACT
        for event, reading in ((Event.CONTACT, released), (Event.RECOVER, force)):
            watch.lay(event, 1.0, 0.0)
            watch.guard(event, reading)
        return None

    def _released(self) -> float:
        """Acceleration that the standing foot would have if it were let go, over gravity."""
        return self._plain.released_rise(self._motor, self._q, self._v) / GRAVITY

    def _watch_turn(self, rate: float) -> None:
        """Watch the probe's next turn, which is the other kind after one that has just been."""
        if self._turn == 0.0:
            if abs(rate) <= NUDGE:
                a = self._plain.acceleration(self._terms, self._motor, self._q, self._v)
                rate = self._probe[0] * a[0] + self._probe[1] * a[1]
            self._turn = -1.0 if rate > 0.0 else 1.0
        if self._watch.gain[Event.TURN] != self._turn:
            self._watch.lay(Event.TURN, self._turn, 0.0)

    def _piece(self, until: float) -> int | None:
        """Integrate to `until` or to the next event."""
        watch, integrator = self._watch, self._watch.integrator
        # max_steps by its place: by name it costs a fifth of a short call.
        outcome = int(integrator.propagate_until(float(until - self._began), MAX_STEPS)[0])
        event = None if outcome == TIME_LIMIT else -outcome - 1
        if event is not None and not 0 <= event < len(Event):
            raise PlantFault(
                "integration failed",
                f"integration failed at t = {self._began + integrator.time:.6f} s: the state runs "
                "away",
            )
        q1, q2, v1, v2 = watch.state.tolist()
        self._q, self._v = (q1, q2), (v1, v2)
        if self._variation is None:
            self.q, self.v = self._q, self._v
            # The end to the last bit, or whoever waits for it waits for ever.
            self.time = until if event is None else self._began + float(integrator.time)
        else:
            self._vary(until, event)
        return event

    def _vary(self, until: float, event: int | None) -> None:
        """Carry the derivatives through the piece, and begin the next one at its end."""
        watch, variation = self._watch, self._variation
        if variation is None:
            return
        time = float(watch.integrator.time)
        varied = parameters_of(self.model, self.regime, self._probe)[:MOTOR] + [*self.motor]
        moved = variation.moved([*self.q, *self.v], watch.pars, time, varied)
        torque = self._plain.torque(self._motor, self._q, self._v)
        a = self._bumpers.turns(SCALAR, self._terms, torque, self._q, self._v)[1]
        values, rates = [*self._q, *self._v], np.array([*self._v, *a])
        if event is None:
            shift = gradient(until - self._began)
        else:
            q1, q2, v1, v2 = duals(values, moved)
            reading = self._reading(self.model, event, (q1, q2), (v1, v2), time)
            change = gradient(watch.gain[event] * reading - watch.level[event])
            q1, q2, v1, v2 = duals(values, rates[:, np.newaxis])
            elapsed = Dual(time, np.ones(1))
            reading = self._reading(self._timed, event, (q1, q2), (v1, v2), elapsed)
            shift = -change / (watch.gain[event] * gradient(reading)[0])
        q1, q2, v1, v2 = duals(values, moved + np.multiply.outer(rates, shift))
        self.q, self.v = (q1, q2), (v1, v2)
        self.time = until if event is None else self._began + Dual(time, shift)
        if watch.flies:
            self.point, self.drift = self.centre()
            watch.pars[HEIGHT], watch.pars[SPEED] = self.point[1], self.drift[1]
        self._began = self.time
        watch.integrator.time = 0.0

    def _reading(self, model: LegModel, event: int, q: Pair, v: Pair, elapsed: float) -> float:
        """What an event looks at, in the numbers of `model`."""
        ops = model.ops
        match event:
            case Event.RISE | Event.FALL:
                return self._probe[0] * q[0] + self._probe[1] * q[1]
            case Event.TURN:
                return self._probe[0] * v[0] + self._probe[1] * v[1]
            case Event.FELL | Event.FELL_BACK:
                return q[0] + q[1]
            case Event.KNEE_LOW | Event.KNEE_HIGH:
                return q[1] - q[0]
            case Event.HIP_LOW | Event.HIP_HIGH:
                return q[0]
            case Event.CONTACT if self._watch.flies:
                z, dz = self.point[1], self.drift[1]
                if model is self._timed:
                    z, dz = float(z), float(dz)
                height = z + (dz - 0.5 * model.floating.gravity * elapsed) * elapsed
                return height + sweep(ops, q, foot_from_centre(model))[1]
        motor = self._motor if model is self._timed else self.motor
        torque, regime = model.torque(motor, q, v), self.regime
        free = event >= Event.KNEE_FREE or (event == Event.CONTACT and self._watch.held)
        terms = model.falling if free else terms_of(model, regime)
        turns, a = self._bumpers.turns(ops, terms, torque, q, v, free=free)
        match event:
            case Event.KNEE_PUSH | Event.HIP_PUSH:
                joint = event - Event.KNEE_PUSH
                return self._bumpers.sign(joint) * turns[joint]
            case Event.KNEE_FREE | Event.HIP_FREE:
                joint = event - Event.KNEE_FREE
                return self._bumpers.sign(joint) * turns[joint]
            case Event.CONTACT if free:
                rise = free_foot_acceleration(ops, model.floating, q, v, a)[1]
                return rise / GRAVITY
            case _:
                force = contact_force(ops, model.floating, q, v, a)[1]
                return force / (model.floating.mass * GRAVITY)

    def _meaning(self, event: int) -> Watched | None:
        """What an event says to the outside; those of the stops are dealt with here."""
        watch = self._watch
        if event in SEEN:
            return SEEN[Event(event)]
        match event:
            case Event.TURN:
                self._turn = -self._turn
                return Watched.TURN
            case Event.KNEE_LOW | Event.KNEE_HIGH | Event.HIP_LOW | Event.HIP_HIGH:
                self._bumpers.cross(event)
                gains, levels = self._bumpers.lay()
                for offset, (gain, level) in enumerate(zip(gains, levels, strict=True)):
                    watch.lay(Event.KNEE_LOW + offset, gain, level)
                self._decide()
            case Event.KNEE_PUSH | Event.HIP_PUSH | Event.KNEE_FREE | Event.HIP_FREE:
                self._bumpers.flip(watch, event)
            case Event.RECOVER:
                self._load(held=False)
            case _:
                if self.regime is Regime.FLIGHT or watch.held or self._released() > -TIE:
                    return Watched.CONTACT
                self._load(held=True)
        return None

    def _enter(self, regime: Regime) -> None:
        """Begin a regime here and now."""
        self.regime = regime
        self._terms = terms_of(self._plain, regime)
        self._foot = _floats(self._centre_to_foot)
        self._weight = self._plain.floating.mass * GRAVITY
        self._blind = self.since + self._min_phase
        self._turn = 0.0
        self._load(held=False)

    def _load(self, *, held: bool) -> None:
        """Put where the leg is into the integrator of its regime."""
        watch = self._watch = self._watch_of(held=held)
        self._q, self._v, self._motor = _floats(self.q), _floats(self.v), _floats(self.motor)
        self._began = self.time
        watch.integrator.time = 0.0
        watch.integrator.reset_cooldowns()
        watch.state[:] = (*self._q, *self._v)
        watch.pars[MOTOR : MOTOR + 2] = self._motor
        if watch.flies:
            watch.pars[HEIGHT], watch.pars[SPEED] = self.point[1], self.drift[1]
        self._lay(self._levels)
        self._decide()

    def _lay(self, levels: Levels) -> None:
        """Watch other levels."""
        self._levels, watch = levels, self._watch
        gains, bounds = [0.0] * 5, [1.0] * 5
        for event, gain, level in (
            (Event.RISE, 1.0, levels.upper),
            (Event.FALL, -1.0, -levels.lower),
            (Event.FELL, 1.0, levels.lean),
            (Event.FELL_BACK, -1.0, levels.lean),
        ):
            if level < NEVER:
                gains[event], bounds[event] = gain, level
        if levels.turns and self._turn != 0.0:
            gains[Event.TURN], bounds[Event.TURN] = self._turn, 0.0
        elif not levels.turns:
            self._turn = 0.0
        stop_gains, stop_levels = self._bumpers.lay()
        watch.restore()
        watch.lay_all(gains + stop_gains, bounds + stop_levels)

    def _decide(self) -> None:
        self._bumpers.decide(self._watch, self._terms, self._motor, self._q, self._v)

    def _watch_of(self, *, held: bool) -> Watch:
        if (self.regime, held) not in self._watches:
            kind = Kind.HELD if held else KINDS.get(self.regime, Kind.FIXED)
            values = parameters_of(self._plain, self.regime, self._probe)
            self._watches[self.regime, held] = Watch(kind, values, self._tolerance)
        return self._watches[self.regime, held]

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


def _floats(pair: Pair) -> Pair:
    """A pair without derivatives."""
    return float(pair[0]), float(pair[1])
