"""Fixed points of the hopping map: hops that return to where they began, and whether they last."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from legbench.analytic.dual import gradient, seeds
from legbench.analytic.taylor import TaylorLeg
from legbench.errors import ConfigError
from legbench.modes.drive import AbstractDrive
from legbench.modes.hop import NAMES, Apex, Hop, return_map
from legbench.signals import Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedPoint:
    """A hop that returns to where it began."""

    apex: Apex
    hop: Hop
    multipliers: tuple[complex, ...]
    """Eigenvalues of the map's derivative, largest first: stable when all are inside the unit
    circle."""
    residual: float
    """What is left of `map(apex) - apex` in the map's own units."""

    @property
    def stable(self) -> bool:
        """Whether small deviations die out."""
        return abs(self.multipliers[0]) < 1.0


UNITS = np.array([0.01, 0.1, 0.1, 0.1, 1.0, 1.0])
"""Sizes that count as large: [m, m/s, rad, rad, rad/s, rad/s]."""
DIFFERENCE = 1e-6
"""Step of central differences, in the unit of each number."""

Derivative = Callable[[TaylorLeg, AbstractDrive, Apex], Floats]
"""Function that gives the map's derivative at an apex (6, 6), in `UNITS`."""


def tangent_map(leg: TaylorLeg, drive: AbstractDrive, at: Apex) -> tuple[Floats, Floats]:
    """The next apex (6,), and its exact derivative by this one (6, 6), both in `UNITS`.

    The hop is followed on dual numbers; the drive must make its levels and alarms of what it is
    told by sums and products. Not for a touchdown without speed, where the map is not smooth.

    Raises:
        ConfigError: the hop does not return to an apex.
    """
    start = Apex(**dict(zip(NAMES, seeds(at.vector()), strict=True)))
    done = return_map(leg.varied, drive, start)
    if done.after is None:
        raise _lost(at, done)
    values = [getattr(done.after, name) for name in NAMES]
    slope = np.stack([gradient(value) for value in values])
    return np.array([float(value) for value in values]) / UNITS, slope * UNITS / UNITS[:, None]


def derivative(leg: TaylorLeg, drive: AbstractDrive, at: Apex) -> Floats:
    """Exact derivative of the map from the variational equations (6, 6), in `UNITS`.

    Raises:
        ConfigError: the hop does not return to an apex.
    """
    return tangent_map(leg, drive, at)[1]


def differences(leg: TaylorLeg, drive: AbstractDrive, at: Apex) -> Floats:
    """Derivative of the map by central differences, which exist where it is not smooth, too (6, 6).

    Raises:
        ConfigError: a neighbour does not return to an apex.
    """
    centre, columns = at.vector(), []
    for index in range(6):
        ends = []
        for sign in (1.0, -1.0):
            moved = centre.copy()
            moved[index] += sign * DIFFERENCE * UNITS[index]
            ends.append(_mapped(leg, drive, Apex.of(moved)))
        columns.append((ends[0] - ends[1]) / (2.0 * DIFFERENCE * UNITS))
    return np.stack(columns, axis=-1)


def _mapped(leg: TaylorLeg, drive: AbstractDrive, at: Apex) -> Floats:
    done = return_map(leg, drive, at)
    if done.after is None:
        raise _lost(at, done)
    return done.after.vector()


def _lost(at: Apex, done: Hop) -> ConfigError:
    return ConfigError(f"the hop from {at} does not return: it ended as '{done.ending}'")


def fixed_point(
    leg: TaylorLeg, drive: AbstractDrive, guess: Apex, slope_of: Derivative = derivative
) -> FixedPoint:
    """Newton's method on the return map, with least squares where the map is neutral.

    Raises:
        ConfigError: there is no fixed point near the guess.
    """
    at = guess.vector()
    wrong = _mapped(leg, drive, guess) - at
    for _ in range(25):
        if np.max(np.abs(wrong / UNITS)) < 1e-10:
            break
        slope = slope_of(leg, drive, Apex.of(at)) - np.eye(6)
        change = np.linalg.lstsq(slope, wrong / UNITS, rcond=1e-7)[0] * UNITS
        share = min(1.0, 0.5 / float(np.max(np.abs(change / UNITS)) + 1e-300))
        at = at - share * change
        wrong = _mapped(leg, drive, Apex.of(at)) - at
    residual = float(np.max(np.abs(wrong / UNITS)))
    if residual > 1e-8:
        raise ConfigError(
            f"no periodic hop near apex height {guess.height:.4g} m: Newton's method is left with "
            f"{residual:.2g}; start it from a hop that is closer to one"
        )
    apex = Apex.of(at)
    values = np.linalg.eigvals(slope_of(leg, drive, apex))
    values = values[np.argsort(-np.abs(values))]
    return FixedPoint(
        apex=apex,
        hop=return_map(leg, drive, apex),
        multipliers=tuple(complex(value) for value in values),
        residual=residual,
    )
