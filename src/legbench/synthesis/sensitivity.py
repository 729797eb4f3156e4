"""Bounds that hold the optimum back, and the price of each.

At a constrained optimum the objective's gradient is balanced by the active bounds and by the
margins that have become zero. Those forces are the multipliers: the objective that is gained per
unit by which a bound is moved outwards. Each is checked by moving the bound and optimising again.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize

from legbench.design.dependent import MARGINS, cost, margins, objective, solve_dependent
from legbench.design.requirements import VARIABLES, Bounds, Requirements
from legbench.errors import DesignError
from legbench.signals import Floats

AT_BOUND = 1e-6
"""Distance from a bound within which it holds a variable, as a share of the bounds' width [-]."""
AT_MARGIN = 1e-5
"""Value of a margin below which it holds the optimum [-]."""
MARGIN_KEPT = 1e-7
"""Value that the local search keeps of every margin, so that its result is a leg [-]."""
STEP = 1e-3
"""Share of the bounds' width by which a bound is moved to check its multiplier [-]."""
IMAGINARY = 1e-30
"""Length of the complex step, by which a derivative has no cancellation [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ActiveBound:
    """A bound that the optimum lies on."""

    variable: str
    """A decision variable, or one of `MARGINS`."""
    side: str
    """`lower`, `upper`, or `zero` for a margin."""
    value: float
    """Value of the bound [-]."""
    gain: float
    """Objective gained per unit by which the bound moves outwards: the multiplier [-]."""
    gain_measured: float
    """Gain found by optimising again with the bound moved [-]; NaN for margins."""


def refine(requirements: Requirements, free: Floats) -> Floats:
    """The optimum near `free` (7,) to rounding: the bounds it touches exactly, the rest locally.

    Returns `free` itself where the local search finds nothing better.
    """
    bounds = requirements.bounds
    width = bounds.upper - bounds.lower
    low, high = np.zeros(len(width)), np.ones(len(width))

    def at(unit: Floats) -> Floats:
        return bounds.lower + unit * width

    def value(unit: Floats) -> float:
        return float(_objective(requirements, at(unit)))

    def slope(unit: Floats) -> Floats:
        return _gradient(requirements, at(unit)) * width

    def kept(unit: Floats) -> Floats:
        return _margins(requirements, at(unit)) - MARGIN_KEPT

    def kept_slope(unit: Floats) -> Floats:
        return _margin_gradients(requirements, at(unit)) * width

    start = np.clip((free - bounds.lower) / width, 0.0, 1.0)
    result = minimize(
        value,
        start,
        jac=slope,
        bounds=np.stack((low, high), axis=-1),
        constraints={"type": "ineq", "fun": kept, "jac": kept_slope},
        method="SLSQP",
        options={"ftol": 1e-16, "maxiter": 200},
    )
    unit = np.clip(result.x, 0.0, 1.0)
    unit = np.where(unit < AT_BOUND, 0.0, np.where(unit > 1.0 - AT_BOUND, 1.0, unit))
    refined = np.where(unit == 1.0, bounds.upper, at(unit))
    better = float(cost(requirements, refined)) <= float(cost(requirements, free)) + 1e-12
    return refined if better else free


def active_bounds(requirements: Requirements, free: Floats) -> tuple[ActiveBound, ...]:
    """The bounds and margins that hold the optimum `free` (7,), the dearest first."""
    bounds = requirements.bounds
    width = bounds.upper - bounds.lower
    identity = np.eye(len(VARIABLES))
    inward: list[Floats] = []
    found: list[tuple[str, str, float]] = []
    for index, name in enumerate(VARIABLES):
        for side, edge, sign in (("lower", bounds.lower, 1.0), ("upper", bounds.upper, -1.0)):
            if abs(free[index] - edge[index]) <= AT_BOUND * width[index]:
                inward.append(sign * identity[index])
                found.append((name, side, float(edge[index])))
    small = np.flatnonzero(_margins(requirements, free) < AT_MARGIN)
    gradients = _margin_gradients(requirements, free)
    for index in small:
        inward.append(gradients[index])
        found.append((MARGINS[index], "zero", 0.0))
    if not found:
        return ()
    matrix = np.stack(inward, axis=-1)
    forces, *_ = np.linalg.lstsq(matrix, _gradient(requirements, free), rcond=None)
    rows = [
        ActiveBound(
            variable=name,
            side=side,
            value=value,
            gain=float(force),
            gain_measured=_measured(requirements, free, name, side),
        )
        for (name, side, value), force in zip(found, forces, strict=True)
    ]
    return tuple(sorted(rows, key=lambda row: -row.gain))


def moved(requirements: Requirements, name: str, side: str, by: float) -> Requirements:
    """Requirements with one bound moved outwards by `by` (inwards if negative) [-].

    Raises:
        DesignError: no ratio can lie there.
    """
    bound = getattr(requirements.bounds, name)
    value = getattr(bound, side) + (by if side == "upper" else -by)
    start = min(bound.start, value) if side == "upper" else max(bound.start, value)
    bounds: Bounds = replace(
        requirements.bounds, **{name: replace(bound, **{side: value, "start": start})}
    )
    return replace(requirements, bounds=bounds)


def _measured(requirements: Requirements, free: Floats, name: str, side: str) -> float:
    """Gain per unit from optimising with the bound a step further in and a step further out.

    One-sided where no ratio can lie further out.
    """
    if side == "zero":
        return float("nan")
    bound = getattr(requirements.bounds, name)
    step = STEP * (bound.upper - bound.lower)
    moves, values = [], []
    for by in (step, 0.0, -step):
        try:
            other = moved(requirements, name, side, by)
        except DesignError:
            continue
        near = np.clip(free, other.bounds.lower, other.bounds.upper)
        moves.append(by)
        values.append(float(cost(other, refine(other, near))))
    return (values[-1] - values[0]) / (moves[0] - moves[-1])


def _objective(requirements: Requirements, free: Floats) -> Floats:
    return objective(requirements, solve_dependent(requirements, free))


def _margins(requirements: Requirements, free: Floats) -> Floats:
    return margins(requirements, solve_dependent(requirements, free))


def _stepped(free: Floats) -> Any:
    """`free` seven times, each with an imaginary step in one variable (7, 7), complex."""
    return free + 1j * IMAGINARY * np.eye(len(free))


def _gradient(requirements: Requirements, free: Floats) -> Floats:
    """Exact gradient of objective (11) by the ratios (7,)."""
    return _objective(requirements, _stepped(free)).imag / IMAGINARY


def _margin_gradients(requirements: Requirements, free: Floats) -> Floats:
    """Exact gradients of the margins by the ratios (n, 7)."""
    return _margins(requirements, _stepped(free)).imag.T / IMAGINARY
