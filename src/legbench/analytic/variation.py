"""How the end of a piece moves with its beginning: heyoka's variational equations.

Along the way an integrator of its own carries the derivative of the state by the state at the
start and by the parameters of the leg. At the end comes what a shift of the end's time adds: an
event happens where its function vanishes, and the function, run on dual numbers, says by how much
the event shifts (`Course`). Chained over events this is the product of transition and saltation
matrices.
"""

from typing import final

import numpy as np

from legbench.analytic.compiled import varied_integrator
from legbench.analytic.dual import Dual, gradient
from legbench.analytic.places import PROBE, SMOOTH
from legbench.signals import Floats

STATES = 4
"""Two angles and their rates [-]."""


@final
class Variation:
    """Derivatives along the pieces of a course, by any number of seeds m.

    Seeds may be in the state, in the levels of events, and in the parameters of the leg.
    """

    def __init__(self, tolerance: float) -> None:
        self._integrator = varied_integrator(tolerance)

    def moved(self, start: list[float], pars: Floats, time: float, varied: list[float]) -> Floats:
        """How the state at a fixed time moves with the seeds (4, m).

        Args:
            start: state at the beginning of the piece (4,), which may be dual.
            pars: parameters of the integrator that has gone through the piece.
            time: length of the piece [s].
            varied: the first `SMOOTH` of the parameters, which may be dual.
        """
        integrator = self._integrator
        integrator.time = 0.0
        integrator.state[:STATES] = start
        integrator.state[STATES:] = np.eye(STATES, STATES + SMOOTH).ravel()
        integrator.pars[:] = pars[:PROBE]
        integrator.propagate_until(time)
        slope = integrator.state[STATES:].reshape(STATES, STATES + SMOOTH)
        by_state, by_pars = np.split(slope, (STATES,), axis=1)
        return by_state @ _gradients(start) + by_pars @ _gradients(varied)


def duals(values: list[float], slopes: Floats) -> list[Dual]:
    """Numbers with their gradients, one a row (n, m)."""
    return [Dual(value, row) for value, row in zip(values, slopes, strict=True)]


def _gradients(values: list[float]) -> Floats:
    """Gradients of several numbers, one a row (n, m)."""
    return np.stack(np.broadcast_arrays(*(gradient(value) for value in values)))
