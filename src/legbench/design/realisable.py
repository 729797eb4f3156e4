"""Whether mass on a segment can have the inertia that a design asks for.

Mass between a segment's two joints, whatever its distribution, has an inertia about its centre of
mass of `m c (l - c)` at most: all of it then sits at the two joints. With an overhang of e beyond
both joints the bound is `m (c + e) (l - c + e)`.

No matched leg does without an overhang. Let a body's mass lie at `hip + a dir(q1) + b dir(q2)`.
Matched inertia and gravity are `sum m (a^2 - b^2) = 0` and `sum m (a - b) = 0`, so that
`sum m (a - b) (a + b - 2 l1) = 0`. On the segments themselves every term is zero or negative,

    thigh  (x, 0)         x (x - 2 l1)     0 <= x <= l1
    shank  (l1, x)        -(l1 - x)^2      0 <= x <= l2
    foot   (l1 + x, l2)   x^2 - l3^2       0 <= x <= l3

and zero only for mass at the hip, at the shank's point x = l1, and at the foot tip.
"""

from dataclasses import dataclass

import numpy as np

from legbench.design.leg import LegDesign
from legbench.design.matching import Inertial
from legbench.signals import Floats

SEGMENTS = ("thigh", "shank", "foot")


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach:
    """Inertia that one segment is to have, and what mass between its joints can give it."""

    segment: str
    """`thigh`, `shank` or `foot`."""
    inertia: float
    """Inertia that the design asks for, about the centre of mass [kg m^2]."""
    most: float
    """Largest inertia of mass between the joints, `m c (l - c)` [kg m^2]."""
    overhang: float
    """Least reach of mass beyond both joints [m]; zero if none is needed."""

    @property
    def realisable(self) -> bool:
        """Whether mass between the joints is enough."""
        return self.overhang == 0.0


def largest_inertia(leg: Inertial, overhang: float = 0.0) -> Floats:
    """Inertia about the centre of mass when all mass sits at the far ends (..., 3) [kg m^2].

    The far ends lie `overhang` [m] beyond both joints of every segment.
    """
    return leg.mass * (leg.com + overhang) * (leg.length - leg.com + overhang)


def reaches(design: LegDesign) -> tuple[Reach, ...]:
    """The inertia of every segment against what mass between its joints can have.

    The least overhang that reaches an inertia solves `m (c + e) (l - c + e) = I`.
    """
    leg = Inertial.of(design)
    most = largest_inertia(leg)
    lacking = np.maximum(leg.inertia - most, 0.0) / leg.mass
    overhang = 0.5 * (np.sqrt(leg.length**2 + 4.0 * lacking) - leg.length)
    return tuple(
        Reach(
            segment=name,
            inertia=float(leg.inertia[index]),
            most=float(most[index]),
            overhang=float(overhang[index]),
        )
        for index, name in enumerate(SEGMENTS)
    )
