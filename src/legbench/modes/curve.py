"""Curves in joint space through given points; apart, because scipy takes long to load."""

import numpy as np
from scipy.interpolate import CubicSpline

from legbench.modes.strict import KNOTS, Curve
from legbench.signals import Floats


def curve_through(points: Floats) -> Curve:
    """A smooth curve through points (n, 2) in order, no two the same."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    at = np.concatenate([[0.0], np.cumsum(steps)])
    spline = CubicSpline(at, points)
    knots = np.linspace(0.0, at[-1], KNOTS)
    return Curve(points=spline(knots), tangent=spline(knots, 1), bend=spline(knots, 2))
