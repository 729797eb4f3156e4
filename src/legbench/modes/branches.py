"""Families that branch off where a mode changes its stability.

At such an orbit a multiplier is +1, or -1, which is +1 for the orbit twice around. Its eigenvector
shows where other closed orbits lie: in the direction of the angles if they are brake orbits like
the mode, in that of the rates if they run round. Both sides are tried; on a symmetric leg they are
mirror images.
"""

from dataclasses import dataclass

import numpy as np

from legbench.modes.continuation import LOST, MANY, CurvePoint
from legbench.modes.family import Family, Passing
from legbench.modes.monodromy import energy_slope
from legbench.modes.periodic import PeriodicOrbit, Shooting, orbits_along
from legbench.signals import Floats

ASIDE = (0.02, 0.04, 0.01, 0.08)
"""Distances from the mode at which a branch is sought, one after the other, scaled [-]."""
LEFT = 0.3
"""Smallest share of that distance at which a solution belongs to a branch, not the mode [-]."""
MOST = 25
"""Largest number of orbits of a branch that are followed [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Branch:
    """Orbits of another kind that leave a mode where its stability changes."""

    passing: Passing
    side: int
    """Direction along the eigenvector, 1 or -1."""
    orbits: tuple[PeriodicOrbit, ...]
    """Orbits of the branch, by growing distance from the mode."""
    ended: str
    """Reason why there are no more, in words."""


def branches(family: Family, *, most: int = MOST) -> tuple[Branch, ...]:
    """Branches at all changes of stability of a family."""
    found = []
    for passing in family.passings:
        if passing.changes:
            for side in (1, -1):
                branch = branch_at(family, passing, side, most=most)
                if branch is not None:
                    found.append(branch)
    return tuple(found)


def branch_at(family: Family, passing: Passing, side: int, *, most: int = MOST) -> Branch | None:
    """The branch on one side of an orbit at which stability changes; none if nothing is found."""
    carrier, orbit = family.shooting.carrier, passing.orbit
    period = passing.periods * orbit.period
    half = 0.25 * orbit.period
    # Not at an end: there the speeds vanish, and with them the phase condition.
    start = carrier.path(np.array([*orbit.start, 0.0, 0.0]), np.array([0.0, half]))[-1]
    shooting = Shooting(carrier, orbit.period, start)
    centre = shooting.unknown_of(start, period)
    aside = np.zeros(6)
    aside[:4] = side * _eigenvector(shooting, start, orbit.period, passing.periods)
    for distance in ASIDE:
        guess = centre + distance * aside
        solved = shooting.correct(guess, aside)
        if solved is not None and _left(solved.unknown - centre, aside, distance):
            return _followed(shooting, solved, solved.unknown - centre, passing, side, most)
    return None


def _left(away: Floats, aside: Floats, distance: float) -> bool:
    """Whether a solution has stayed away from the mode, and near enough to belong to it."""
    across = float(np.linalg.norm(away[:4] - (away[:4] @ aside[:4]) * aside[:4]))
    return abs(float(away @ aside)) > LEFT * distance and across < 10.0 * distance


def _eigenvector(shooting: Shooting, start: Floats, period: float, periods: int) -> Floats:
    """Direction (4,), scaled, in which neighbours of the same energy come closest to closing."""
    carrier, size = shooting.carrier, shooting.scale[:4]
    matrix = carrier.carry(start, period).by_start * size / size[:, np.newaxis]
    moving = carrier.rates(start) / size
    energy = energy_slope(carrier, start) * size
    known = np.stack([moving / np.linalg.norm(moving), energy / np.linalg.norm(energy)])
    basis = np.linalg.svd(known)[2][2:]
    sign = 1.0 if periods == 1 else -1.0
    reduced = basis @ matrix @ basis.T - sign * np.eye(2)
    return np.linalg.svd(reduced)[2][-1] @ basis


def _followed(
    shooting: Shooting,
    first: CurvePoint,
    along: Floats,
    passing: Passing,
    side: int,
    most: int,
) -> Branch:
    orbits, ended = orbits_along(shooting, first.towards(along), most)
    return Branch(
        passing=passing,
        side=side,
        orbits=tuple(orbits),
        ended={LOST: "no orbit continues it", MANY: f"{most} orbits"}.get(ended, ended),
    )
