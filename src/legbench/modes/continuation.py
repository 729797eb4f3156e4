"""Curves of solutions: n equations in n + 1 unknowns, followed by pseudo-arclength.

Newton's method solves the equations together with one row that fixes how far along the last
tangent the next solution lies. So a curve is followed through turning points, where no single
unknown can be the parameter.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from legbench.signals import Floats

Equations = Callable[[Floats], tuple[Floats, Floats]]
"""Residual (n,) of unknowns (n + 1,), and its derivative (n, n + 1); a residual that is not finite
where there is nothing to solve."""
NEWTON = 12
"""Number of iterations after which a step is given up and halved."""
FARTHEST = 0.5
"""Largest change of an unknown in one iteration; a larger one ends Newton's method."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CurvePoint:
    """One point of a curve."""

    unknown: Floats
    """Unknowns of the solution (n + 1,)."""
    slope: Floats
    """Derivative of the equations there (n, n + 1)."""
    tangent: Floats
    """Unit vector along the curve (n + 1,)."""

    def towards(self, along: Floats) -> "CurvePoint":
        """This solution with its tangent on the side of `along` (n + 1,)."""
        return replace(self, tangent=tangent_of(self.slope, along))


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
) -> CurvePoint | None:
    """Newton's method on the equations and `row . unknown = value`; None if it does not converge.

    Directions whose singular value is below `stiff` times the largest one are not corrected: near a
    branch point there is one, and the exact solution may lie far away along it.
    """
    unknown = guess.copy()
    for _ in range(NEWTON):
        residual, slope = equations(unknown)
        wrong = np.append(residual, row @ unknown - value)
        if not np.all(np.isfinite(wrong)):
            return None
        if np.max(np.abs(wrong)) < tolerance:
            return CurvePoint(unknown=unknown, slope=slope, tangent=tangent_of(slope, row))
        change = np.linalg.lstsq(np.vstack([slope, row]), wrong, rcond=stiff)[0]
        if not np.all(np.isfinite(change)) or np.max(np.abs(change)) > FARTHEST:
            return None
        unknown = unknown - change
    return None


def tangent_of(slope: Floats, along: Floats) -> Floats:
    """Unit vector (n + 1,) that the derivative (n, n + 1) maps to zero, on the side of `along`."""
    tangent = np.linalg.svd(slope)[2][-1]
    return tangent if tangent @ along >= 0.0 else -tangent


@dataclass(frozen=True, slots=True)
class Refused:
    """Answer of a visitor that refuses a solution but may accept one after a shorter step."""

    why: str
    """Reason why the curve ends if no shorter step helps."""


MANY = "as many as were asked for"
"""Reason of the end of a curve that has the largest number of solutions."""
LOST = "no solution continues it"
"""Reason of the end of a curve beyond which Newton's method does not converge."""
Answer = str | Refused | None
"""Answer to a solution: None to go on, a refusal, or the reason why the curve ends with it."""
Visit = Callable[[CurvePoint], Answer]
"""Function that is called with every solution."""


def trace(
    equations: Equations, first: CurvePoint, stride: Stride, tolerance: float, visit: Visit
) -> str:
    """Follow a curve from its first solution on, which is not visited; return why it ended.

    The reason is the visitor's, also that of a refusal once steps are too short, or `MANY`, or
    `LOST`.
    """
    last, step = first, stride.first
    for _ in range(stride.most - 1):
        found, said = _next(equations, last, step, tolerance, visit)
        while isinstance(said, Refused) or said == LOST:
            step *= 0.5
            if step < stride.shortest:
                return said.why if isinstance(said, Refused) else said
            found, said = _next(equations, last, step, tolerance, visit)
        if said is not None:
            return said
        last, step = found, min(1.3 * step, stride.longest)
    return MANY


def _next(
    equations: Equations, last: CurvePoint, step: float, tolerance: float, visit: Visit
) -> tuple[CurvePoint, Answer]:
    """Solution one step further, or the last one, and the visitor's answer to it."""
    row = last.tangent
    value = float(row @ last.unknown) + step
    found = correct(equations, last.unknown + step * row, row, value, tolerance)
    return (last, LOST) if found is None else (found, visit(found))
