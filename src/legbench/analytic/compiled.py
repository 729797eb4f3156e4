"""The equations of one regime as a Taylor integrator with events.

The state is (q1, q2, v1, v2) in every regime: the leg turns about a point that does not depend on
its angles, the centre of mass on its parabola in flight, the foot in stance, the held trunk.
"""

import math
from dataclasses import dataclass
from typing import Any, final

from legbench.analytic._heyoka import heyoka as hy
from legbench.analytic.dual import DUAL
from legbench.analytic.equations import Pair, sweep, sweep_rate
from legbench.analytic.formulas import (
    FORCE,
    STOPS,
    Watched,
    equations_of,
    probed,
    steady_point,
    terms_of,
)
from legbench.analytic.model import LegModel
from legbench.analytic.state import LegState, Regime
from legbench.analytic.variation import Variation
from legbench.errors import PlantFault

TIME_LIMIT = int(hy.taylor_outcome.time_limit)
NEVER = 1e6
"""Probe level that is never reached [rad]."""
COOLDOWN = 1e-8
"""Time within which an event does not repeat itself; long against rounding, short against the
leg's motion [s]."""
TIE = 1e-6
"""Size below which force and released acceleration are rounding: on the radial mode both vanish
together [N, m/s^2]."""
AT_STOP = 1e-12
"""Depth that may be rounding: the speed then says whether the stop is touched [rad]."""
NOWHERE: Pair = (math.nan, math.nan)
"""Placeholder for motor positions that have not been set; unequal to every position."""
MAX_EVENTS = 10_000
"""Largest number of events that one integration may pass [-]."""
MAX_STEPS = 100_000
"""Largest number of steps of one integration [-]; a leg takes about a hundred a second, a diverging
one any number."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Levels:
    """Probe values at which an integration stops [rad], and whether turning stops it, too."""

    upper: float = NEVER
    lower: float = -NEVER
    turns: bool = False


SILENT = Levels()


@final
class Compiled:
    """The integrator of one regime, and what its events mean."""

    def __init__(
        self, model: LegModel, regime: Regime, probe: Pair | None, tolerance: float
    ) -> None:
        self._model, self._regime = model, regime
        self._along, self._falls = steady_point(model, regime)
        self._terms = terms_of(model, regime)
        self._last: LegState | None = None
        self._motor = NOWHERE
        self._began, self._point, self._drift = 0.0, (0.0, 0.0), (0.0, 0.0)
        self._until, self._event = 0.0, None
        q, v = hy.make_vars("q1", "q2"), hy.make_vars("v1", "v2")
        a, ground, stops = equations_of(model, regime, q, v)
        system = [(q[0], v[0]), (q[1], v[1]), (v[0], a[0]), (v[1], a[1])]
        events = [*ground, *(() if probe is None else probed(probe, q, v)), *stops]
        self._events = [kind for kind, _, _ in events]
        varied = model.ops is DUAL
        self.integrator: Any = hy.taylor_adaptive(
            hy.var_ode_sys(system, hy.var_args.vars) if varied else system,
            [0.0] * len(system),
            t_events=[
                hy.t_event(value, direction=direction, cooldown=COOLDOWN)
                for _, value, direction in events
            ],
            tol=tolerance,
            fast_math=True,  # a third faster, and no digit of the result the worse
            compact_mode=varied,  # five times slower, but compiled in a second instead of ten
        )
        pars = int(self.integrator.pars.size)
        self._settable = min(STOPS, pars)  # no levels if nobody looks
        self._variation: Variation | None = None
        if varied:
            values = [value for _, value, _ in events]
            self._variation = Variation(self.integrator, system, values, pars)

    def load(self, state: LegState) -> None:
        """Start from a state, or go on where the integrator stopped if it is that state."""
        integrator, model = self.integrator, self._model
        if state is not self._last:
            integrator.state[:4] = (*state.q, *state.v)
            if self._events:
                integrator.reset_cooldowns()
            for index, stop in enumerate(model.stops):
                depth = stop.depth(state.q)
                beyond = depth > AT_STOP or (depth > -AT_STOP and stop.speed(state.v) > 0.0)
                integrator.pars[STOPS + 2 * index] = float(beyond)
            self._motor = NOWHERE
        elif self._variation is None:
            return
        integrator.time = 0.0
        self._began = state.time
        x, z = sweep(model.ops, state.q, self._along)
        self._point = state.trunk_pos[0] + x, state.trunk_pos[1] + z
        if self._falls:
            x, z = sweep_rate(model.ops, state.q, state.v, self._along)
            self._drift = state.trunk_vel[0] + x, state.trunk_vel[1] + z
        if self._variation is not None:
            self._variation.begin([*state.q, *state.v])

    def set(self, motor: Pair, levels: Levels) -> None:
        """Hold the motors, lay the levels."""
        rise = (self._point[1], self._drift[1])
        values = (*motor, *rise, levels.upper, levels.lower, float(levels.turns))
        self.integrator.pars[: self._settable] = values[: self._settable]
        if motor != self._motor:
            self._motor = motor
            self._push()
        if self._variation is not None:
            self._variation.set(list(values[: self._settable]))

    def go(self, until: float, *, contact: bool) -> Watched | None:
        """Integrate to `until` or to the next event that matters."""
        integrator = self.integrator
        self._until, self._event = until, None
        end = float(until - self._began)
        for _ in range(MAX_EVENTS):
            # max_steps by its place: by name it costs a fifth of a short call.
            outcome = int(integrator.propagate_until(end, MAX_STEPS)[0])
            if outcome == TIME_LIMIT:
                return None
            event = -outcome - 1
            if not 0 <= event < len(self._events):
                break
            what = self._events[event]
            if what is Watched.CONTACT and not (contact and self._lets_go(event)):
                continue
            self._event = event
            return what
        raise PlantFault(
            "integration failed",
            f"integration failed at t = {self._began + integrator.time:.6f} s: the state runs away "
            "or chatters",
        )

    def march(self, step: float, count: int) -> None:
        """Take steps of one length whatever the error, blind to events."""
        for _ in range(count):
            self.integrator.step(step)
        self._until, self._event = self._began + count * step, None

    def _lets_go(self, event: int) -> bool:
        """Whether the event of one condition of lift-off finds the other one fulfilled."""
        if self._regime is not Regime.STANCE:
            return True
        q1, q2, v1, v2 = self.integrator.state[:4].tolist()
        if event == FORCE:
            return self._model.released_rise(self._motor, (q1, q2), (v1, v2)) > -TIE
        return self._model.stance_force(self._motor, (q1, q2), (v1, v2))[1] < TIE

    def switch_stop(self) -> None:
        """Let the stop act whose event has just ended the integration."""
        if self._event is None or self._events[self._event] is not Watched.STOP:
            return
        index, pushing = divmod(self._event - self._events.index(Watched.STOP), 2)
        place = STOPS + 2 * index
        if pushing:
            self.integrator.pars[place + 1] = 1.0 - self.integrator.pars[place + 1]
            return
        v1, v2 = self.integrator.state[2:4].tolist()
        self.integrator.pars[place] = float(self._model.stops[index].speed((v1, v2)) > 0.0)
        self._push()

    def _push(self) -> None:
        """Let those stops push of which the law asks it."""
        pars = self.integrator.pars
        beyond = (pars[STOPS::2] > 0.0).tolist()
        if any(beyond):
            q1, q2, v1, v2 = self.integrator.state[:4].tolist()
            forces, _ = self._model.pushed(self._terms, self._motor, (q1, q2), (v1, v2), beyond)
            pars[STOPS + 1 :: 2] = [float(force > 0.0) for force in forces]
        else:
            pars[STOPS + 1 :: 2] = 0.0

    def read(self, state: LegState) -> LegState:
        """The state reached, with what the regime of `state` does not change."""
        if self._variation is None:
            elapsed = float(self.integrator.time)
            q1, q2, v1, v2 = self.integrator.state.tolist()
        else:
            until = self._until - self._began
            elapsed, (q1, q2, v1, v2) = self._variation.end(until, self._event)
        q, v = (q1, q2), (v1, v2)
        (x, z), (dx, dz) = self._point, self._drift
        if self._falls:
            fallen = self._falls * elapsed
            x, z = x + dx * elapsed, z + (dz - 0.5 * fallen) * elapsed
            dz = dz - fallen
        ops, along = self._model.ops, self._along
        inner, inner_vel = sweep(ops, q, along), sweep_rate(ops, q, v, along)
        self._last = LegState(
            # The end to the last bit, or whoever waits for it waits for ever.
            time=self._until if self._event is None else self._began + elapsed,
            regime=state.regime,
            q=q,
            v=v,
            trunk_pos=(x - inner[0], z - inner[1]),
            trunk_vel=(dx - inner_vel[0], dz - inner_vel[1]),
            since=state.since,
        )
        return self._last
