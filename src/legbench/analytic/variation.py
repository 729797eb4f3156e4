"""Derivatives of the end of a piece by its beginning, from heyoka's variational equations.

An integrator of its own carries the derivative of the state by the state at the start and by the
parameters of the leg through the piece. At the end a term is added for the shift of the end's time:
an event occurs at a zero of its function, which on dual numbers gives the shift (`Course`). Chained
over events this is the product of transition and saltation matrices.
"""

from typing import final

import numpy as np

from legbench.analytic.compiled import parameters_of, varied_integrator
from legbench.analytic.dual import Dual, gradient
from legbench.analytic.equations import SCALAR, Pair
from legbench.analytic.moving_leg import MovingLeg
from legbench.analytic.parameters import HEIGHT, MOTOR, PROBE, SMOOTH, SPEED
from legbench.analytic.readings import read
from legbench.signals import Floats

STATES = 4
"""Number of states, two angles and their rates [-]."""


@final
class Variation:
    """Derivatives along the pieces of an integration, by any number of seeds m.

    Seeds may be in the state, in the levels of events, and in the parameters of the leg.
    """

    def __init__(self, tolerance: float) -> None:
        self._integrator = varied_integrator(tolerance)

    def carry(self, leg: MovingLeg, q: Pair, v: Pair, until: float, event: int | None) -> None:
        """Carry the derivatives of a leg through a piece, and begin the next one at its end.

        Args:
            leg: dual numbers at the beginning of the piece.
            q: angles at the end [rad].
            v: rates at the end [rad/s].
            until: time at which the piece was to end [s].
            event: the event that ended it, if one did.
        """
        compiled, plain = leg.compiled, leg.plain
        time = float(leg.elapsed)
        varied = parameters_of(leg.model, leg.regime, leg.probe)[:MOTOR]
        start = [*leg.q, *leg.v]
        moved = self._moved(start, compiled.pars, time, [*varied, *leg.motor])
        torque = plain.torque(leg.plain_motor, q, v)
        a = leg.stop_switches.turns(SCALAR, leg.terms, torque, q, v)[1]
        values, rates = [*q, *v], np.array([*v, *a])
        if event is None:
            shift = gradient(until - leg.began)
        else:
            gain, level = compiled.gain[event], compiled.level[event]
            reading = read(leg, event, _duals(values, moved), time)
            change = gradient(gain * reading - level)
            timed, elapsed = _duals(values, rates[:, np.newaxis]), Dual(time, np.ones(1))
            reading = read(leg, event, timed, elapsed, plain=True)
            shift = -change / (gain * gradient(reading)[0])
        q1, q2, v1, v2 = _duals(values, moved + np.multiply.outer(rates, shift))
        leg.q, leg.v = (q1, q2), (v1, v2)
        leg.time = until if event is None else leg.began + Dual(time, shift)
        if compiled.flies:
            leg.point, leg.drift = leg.centre()
            compiled.pars[HEIGHT], compiled.pars[SPEED] = leg.point[1], leg.drift[1]
        leg.began = leg.time
        compiled.integrator.time = leg.elapsed = 0.0

    def _moved(self, start: list[float], pars: Floats, time: float, varied: list[float]) -> Floats:
        """Derivative of the state at a fixed time by the seeds (4, m).

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


def _duals(values: list[float], slopes: Floats) -> list[Dual]:
    """Numbers with their gradients, one a row (n, m)."""
    return [Dual(value, row) for value, row in zip(values, slopes, strict=True)]


def _gradients(values: list[float]) -> Floats:
    """Gradients of several numbers, one a row (n, m)."""
    return np.stack(np.broadcast_arrays(*(gradient(value) for value in values)))
