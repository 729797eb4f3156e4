"""Zeros of few equations, without the seconds that a library of optimisers takes to load."""

from collections.abc import Callable

import numpy as np

from legbench.signals import Floats

NUDGE = 1e-6
"""Step of the central differences [-]."""
ITERATIONS = 60
"""Steps after which a search is given up [-]."""
HALVINGS = 12
"""Number of times that a step is halved that leads uphill [-]."""


def bracketed(function: Callable[[float], float], low: float, high: float, width: float) -> float:
    """Zero of a function between two points at which its signs differ.

    Regula falsi with Illinois weights, and halving where that is slow.

    Args:
        function: continuous between the points.
        low: one point.
        high: the other.
        width: width of the bracket at which the search ends.

    Raises:
        ValueError: both signs are the same.
    """
    first, second = function(low), function(high)
    if first * second > 0.0:
        raise ValueError(f"the function has the same sign at {low:g} and {high:g}")
    best = low if abs(first) < abs(second) else high
    for count in range(200):
        if first == 0.0 or second == 0.0 or abs(high - low) <= width:
            break
        middle = (
            0.5 * (low + high)
            if count % 3 == 2
            else high - second * (high - low) / (second - first)
        )
        value = function(middle)
        best = middle
        if value * second <= 0.0:
            low, first = high, second
        else:
            first *= 0.5
        high, second = middle, value
    return low if first == 0.0 else high if second == 0.0 else best


def solved(function: Callable[[Floats], Floats], guess: Floats, small: float) -> Floats:
    """Zero of n equations near a guess (n,), by Newton's method on central differences.

    Steps are halved until they lead downhill; a function that is NaN somewhere is uphill there.
    Returns the best point found, whether or not it is within `small` of zero.
    """
    at, value = guess, function(guess)
    for _ in range(ITERATIONS):
        size = float(np.max(np.abs(value)))
        if not size > small:
            break
        columns = [
            (function(at + NUDGE * axis) - function(at - NUDGE * axis)) / (2.0 * NUDGE)
            for axis in np.eye(len(at))
        ]
        slope = np.stack(columns, axis=-1)
        if not np.all(np.isfinite(slope)):
            break
        step = np.linalg.lstsq(slope, value, rcond=1e-12)[0]
        for halving in range(HALVINGS):
            there = at - 0.5**halving * step
            value_there = function(there)
            if np.max(np.abs(value_there)) < size:
                at, value = there, value_there
                break
        else:
            break
    return at
