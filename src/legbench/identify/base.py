"""Base parameters of a design, and the equations' parameters that follow from them in a setup."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from legbench.analytic.parameters import (
    COUPLING,
    DAMPING,
    FRICTION,
    INERTIA,
    MOMENT,
    SHARPNESS,
    STIFFNESS,
)
from legbench.analytic.terms import Bars, FloatingTerms, floating_terms
from legbench.design import LegDesign
from legbench.design.setup import SetupKind
from legbench.design.statics import GRAVITY
from legbench.identify.parameters import INDEX, PARAMETERS
from legbench.signals import Floats

LEAST_DAMPING: Final = 1e-5
"""Damping from which a fit of its logarithm starts where the design has none [N m s/rad]."""
MOST_RAISES, RAISE = 40, 1.2
"""Most times that inertias are raised to those of a body, and the factor each time [-]."""
FRICTION_WIDTH: Final = 0.02
"""Rate at which three quarters of Coulomb friction act [rad/s]: narrow against the tenths of a
radian a second of a swinging leg, wide enough for a smooth integrator."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LegParameters:
    """Leg as a fit sees it: its lever, and its parameters."""

    reach: float
    """Distance of the foot tip along either direction, l1 + l3 = l2 [m]."""
    values: Floats
    """All parameters in the order of `PARAMETERS` (p,)."""

    @classmethod
    def of(
        cls, design: LegDesign, *, bars: Bars | None = None, mass: float | None = None
    ) -> "LegParameters":
        """Collect the parameters of a design, of its bars, and of the mass that was weighed.

        Args:
            design: the leg.
            bars: its bars, whose mass the trunk is lightened by; none: they weigh nothing.
            mass: mass of the whole leg with its trunk [kg]; none: that of the design.
        """
        terms = floating_terms(design, GRAVITY, bars)
        values = np.zeros(len(PARAMETERS))
        known = base_of(terms) | {
            "k1": design.stiffness[0],
            "k2": design.stiffness[1],
            "d1": max(design.damping[0], LEAST_DAMPING),
            "d2": max(design.damping[1], LEAST_DAMPING),
            "mass": design.total_mass if mass is None else mass,
            "time_base": 1.0,
        }
        for name, value in known.items():
            values[INDEX[name]] = value
        return cls(reach=terms.reach, values=values)


def base_of(terms: FloatingTerms) -> dict[str, float]:
    """Inertial base parameters of the summed bodies of a leg."""
    return {
        "J1": terms.inertia[0],
        "J2": terms.inertia[1],
        "B": terms.coupling,
        "s1": terms.first[0],
        "s2": terms.first[1],
    }


def equation_parameters(values: Floats, reach: float, setup: SetupKind) -> tuple[Floats, Floats]:
    """Parameters of the equations in a setup (14,), and their derivatives by all values (14, p).

    A pinned foot moves the point that the leg turns about by the reach along both directions: with
    the mass M and the reach l, `J - 2 l s + M l^2`, `B - l (s1 + s2) + M l^2` and `s - M l`. A time
    base tau, true time over recorded time, divides inertias by tau^2 and damping by tau.
    """
    found, slope = np.zeros(SHARPNESS + 1), np.zeros((SHARPNESS + 1, len(values)))

    def add(place: int, factor: float, name: str) -> None:
        found[place] += factor * values[INDEX[name]]
        slope[place, INDEX[name]] += factor

    pinned = setup is SetupKind.FFS
    gravity = 0.0 if setup is SetupKind.HFTS else GRAVITY
    for joint in (0, 1):
        inertia, first = f"J{joint + 1}", f"s{joint + 1}"
        add(INERTIA + joint, 1.0, inertia)
        add(MOMENT + joint, gravity, first)
        if pinned:
            add(INERTIA + joint, -2.0 * reach, first)
            add(INERTIA + joint, reach**2, "mass")
            add(COUPLING, -reach, first)
            add(MOMENT + joint, -gravity * reach, "mass")
        add(STIFFNESS + joint, 1.0, f"k{joint + 1}")
        add(DAMPING + joint, 1.0, f"d{joint + 1}")
        add(FRICTION + joint, 1.0, f"f{joint + 1}")
    add(COUPLING, 1.0, "B")
    if pinned:
        add(COUPLING, reach**2, "mass")
    found[SHARPNESS] = 1.0 / FRICTION_WIDTH
    base = values[INDEX["time_base"]]
    for places, power in (((INERTIA, INERTIA + 1, COUPLING), 2), ((DAMPING, DAMPING + 1), 1)):
        for place in places:
            found[place] /= base**power
            slope[place] /= base**power
            slope[place, INDEX["time_base"]] = -power * found[place] / base
    return found, slope


def can_be(values: Floats, reach: float) -> bool:
    """Whether inertias are those of a body in every setup, for any angle between q1 and q2."""
    for setup in (SetupKind.HFTS, SetupKind.FFS):
        found, _ = equation_parameters(values, reach, setup)
        one, two = found[INERTIA : INERTIA + 2]
        if not (one > 0.0 and two > 0.0 and one * two > found[COUPLING] ** 2):
            return False
    return bool(np.all(np.isfinite(values)))


def mended(values: Floats, reach: float) -> Floats:
    """Nearest parameters of some body: the coupling between what both setups allow, in its middle.

    With the trunk held `|B| < sqrt(J1 J2)`, with the foot pinned the same of the shifted inertias;
    where no coupling satisfies both, the inertias are too small and are raised.
    """
    found = values.copy()
    for _ in range(MOST_RAISES):
        if can_be(found, reach):
            return found
        hung, _ = equation_parameters(found, reach, SetupKind.HFTS)
        stood, _ = equation_parameters(found, reach, SetupKind.FFS)
        limit, pinned = (
            np.sqrt(max(each[INERTIA], 0.0) * max(each[INERTIA + 1], 0.0)) for each in (hung, stood)
        )
        middle = found[INDEX["B"]] - stood[COUPLING]
        low, high = max(-limit, middle - pinned), min(limit, middle + pinned)
        found[INDEX["B"]] = 0.5 * (low + high)
        if low >= high or found[INDEX["B"]] <= 0.0:
            found[[INDEX["J1"], INDEX["J2"]]] *= RAISE
            found[INDEX["B"]] = values[INDEX["B"]]
    return found
