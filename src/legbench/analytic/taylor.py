"""The fast path: the same equations, compiled into Taylor integrators with event detection.

The one door to heyoka (the extra `modes`). Compiling the two regimes of a leg takes about a
second; after that a hop costs a fraction of a millisecond at an error near rounding.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Any, final

from legbench.analytic.equations import (
    Ops,
    Pair,
    contact_force,
    flight_acceleration,
    free_foot_acceleration,
)
from legbench.analytic.equations import pair_acceleration as accelerate
from legbench.analytic.hybrid import overdue, switch
from legbench.analytic.model import LegModel
from legbench.analytic.smooth import Accuracy
from legbench.analytic.state import LegState, Regime, Transition
from legbench.errors import ConfigError, MissingExtraError, PlantFault

try:
    import heyoka as hy
except ImportError as error:
    raise MissingExtraError(
        "heyoka is not installed; the fast path needs it: pip install 'legbench[modes]'"
    ) from error

RISING, FALLING = hy.event_direction.positive, hy.event_direction.negative
EITHER = hy.event_direction.any
SYMBOLS = Ops(sin=hy.sin, cos=hy.cos, sqrt=hy.sqrt)
NEVER = 1e6
"""A level that no probe reaches [rad]."""
COOLDOWN = 1e-8
"""For which an event does not repeat itself; long against rounding, short against a leg [s]."""
TIE = 1e-6
"""On the radial mode force and released acceleration vanish together, up to rounding [m/s^2, N]."""
AT_STOP = 1e-12
"""Depth that may be rounding: the speed then says whether the stop is touched [rad]."""
MAX_EVENTS = 10_000
"""That one go may step over [-]."""
MAX_STEPS = 100_000
"""In one go: a leg takes a hundred a second, one that runs away any number [-]."""
MOTOR, UPPER, LOWER, TURNS, STOPS = 0, 2, 3, 4, 5
"""Places of the parameters: two motor positions, two levels, whether turning counts (of a leg at
rest the probe would turn all the time), a switch for each stop."""


class Watched(IntEnum):
    """What can end an integration."""

    CONTACT = 0
    """Touchdown or lift-off."""
    RISE = 1
    """The probe rises through the upper level."""
    FALL = 2
    """The probe falls through the lower level."""
    TURN = 3
    """The probe turns round."""
    STOP = 4
    """A joint meets or leaves a stop; taken care of within."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Levels:
    """At which values of the probe to stop [rad]; and whether where it turns."""

    upper: float = NEVER
    lower: float = -NEVER
    turns: bool = False


SILENT = Levels()


@final
class TaylorLeg:
    """Integrates one leg from event to event; `advance` is that of `HybridLeg`.

    A probe `p1 q1 + p2 q2` can be watched on the way, for controllers that act on angles; who
    has none need not pay for it.

    Raises:
        ConfigError: a tolerance that is not positive.
    """

    def __init__(
        self,
        model: LegModel,
        *,
        probe: Pair | None = None,
        tolerance: float = 1e-15,
        min_phase: float = Accuracy().min_phase,
    ) -> None:
        if not tolerance > 0.0:
            raise ConfigError(f"tolerance is {tolerance:g}; it must be positive")
        self.model = model
        self._probe, self._min_phase = probe, min_phase
        self._tolerance = tolerance
        self._compiled: dict[Regime, _Compiled] = {}

    def advance(
        self, state: LegState, until: float, motor: Pair
    ) -> tuple[LegState, list[Transition]]:
        """The leg at `until`, motors held at `motor`, and what happened until then.

        Raises:
            PlantFault: the integration failed.
        """
        happened: list[Transition] = []
        while state.time < until:
            state, what = self.watch(state, until, motor, SILENT)
            if what is Watched.CONTACT:
                after = switch(self.model, state)
                happened.append(Transition(time=state.time, before=state, after=after))
                state = after
        return state, happened

    def watch(
        self, state: LegState, until: float, motor: Pair, levels: Levels
    ) -> tuple[LegState, Watched | None]:
        """Go on until `until` or to the first thing watched, just before it takes effect.

        Raises:
            PlantFault: the integration failed.
        """
        leg = self._leg(state.regime)
        leg.load(state)
        leg.set(motor, levels)
        free = state.regime in (Regime.FLIGHT, Regime.STANCE)
        guard = state.since + self._min_phase
        if free and state.time < guard:
            what = leg.go(min(guard, until), contact=False)
            if what is not None or guard >= until:
                return leg.read(state), what
            state = leg.read(state)
        if free and overdue(self.model, state, motor):
            return state, Watched.CONTACT
        what = leg.go(until, contact=free)
        return leg.read(state), what

    def _leg(self, regime: Regime) -> "_Compiled":
        kind = Regime.STANCE if regime.stands else regime
        if kind not in self._compiled:
            self._compiled[kind] = _Compiled(self.model, kind, self._probe, self._tolerance)
        return self._compiled[kind]

    def order(self, regime: Regime) -> int:
        """Of the Taylor series that the tolerance asks for."""
        return int(self._leg(regime).integrator.order)

    def fixed_steps(self, state: LegState, step: float, count: int, motor: Pair) -> LegState:
        """Take steps of one length whatever the error, blind to events; to measure the order."""
        leg = self._leg(state.regime)
        leg.load(state)
        leg.set(motor, SILENT)
        for _ in range(count):
            leg.integrator.step(step)
        return leg.read(state)


