"""The conservative flow of two angles and its derivatives, on the compiled leg.

Step size and order are chosen for the derivatives as well as for the state: both are integrated to
the same tolerance.
"""

from functools import lru_cache
from typing import Any

import numpy as np

from legbench.analytic import Regime
from legbench.analytic.compiled import event_integrator, parameters_of, varied_integrator
from legbench.analytic.places import MOTOR, PROBE, SMOOTH, Kind
from legbench.design.statics import Support
from legbench.errors import ConfigError
from legbench.modes.scene import SUPPORTED, Scene
from legbench.signals import Floats

MAX_STEPS = 100_000
"""Largest number of steps of one integration [-]; a leg takes about a hundred a second."""
STATES = 4


def flow(scene: Scene, start: Floats, time: float, directions: Floats) -> tuple[Floats, Floats]:
    """State (4,) after `time` [s], and its derivative along each of `directions` (4, n).

    Raises:
        ConfigError: the leg runs away from there.
    """
    _, varied = _integrators(scene)
    varied.time = 0.0
    varied.state[:STATES] = start
    varied.state[STATES:] = np.eye(STATES, STATES + SMOOTH).ravel()
    varied.propagate_until(time, MAX_STEPS)
    slope = varied.state[STATES:].reshape(STATES, -1)[:, :STATES]
    _check(varied, time)
    return varied.state[:STATES].copy(), slope @ directions


def orbit(scene: Scene, posture: Floats, time: float, count: int) -> Floats:
    """Postures (count, 2) over `time` [s] of a leg let go at rest from `posture` (2,)."""
    plain, _ = _integrators(scene)
    plain.time = 0.0
    plain.state[:] = (*posture, 0.0, 0.0)
    found = plain.propagate_grid(np.linspace(0.0, time, count), MAX_STEPS)
    _check(plain, time)
    return np.asarray(found[-1])[:, :2]


def _check(integrator: Any, time: float) -> None:
    if not np.all(np.isfinite(integrator.state)) or integrator.time != time:
        raise ConfigError(f"the leg cannot be followed for {time:.3g} s: the state runs away")


@lru_cache(maxsize=8)
def _integrators(scene: Scene) -> tuple[Any, Any]:
    """Integrators of this leg: the state alone, and with derivatives."""
    stands = SUPPORTED[scene.kind] is Support.FOOT
    regime = Regime.PINNED if stands else Regime.HANGING
    values = parameters_of(scene.model, regime, (0.0, 0.0))
    values[MOTOR : MOTOR + 2] = scene.motor
    plain, varied = event_integrator(Kind.FIXED), varied_integrator()
    plain.pars[:] = values[: len(plain.pars)]
    varied.pars[:] = values[:PROBE]
    return plain, varied
