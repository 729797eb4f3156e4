"""Neighbourhood of a stable periodic hop in which every hop brings the leg nearer to it.

Near the periodic hop the return map is its derivative J. For a `rate` between the largest
multiplier of J and one, `P = 1 + J^T P J / rate^2` is a quadratic form that J shrinks:
`V(x) = sqrt(x^T P x)` falls by `rate` or more at each hop. How far from the periodic hop this still
holds for the map itself is measured: many starts at random within a radius are followed until they
have returned, and whenever two apexes in a row lie within the radius, the next one has to be nearer
by `rate`. A leg with two apexes in a row within the radius therefore stays there, and returns after
a number of hops that is known.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from legbench.analytic.taylor import TaylorLeg
from legbench.errors import ConfigError
from legbench.modes.drive import AbstractDrive
from legbench.modes.fixed_point import UNITS, derivative
from legbench.modes.hop import Apex, return_map
from legbench.signals import Floats

RADII = (8.0, 6.0, 4.0, 3.0, 2.0, 1.0)
"""Distances within which the map is tried, in `fixed_point.UNITS` [-]."""
MARGIN = 0.75
"""Share of the radius that was tried which is relied on [-]."""
STARTS = 150
"""Number of random starts from which the map is tried [-]."""
FOLLOWED = 40
"""Largest number of hops for which each is followed [-]."""
SLACK = 0.25
"""Place of the rate between the largest multiplier (0) and one (1)."""
STILL = 1e-6
"""Largest distance by which a periodic hop may miss its apex, in `fixed_point.UNITS` [-]."""

Map = Callable[[Floats], Floats | None]
"""Function from an apex to the next, both as distances from the periodic hop in
`fixed_point.UNITS` (6,); None if the leg does not come to an apex."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Attraction:
    """Neighbourhood of a periodic hop in which each hop shrinks the distance by a known rate."""

    centre: Floats
    """Apex of the periodic hop (6,)."""
    metric: Floats
    """Matrix P of the distance `sqrt(x^T P x)` (6, 6), which is never less than `max |x_i|`."""
    rate: float
    """Factor by which a hop shrinks the distance, or more [-]."""
    radius: float
    """Distance below which it does, if the apex before was below it, too [-]."""

    def distance(self, apex: Floats) -> float:
        """Distance of an apex (6,) from the periodic hop, in `fixed_point.UNITS` [-]."""
        return _length(self.metric, (apex - self.centre) / UNITS)

    def hops_to(self, near: float, distance: float) -> int:
        """Number of hops after which a leg at `distance` is within `near` for certain."""
        return max(0, math.ceil(math.log(distance / near) / -math.log(self.rate)))


def find_attraction(
    leg: TaylorLeg, exact: TaylorLeg, drive: AbstractDrive, centre: Apex, near: float, hops: int
) -> Attraction | None:
    """Neighbourhood from which a leg comes within `near` of a periodic hop, or None.

    There is none around a hop that is not stable or attracts so slowly that `hops` do not suffice.

    Args:
        leg: the leg whose hops are to be predicted.
        exact: that leg at the finest tolerance, for the derivative.
        drive: the law of the motors.
        centre: apex of the periodic hop.
        near: largest of the six distances at which the leg has returned, in `fixed_point.UNITS`.
        hops: number of hops within which it has to.
    """
    middle = centre.vector()

    def follow(x: Floats) -> Floats | None:
        try:
            after = return_map(leg, drive, Apex.of(middle + UNITS * x)).after
        except ConfigError:
            return None
        return None if after is None else (after.vector() - middle) / UNITS

    still = follow(np.zeros(6))
    if still is None or np.max(np.abs(still)) > STILL:
        return None
    return attraction_of(follow, derivative(exact, drive, centre), middle, near, hops)


def attraction_of(
    follow: Map, slope: Floats, centre: Floats, near: float, hops: int
) -> Attraction | None:
    """Neighbourhood in which a map (6,) to (6,) with derivative `slope` at zero contracts."""
    largest = float(np.max(np.abs(np.linalg.eigvals(slope))))
    rate = largest + SLACK * (1.0 - largest)
    if not largest < 1.0:
        return None
    metric = _metric(slope, rate)
    for radius in RADII:
        found = Attraction(centre=centre, metric=metric, rate=rate, radius=MARGIN * radius)
        if found.hops_to(near, MARGIN * RADII[-1]) > hops:
            return None
        if _contracts(follow, metric, rate, radius, near):
            return found
    return None


def _metric(slope: Floats, rate: float) -> Floats:
    """`P = 1 + J^T P J / rate^2`, scaled until no coordinate exceeds `sqrt(x^T P x)`."""
    metric, power = np.eye(6), slope / rate
    while np.max(np.abs(power)) > 1e-9:
        # The sum of 2n terms from that of n: P_2n = P_n + (J^n)^T P_n J^n.
        metric = metric + power.T @ metric @ power
        power = power @ power
    return metric * float(np.max(np.diag(np.linalg.inv(metric))))


def _contracts(follow: Map, metric: Floats, rate: float, radius: float, near: float) -> bool:
    """Whether every hop that follows two apexes within a radius is nearer by `rate`."""
    random, root = np.random.default_rng(0), np.linalg.cholesky(np.linalg.inv(metric))
    for _ in range(STARTS):
        way = random.normal(size=6)
        length = radius * math.cbrt(random.uniform())
        x, before = root @ (way * (length / np.linalg.norm(way))), math.inf
        for _ in range(FOLLOWED):
            distance = _length(metric, x)
            within = max(before, distance) <= radius
            if within and distance < near:
                break
            after = follow(x)
            if within and (after is None or _length(metric, after) > rate * distance):
                return False
            if after is None:
                break
            x, before = after, distance
    return True


def _length(metric: Floats, x: Floats) -> float:
    return math.sqrt(float(x @ metric @ x))
