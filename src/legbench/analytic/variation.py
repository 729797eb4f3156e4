"""How the end of an integration moves with its beginning: heyoka's variational equations.

Along the way the compiled integrator carries the derivative of the state by the state at the
start. At the end comes what a shift of the end's time adds: an event happens where its function
vanishes, so the function's own derivatives say by how much the event shifts. Chained over events
this is the product of transition and saltation matrices.
"""

from typing import Any, final

import numpy as np

from legbench.analytic._heyoka import heyoka as hy
from legbench.analytic.dual import Dual, gradient
from legbench.signals import Floats


@final
class Variation:
    """Derivatives along one compiled integrator of n states, of any number of seeds m."""

    def __init__(self, integrator: Any, system: list[Any], events: list[Any], pars: int) -> None:
        self._integrator, self._size, self._pars = integrator, len(system), pars
        time = hy.make_vars("t")
        variables = [*(variable for variable, _ in system), time]
        sources = [*variables, *(hy.par[index] for index in range(pars))]
        timed = [hy.subs(event, {hy.time: time}) for event in events]
        slopes = [hy.diff(event, source) for event in timed for source in sources]
        self._slopes = hy.cfunc([rate for _, rate in system] + slopes, vars=variables)
        self._start: list[float] = []
        self._levels: list[float] = []

    def begin(self, start: list[float]) -> None:
        """Differentiate from here on; the numbers of `start` may be dual."""
        self._start = start
        self._integrator.state[self._size :] = np.eye(self._size).ravel()

    def set(self, pars: list[float]) -> None:
        """Parameters of the events, which may be dual; motors may not."""
        self._levels = pars

    def end(self, elapsed: float, event: int | None) -> tuple[Dual, list[Dual]]:
        """Time since the beginning and state there, both dual.

        `elapsed` is when the integration was to end, unless an event ended it.
        """
        integrator, size = self._integrator, self._size
        state, time = integrator.state[:size], float(integrator.time)
        values = self._slopes(np.append(state, time), pars=integrator.pars)
        rates, slopes = values[:size], values[size:].reshape(-1, size + 1 + self._pars)
        moved = integrator.state[size:].reshape(size, size) @ _gradients(self._start)
        if event is None:
            shift = gradient(elapsed)
        else:
            by_state, by_time, by_pars = np.split(slopes[event], (size, size + 1))
            change = by_state @ moved + by_pars[: len(self._levels)] @ _gradients(self._levels)
            shift = -change / (by_state @ rates + by_time[0])
        ends = moved + np.multiply.outer(rates, shift)
        return Dual(time, shift), [
            Dual(x, row) for x, row in zip(state.tolist(), ends, strict=True)
        ]


def _gradients(values: list[float]) -> Floats:
    """Gradients of several numbers, one a row (n, m)."""
    return np.stack(np.broadcast_arrays(*(gradient(value) for value in values)))
