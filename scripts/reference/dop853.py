"""Dormand and Prince's method of order 8(5,3) on many initial value problems at once.

Each problem is one column of the state, with a step and an error control of its own; the columns
share nothing but the calls of NumPy. Coefficients, error estimate, step control and dense output
are those of Hairer, Norsett and Wanner, "Solving Ordinary Differential Equations I", section II.10,
as in `scipy.integrate.DOP853`, so that one column takes the steps that scipy would take.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.integrate._ivp import dop853_coefficients as table

from legbench.signals import Bools, Floats, Ints

Rates = Callable[[Floats], Floats]
"""Time derivative of the states (m, n) of n problems that do not depend on time themselves."""

STAGES, EXTENDED = table.N_STAGES, table.N_STAGES_EXTENDED
A, B, E3, E5, D = table.A, table.B, table.E3, table.E5, table.D
"""Published coefficients; the last three rows of A are the stages of dense output [-]."""
SAFETY, SLOWEST, FASTEST = 0.9, 0.2, 10.0
"""Factor below the step that the error allows, and smallest and largest change of a step [-]."""


class Accuracy(NamedTuple):
    """Tolerances of the integration, per component."""

    relative: float = 1e-11
    """Error of a step over the state [-]."""
    absolute: float = 1e-13
    """Error of a step, in units of the state."""


class Attempt(NamedTuple):
    """One step of every problem, accepted or not."""

    slopes: Floats
    """Derivatives at the stages, and at both ends of the step (16, m, n); dense output fills the
    last three."""
    reached: Floats
    """States at the end of the step (m, n)."""
    accepted: Bools
    """Whether the error of the step is within the tolerances (n,)."""
    factor: Floats
    """Length of the next step over that of this one (n,)."""


class Dense(NamedTuple):
    """Interpolant of order 7 over one step of n problems."""

    start: Floats
    """States at the beginning of the step (m, n)."""
    terms: Floats
    """Coefficients of the nested polynomial (7, m, n)."""

    def at(self, share: Floats) -> Floats:
        """States (m, n) of each problem at a share (n,) of its step."""
        state = np.zeros_like(self.start)
        for place, term in enumerate(self.terms[::-1]):
            state = (state + term) * (share if place % 2 == 0 else 1.0 - share)
        return self.start + state

    def looks(self, shares: Floats) -> Floats:
        """States (m, k, n) of all problems at the same k shares of their steps."""
        weights, weight = np.empty((len(shares), len(self.terms))), np.ones(len(shares))
        for place in range(len(self.terms)):
            weight = weight * (shares if place % 2 == 0 else 1.0 - shares)
            weights[:, place] = weight
        count, size = self.start.shape
        moved = weights @ self.terms.reshape(len(self.terms), count * size)
        return self.start[:, np.newaxis] + moved.reshape(-1, count, size).swapaxes(0, 1)

    def take(self, columns: Ints) -> "Dense":
        """Interpolant of some of the problems."""
        return Dense(self.start[:, columns], self.terms[:, :, columns])


def attempt(rates: Rates, state: Floats, step: Floats, accuracy: Accuracy) -> Attempt:
    """Try one step of each problem: states (m, n), lengths (n,)."""
    count, size = state.shape
    slopes = np.empty((EXTENDED, count, size))
    flat = slopes.reshape(EXTENDED, count * size)
    slopes[0] = rates(state)
    for stage in range(1, STAGES):
        moved = (A[stage, :stage] @ flat[:stage]).reshape(count, size)
        slopes[stage] = rates(state + moved * step)
    reached = state + (B @ flat[:STAGES]).reshape(count, size) * step
    slopes[STAGES] = rates(reached)
    scale = accuracy.absolute + np.maximum(np.abs(state), np.abs(reached)) * accuracy.relative
    fifth = (E5 @ flat[: STAGES + 1]).reshape(count, size) / scale
    third = (E3 @ flat[: STAGES + 1]).reshape(count, size) / scale
    squares, cubes = np.sum(fifth * fifth, axis=0), np.sum(third * third, axis=0)
    whole = np.sqrt((squares + 0.01 * cubes) * count)
    error = step * squares / np.where(whole > 0.0, whole, 1.0)
    with np.errstate(divide="ignore"):
        factor = np.clip(SAFETY * error**-0.125, SLOWEST, FASTEST)
    return Attempt(slopes, reached, error < 1.0, factor)


def dense(rates: Rates, state: Floats, step: Floats, tried: Attempt) -> Dense:
    """Interpolant of accepted steps, which costs three more derivatives."""
    slopes, (count, size) = tried.slopes, state.shape
    flat = slopes.reshape(EXTENDED, count * size)
    for stage in range(STAGES + 1, EXTENDED):
        moved = (A[stage, :stage] @ flat[:stage]).reshape(count, size)
        slopes[stage] = rates(state + moved * step)
    change, first, last = tried.reached - state, slopes[0] * step, slopes[STAGES] * step
    terms = np.empty((7, count, size))
    terms[:3] = change, first - change, 2.0 * change - (last + first)
    terms[3:] = (D @ flat).reshape(4, count, size) * step
    return Dense(state, terms)
