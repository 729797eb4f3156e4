"""Flow of the two angles between events, with its derivatives: what every periodic orbit is made of.

One integrator serves every leg and every way of holding it, because inertias, gravity, springs,
dampers and motors are parameters of it at run time. Joint stops do not act; who asks for an orbit
says whether it stays within them.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any, final

import numpy as np

from legbench.analytic import equations
from legbench.analytic._heyoka import SYMBOLS
from legbench.analytic._heyoka import heyoka as hy
from legbench.analytic.equations import Pair
from legbench.analytic.terms import PairTerms
from legbench.errors import ConfigError
from legbench.modes.scene import Scene
from legbench.signals import Floats

STIFFNESS, DAMPING, MOTOR, PARAMETERS = 5, 7, 9, 11
"""Places of springs, dampers and motors among the parameters, and how many there are [-]."""
STATES = 4
TOLERANCE = 1e-14
"""Error of a step over the size of the state [-]."""
MAX_STEPS = 20_000
"""Largest number of steps of one integration [-]; an orbit takes some hundred."""
TIME_LIMIT = int(hy.taylor_outcome.time_limit)


@dataclass(frozen=True, slots=True, kw_only=True)
class Carried:
    """Where a state has come to, and how that depends on where and how it began."""

    end: Floats
    """q1, q2, v1, v2 (4,) [rad, rad/s]."""
    by_start: Floats
    """Derivative by the state at the start (4, 4)."""
    by_parameters: Floats
    """Derivative by the parameters: inertias (2), coupling, gravity (2), stiffness (2), damping
    (2), motors (2) (4, 11)."""
    rate: Floats
    """Time derivative of the state at the end (4,)."""


@final
class Carrier:
    """A leg of a scene, on its way.

    Args:
        scene: the leg and how it is held.
        damping: of both joints [N m s/rad]; none by default.
    """

    def __init__(self, scene: Scene, damping: Pair = (0.0, 0.0)) -> None:
        self.scene = scene
        self.damping: Floats = np.array(damping)
        terms = scene.terms
        self._parameters = np.array(
            [
                *terms.inertia,
                terms.coupling,
                *terms.moment,
                *scene.model.stiffness,
                *damping,
                *scene.motor,
            ]
        )

    def rates(self, state: Floats, extra: float = 0.0, motor: Floats | None = None) -> Floats:
        """Time derivative (4,) of a state (4,), both dampers `extra` [N m s/rad] stronger."""
        q1, q2, v1, v2 = state.tolist()
        model, held = self.scene.model, self.scene.motor if motor is None else motor
        torque = equations.damped(
            equations.spring_torque(model.stiffness, (held[0], held[1]), (q1, q2)),
            (self.damping[0] + extra, self.damping[1] + extra),
            (v1, v2),
        )
        a = equations.pair_acceleration(
            equations.SCALAR, self.scene.terms, (q1, q2), (v1, v2), torque
        )
        return np.array([v1, v2, *a])

    def carry(
        self, start: Floats, time: float, *, extra: float = 0.0, motor: Floats | None = None
    ) -> Carried:
        """Follow a state (4,) for a time [s], both dampers `extra` [N m s/rad] stronger.

        The motors stand at `motor` (2,) [rad], by default where the scene has them.

        Raises:
            ConfigError: the leg runs away from there.
        """
        integrator = _varied()
        self._load(integrator, start, extra, motor)
        outcome = int(integrator.propagate_until(float(time), MAX_STEPS)[0])
        state = integrator.state.copy()
        if outcome != TIME_LIMIT or not np.all(np.isfinite(state)):
            raise ConfigError(f"the leg cannot be followed for {time:.3g} s: it runs away")
        slopes = state[STATES:].reshape(STATES, STATES + PARAMETERS)
        return Carried(
            end=state[:STATES],
            by_start=slopes[:, :STATES],
            by_parameters=slopes[:, STATES:],
            rate=self.rates(state[:STATES], extra, motor),
        )

    def path(
        self,
        start: Floats,
        times: Floats,
        *,
        extra: float = 0.0,
        motor: Floats | None = None,
    ) -> Floats:
        """States (n, 4) at times (n,) that rise from 0 [s].

        Raises:
            ConfigError: the leg runs away from there.
        """
        integrator = _plain()
        self._load(integrator, start, extra, motor)
        outcome, *_, states = integrator.propagate_grid(times)
        if int(outcome) != TIME_LIMIT:
            raise ConfigError(f"the leg cannot be followed for {times[-1]:.3g} s: it runs away")
        return np.asarray(states)

    def _load(
        self, integrator: Any, start: Floats, extra: float, motor: Floats | None
    ) -> None:
        integrator.time = 0.0
        integrator.state[:STATES] = start
        if integrator.state.size > STATES:
            integrator.state[STATES:] = np.eye(STATES, STATES + PARAMETERS).ravel()
        integrator.pars[:] = self._parameters
        integrator.pars[DAMPING:MOTOR] += extra
        if motor is not None:
            integrator.pars[MOTOR:PARAMETERS] = motor


def _system() -> list[Any]:
    q, v = hy.make_vars("q1", "q2"), hy.make_vars("v1", "v2")
    par = [hy.par[place] for place in range(PARAMETERS)]
    terms = PairTerms(inertia=(par[0], par[1]), coupling=par[2], moment=(par[3], par[4]))
    spring = equations.spring_torque((par[5], par[6]), (par[9], par[10]), (q[0], q[1]))
    torque = equations.damped(spring, (par[7], par[8]), (v[0], v[1]))
    a = equations.pair_acceleration(SYMBOLS, terms, (q[0], q[1]), (v[0], v[1]), torque)
    return [(q[0], v[0]), (q[1], v[1]), (v[0], a[0]), (v[1], a[1])]


@cache
def _varied() -> Any:
    seeds = [*hy.make_vars("q1", "q2", "v1", "v2"), *(hy.par[place] for place in range(PARAMETERS))]
    return hy.taylor_adaptive(
        hy.var_ode_sys(_system(), seeds),
        [0.0] * STATES,
        tol=TOLERANCE,
        compact_mode=True,
    )


@cache
def _plain() -> Any:
    return hy.taylor_adaptive(_system(), [0.0] * STATES, tol=TOLERANCE)
