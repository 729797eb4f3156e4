"""Integration between events, with scipy's embedded Runge-Kutta pairs."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.integrate import DOP853, RK45, OdeSolver

from legbench.analytic.contact import MIN_PHASE
from legbench.errors import ConfigError, PlantFault
from legbench.signals import Floats

Rates = Callable[[float, Floats], list[float]]


class RungeKutta(StrEnum):
    """Embedded Runge-Kutta pair."""

    DOP853 = "dop853"
    """Order 8 (Dormand and Prince); the default."""
    RK45 = "rk45"
    """Order 5 (Dormand and Prince), what `ode45` is."""

    @property
    def solver(self) -> Callable[..., OdeSolver]:
        """Class of scipy that integrates by this pair."""
        return DOP853 if self is RungeKutta.DOP853 else RK45


@dataclass(frozen=True, slots=True, kw_only=True)
class Accuracy:
    """Tolerances and step sizes of an integration.

    Raises:
        ConfigError: a tolerance or a time that is not positive.
    """

    method: RungeKutta = RungeKutta.DOP853
    rtol: float = 1e-9
    """Relative error per step [-]."""
    atol: float = 1e-11
    """Absolute error per step [rad, rad/s, m, m/s]."""
    max_step: float = 0.005
    """Longest step, in an eighth of which an event function crosses zero at most once [s]."""
    min_phase: float = MIN_PHASE
    """Shortest stance or flight, so that an event is not repeated by rounding [s]."""
    fixed_step: float | None = None
    """Length of steps without error control, for measuring the order; None: variable steps [s]."""

    def __post_init__(self) -> None:
        for name in ("rtol", "atol", "max_step", "min_phase", "fixed_step"):
            value = getattr(self, name)
            if value is not None and not value > 0.0:
                raise ConfigError(f"{name} is {value:g}; it must be positive")


def steps(
    rates: Rates, time: float, state: list[float], until: float, accuracy: Accuracy
) -> Iterator[OdeSolver]:
    """The solver after each of its steps from `time` to `until`.

    Raises:
        PlantFault: the step size went to zero: the state runs away.
    """
    fixed = accuracy.fixed_step
    at = time
    try:
        solver = accuracy.method.solver(
            rates,
            time,
            np.asarray(state),
            until,
            rtol=1e12 if fixed else accuracy.rtol,
            atol=1e12 if fixed else accuracy.atol,
            max_step=fixed or accuracy.max_step,
            first_step=min(fixed or 1e-3, until - time),
        )
        while solver.status == "running":
            message = solver.step()
            if solver.status == "failed":
                raise _failed(at, str(message))
            at = float(solver.t)
            yield solver
    except (ValueError, OverflowError) as error:  # sin(inf), 1e200 squared
        raise _failed(at, f"the state runs away ({error})") from error


def _failed(time: float, why: str) -> PlantFault:
    return PlantFault("integration failed", f"integration failed at t = {time:.6f} s: {why}")