@final
class _Compiled:
    """The integrator of one regime, and what its events mean."""

    def __init__(
        self, model: LegModel, regime: Regime, probe: Pair | None, tolerance: float
    ) -> None:
        self._model, self._regime = model, regime
        self._last: LegState | None = None
        self._anchor = 0.0
        q = hy.make_vars("q1", "q2")
        v = hy.make_vars("v1", "v2")
        torque = _torque(model, q, v)
        match regime:
            case Regime.FLIGHT:
                system, ground = _flight(model, q, v, torque)
            case Regime.STANCE:
                system, ground = _stance(model, q, v, torque)
            case _:
                a = accelerate(SYMBOLS, model.hanging, q, v, torque)
                system, ground = _joints(q, v, a), []
        events = [
            *ground,
            *(() if probe is None else _probed(probe, q, v)),
            *((Watched.STOP, stop.depth(q), EITHER) for stop in model.stops),
        ]
        self._events = [kind for kind, _, _ in events]
        self.integrator: Any = hy.taylor_adaptive(
            system,
            [0.0] * len(system),
            t_events=[
                hy.t_event(value, direction=direction, cooldown=COOLDOWN)
                for _, value, direction in events
            ],
            tol=tolerance,
            fast_math=True,  # a third faster, and no digit of the result the worse
        )

        self._settable = min(STOPS, self.integrator.pars.size)  # no levels if nobody looks

    def load(self, state: LegState) -> None:
        """Start from a state, or go on where the integrator stopped if it is that state."""
        self._anchor = state.trunk_pos[0] + self._model.foot_from_hip(state.q)[0]
        if state is self._last:
            return
        integrator = self.integrator
        integrator.time = state.time
        if self._regime is Regime.FLIGHT:
            integrator.state[:] = (*state.trunk_pos, *state.q, *state.trunk_vel, *state.v)
        else:
            integrator.state[:] = (*state.q, *state.v)
        if self._events:
            integrator.reset_cooldowns()
        for index, stop in enumerate(self._model.stops):
            depth = stop.depth(state.q)
            touched = depth > AT_STOP or (depth > -AT_STOP and stop.speed(state.v) > 0.0)
            integrator.pars[STOPS + index] = float(touched)

    def set(self, motor: Pair, levels: Levels) -> None:
        """Hold the motors, lay the levels."""
        values = (*motor, levels.upper, levels.lower, float(levels.turns))
        self.integrator.pars[:STOPS] = values[: self._settable]

    def go(self, until: float, *, contact: bool) -> Watched | None:
        """Integrate to `until` or to the next event that matters."""
        integrator = self.integrator
        for _ in range(MAX_EVENTS):
            outcome = int(integrator.propagate_until(until, max_steps=MAX_STEPS)[0])
            if outcome == TIME_LIMIT:
                return None
            if not 0 > outcome >= -len(self._events):
                break
            event = -outcome - 1
            what = self._events[event]
            if what is Watched.STOP:
                self._switch_stop(event - self._events.index(Watched.STOP))
                continue
            if what is Watched.CONTACT and not (contact and self._lets_go()):
                continue
            return what
        raise PlantFault(
            "integration failed",
            f"integration failed at t = {integrator.time:.6f} s: the state runs away or chatters",
        )

    def _lets_go(self) -> bool:
        """Whether the event of one condition of lift-off finds the other one fulfilled."""
        if self._regime is not Regime.STANCE:
            return True
        q1, q2, v1, v2 = self.integrator.state.tolist()
        motor = tuple(self.integrator.pars[:2].tolist())
        force = self._model.stance_force(motor, (q1, q2), (v1, v2))[1]
        return force < TIE and self._model.released_rise(motor, (q1, q2), (v1, v2)) > -TIE

    def _switch_stop(self, index: int) -> None:
        values = self.integrator.state.tolist()
        v = (values[-2], values[-1])
        entering = self._model.stops[index].speed(v) > 0.0
        self.integrator.pars[STOPS + index] = float(entering)

    def read(self, state: LegState) -> LegState:
        """The state reached, with what the regime of `state` does not change."""
        values = self.integrator.state.tolist()
        time = float(self.integrator.time)
        if self._regime is Regime.FLIGHT:
            q, v, trunk_pos, trunk_vel = values[2:4], values[6:], values[:2], values[4:6]
        else:
            q, v, trunk_pos, trunk_vel = values[:2], values[2:], state.trunk_pos, state.trunk_vel
            if self._regime is Regime.STANCE:
                foot, speed = self._model.foot_from_hip(q), self._model.foot_vel_from_hip(q, v)
                trunk_pos = (self._anchor - foot[0], -foot[1])
                trunk_vel = (-speed[0], -speed[1])
        reached = LegState(
            time=time,
            regime=state.regime,
            q=tuple(q),
            v=tuple(v),
            trunk_pos=tuple(trunk_pos),
            trunk_vel=tuple(trunk_vel),
            since=state.since,
        )
        self._last = reached
        return reached


