"""First zeros and largest values of many functions at once, each on a bracket of its own."""

from collections.abc import Callable

import numpy as np

from legbench.signals import Floats

Function = Callable[[Floats], Floats]
"""Values (n,) of n functions, each at its own place (n,)."""

ROUNDS = 60
"""Largest number of evaluations of a root: what plain bisection would need [-]."""
CLOSE = 1e-12
"""Width of a bracket that counts as a point [-]; brackets are shares of a step, so this is less
than 1e-14 s."""
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
"""Share of a bracket that golden section keeps [-]."""


def rising_roots(function: Function, low: Floats, high: Floats) -> Floats:
    """Places (n,) where functions rise through zero; each is <= 0 at `low` and > 0 at `high`.

    The method is Chandrupatla's: bisection, or inverse quadratic interpolation where it is safe.
    The returned end of the last bracket is the one with a positive value, so that what has
    happened there has happened.
    """
    b, a = low.copy(), high.copy()
    fb, fa = function(b), function(a)
    c, fc, share = a.copy(), fa.copy(), np.full_like(a, 0.5)
    for _ in range(ROUNDS):
        x = a + share * (b - a)
        fx = function(x)
        same = (fx > 0.0) == (fa > 0.0)
        c, fc = np.where(same, a, b), np.where(same, fa, fb)
        b, fb = np.where(same, b, a), np.where(same, fb, fa)
        a, fa = x, fx
        width = np.abs(b - a)
        if np.all(width <= CLOSE):
            break
        with np.errstate(divide="ignore", invalid="ignore"):
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            inverse = fa / (fb - fa) * fc / (fb - fc)
            inverse += (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
            safe = (phi * phi < xi) & ((1.0 - phi) ** 2 < 1.0 - xi)
            least = np.minimum(0.5, 0.5 * CLOSE / np.maximum(width, CLOSE))
            share = np.where(safe, np.clip(inverse, least, 1.0 - least), 0.5)
    return np.where(fa > 0.0, a, b)


def largest(function: Function, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Places and values (n,) of the largest value of functions with one maximum in a bracket."""
    inner, outer = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    left, right = function(inner), function(outer)
    for _ in range(ROUNDS):
        falls = left > right
        low, high = np.where(falls, low, inner), np.where(falls, outer, high)
        inner, outer = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        left, right = function(inner), function(outer)
        if np.all(high - low < 1e-9):
            break
    return np.where(left > right, inner, outer), np.maximum(left, right)
