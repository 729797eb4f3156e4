"""Curves of solutions: n equations in n + 1 unknowns, followed by pseudo-arclength.

Newton's method solves the equations together with one row that fixes how far along the last
tangent the next solution lies. So a curve is followed through turning points, where no single
unknown would do as a parameter.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from legbench.signals import Floats

Equations = Callable[[Floats], tuple[Floats, Floats]]
"""Residual (n,) of unknowns (n + 1,), and its derivative (n, n + 1); a residual that is not finite
where there is nothing to solve."""
NEWTON = 12
"""Number of iterations after which a step is given up and halved."""
FARTHEST = 0.5
"""Largest change of an unknown in one iteration; beyond it Newton's method is lost."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Solution:
    """One point of a curve."""

    unknown: Floats
    """(n + 1,)"""
    slope: Floats
    """Derivative of the equations there (n, n + 1)."""
    tangent: Floats
    """Unit vector along the curve (n + 1,)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stride:
    """Lengths of the steps along a curve, in its scaled unknowns."""

    first: float = 0.05
    longest: float = 0.05
    shortest: float = 1e-4
    """Length below which the curve has ended."""
    most: int = 60
    """Largest number of solutions, the first included."""


def correct(
    equations: Equations,
    guess: Floats,
    row: Floats,
    value: float,
    tolerance: float,
    *,
    stiff: float = 0.0,
) -> Solution | None:
    """Newton's method on the equations and `row . unknown = value`; none if it does not converge.

    Directions that the equations feel less than `stiff` times the most that they feel are left
    alone: near a branch point there is one, and the exact solution may lie far away along it.
    """
    unknown = guess.copy()
    for _ in range(NEWTON):
        residual, slope = equations(unknown)
        wrong = np.append(residual, row @ unknown - value)
        if not np.all(np.isfinite(wrong)):
            return None
        if np.max(np.abs(wrong)) < tolerance:
            return Solution(unknown=unknown, slope=slope, tangent=tangent_of(slope, row))
        change = np.linalg.lstsq(np.vstack([slope, row]), wrong, rcond=stiff)[0]
        if not np.all(np.isfinite(change)) or np.max(np.abs(change)) > FARTHEST:
            return None
        unknown = unknown - change
    return None


def tangent_of(slope: Floats, along: Floats) -> Floats:
    """Unit vector (n + 1,) that the derivative (n, n + 1) maps to zero, on the side of `along`."""
    tangent = np.linalg.svd(slope)[2][-1]
    return tangent if tangent @ along >= 0.0 else -tangent


AGAIN = "a shorter step"
"""Answer of a visitor who refuses a solution but may take one that is nearer."""
MANY = "as many as were asked for"
"""End of a curve with the largest number of solutions."""
LOST = "no solution continues it"
"""End of a curve that Newton's method does not get beyond."""
Visit = Callable[[Solution], str | None]
"""Called with every solution: None to go on, `AGAIN`, or why the curve ends with it."""


def trace(
    equations: Equations, first: Solution, stride: Stride, tolerance: float, visit: Visit
) -> str:
    """Follow a curve from its first solution on, which is not visited; says why it ended.

    That is what the visitor said, `MANY`, `LOST`, or `AGAIN` once steps are too short for another
    solution.
    """
    last, step = first, stride.first
    for _ in range(stride.most - 1):
        found, said = _next(equations, last, step, tolerance, visit)
        while said in (AGAIN, LOST):
            step *= 0.5
            if step < stride.shortest:
                return said
            found, said = _next(equations, last, step, tolerance, visit)
        if said is not None:
            return said
        last, step = found, min(1.3 * step, stride.longest)
    return MANY


def _next(
    equations: Equations, last: Solution, step: float, tolerance: float, visit: Visit
) -> tuple[Solution, str | None]:
    """The solution a step further, or the last one, and what the visitor said of it."""
    row = last.tangent
    value = float(row @ last.unknown) + step
    found = correct(equations, last.unknown + step * row, row, value, tolerance)
    return (last, LOST) if found is None else (found, visit(found))