TIME_LIMIT = int(hy.taylor_outcome.time_limit)


def _torque(model: LegModel, q: Any, v: Any) -> Pair:
    total = model.smooth_torque((hy.par[MOTOR], hy.par[MOTOR + 1]), q, v)
    for index, stop in enumerate(model.stops):
        torque = stop.torque(hy.par[STOPS + index] * stop.force(SYMBOLS, q, v))
        total = total[0] + torque[0], total[1] + torque[1]
    return total


def _probed(probe: Pair, q: Any, v: Any) -> list[Any]:
    reading, rate = (probe[0] * x[0] + probe[1] * x[1] for x in (q, v))
    turning = hy.par[TURNS] * rate + (1.0 - hy.par[TURNS])
    return [
        (Watched.RISE, reading - hy.par[UPPER], RISING),
        (Watched.FALL, reading - hy.par[LOWER], FALLING),
        (Watched.TURN, turning, EITHER),
    ]


def _joints(q: Any, v: Any, a: Pair) -> list[Any]:
    return [(q[0], v[0]), (q[1], v[1]), (v[0], a[0]), (v[1], a[1])]


def _stance(model: LegModel, q: Any, v: Any, torque: Pair) -> tuple[list[Any], list[Any]]:
    """The system, and both conditions of lift-off: either event may come last (see `hybrid`)."""
    a = accelerate(SYMBOLS, model.stance, q, v, torque)
    force = contact_force(SYMBOLS, model.floating, q, v, a)[1]
    released = free_foot_acceleration(SYMBOLS, model.floating, model.falling, q, v, torque)[1]
    ground = [(Watched.CONTACT, force, FALLING), (Watched.CONTACT, released, RISING)]
    return _joints(q, v, a), ground


def _flight(model: LegModel, q: Any, v: Any, torque: Pair) -> tuple[list[Any], list[Any]]:
    x, z, vx, vz = hy.make_vars("x", "z", "vx", "vz")
    trunk, a = flight_acceleration(SYMBOLS, model.floating, model.falling, q, v, torque)
    foot = model.foot_from_hip((q[0], q[1]), SYMBOLS)
    joints = _joints(q, v, a)
    system = [(x, vx), (z, vz), *joints[:2], (vx, trunk[0]), (vz, trunk[1]), *joints[2:]]
    return system, [(Watched.CONTACT, z + foot[1], FALLING)]
