"""Flow of the two angles without events, and its derivatives, from which orbits are computed.

One integrator serves every leg and every way of holding it, because inertias, gravity, springs,
dampers and motors are parameters of it at run time. Joint stops do not act; the caller has to
check whether an orbit stays within them.
"""

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from legbench.analytic import equations
from legbench.analytic.compiled import free_integrator, varied_integrator
from legbench.analytic.course import TIME_LIMIT
from legbench.analytic.equations import Pair
from legbench.analytic.parameters import DAMPING, MOTOR, PUSHES, SMOOTH
from legbench.errors import ConfigError
from legbench.modes.scene import Scene
from legbench.signals import Floats

STATES = 4
"""Number of states, two angles and their rates [-]."""
TOLERANCE = 1e-15
"""Largest error of a step over the size of the state [-]."""
MAX_STEPS = 20_000
"""Largest number of steps of one integration [-]; an orbit takes some hundred."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Carried:
    """State after some time, and its derivatives by the start and by the parameters."""

    end: Floats
    """Final state q1, q2, v1, v2 (4,) [rad, rad/s]."""
    by_start: Floats
    """Derivative by the state at the start (4, 4)."""
    by_parameters: Floats
    """Derivative by the parameters: inertias (2), coupling, gravity (2), stiffness (2), damping
    (2), motors (2) (4, 11)."""
    rate: Floats
    """Time derivative of the state at the end (4,)."""


@final
class Carrier:
    """Integrator of the flow of one leg.

    Args:
        scene: the leg and how it is held.
        damping: of both joints [N m s/rad]; none by default.
    """

    def __init__(self, scene: Scene, damping: Pair = (0.0, 0.0)) -> None:
        self.scene = scene
        self.damping: Floats = np.array(damping)
        self._varied, self._free = varied_integrator(TOLERANCE), free_integrator(TOLERANCE)
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
        integrator = self._load(self._varied, start, extra, motor)
        # The identity is the derivative by the start.
        integrator.state[STATES:] = np.eye(STATES, STATES + SMOOTH).ravel()
        integrator.pars[PUSHES:] = 0.0
        outcome = int(integrator.propagate_until(float(time), MAX_STEPS)[0])
        state = integrator.state.copy()
        if outcome != TIME_LIMIT or not np.all(np.isfinite(state)):
            raise ConfigError(f"the leg cannot be followed for {time:.3g} s: it runs away")
        slopes = state[STATES:].reshape(STATES, STATES + SMOOTH)
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
        integrator = self._load(self._free, start, extra, motor)
        outcome, *_, states = integrator.propagate_grid(times)
        if int(outcome) != TIME_LIMIT:
            raise ConfigError(f"the leg cannot be followed for {times[-1]:.3g} s: it runs away")
        return np.asarray(states)

    def _load(self, integrator: Any, start: Floats, extra: float, motor: Floats | None) -> Any:
        """Set an integrator to a start and to the parameters of the leg."""
        integrator.time = 0.0
        integrator.state[:STATES] = start
        integrator.pars[:SMOOTH] = self._parameters
        integrator.pars[DAMPING:MOTOR] += extra
        if motor is not None:
            integrator.pars[MOTOR:SMOOTH] = motor
        return integrator
