"""The parameter set of a pantograph leg, validated once."""

import math
from dataclasses import dataclass, field

from legbench.errors import DesignError

LENGTH_TOLERANCE = 1e-9
"""Largest difference of l2 and l1 + l3 [m]: rounding, not manufacture."""


def _positive(what: str, value: float, unit: str) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise DesignError(f"{what} is {value:g} {unit}; it must be a positive finite number")


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """One rigid segment: thigh, shank or foot (Table II).

    Raises:
        DesignError: a value that no segment can have.
    """

    mass: float
    """Mass of the segment [kg]."""
    length: float
    """Length of the segment [m]."""
    com: float
    """Centre of mass, from the proximal joint towards the distal one [m]."""
    inertia: float
    """Inertia about the centre of mass, in the plane of motion [kg m^2]."""

    def __post_init__(self) -> None:
        _positive("mass", self.mass, "kg")
        _positive("length", self.length, "m")
        _positive("inertia", self.inertia, "kg m^2")
        if not 0.0 <= self.com <= self.length:
            raise DesignError(
                f"com is {self.com:g} m; it must lie on the segment, between 0 and its length "
                f"{self.length:g} m"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Joint stops. The bar loops are singular at a straight (0) and a folded (pi) knee.

    Raises:
        DesignError: an empty range, or one that reaches a singular pose.
    """

    hip: tuple[float, float] = (-2.2, 0.9)
    """Range of the thigh angle q1 [rad]."""
    knee: tuple[float, float] = (0.30, 2.90)
    """Range of the knee angle q2 - q1, twice the half angle [rad]."""

    def __post_init__(self) -> None:
        for name, (low, high) in (("hip", self.hip), ("knee", self.knee)):
            if not (math.isfinite(low) and math.isfinite(high) and low < high):
                raise DesignError(
                    f"{name} range is [{low:g}, {high:g}] rad; low must be below high"
                )
        low, high = self.knee
        if low <= 0.0 or high >= math.pi:
            raise DesignError(
                f"knee range is [{low:g}, {high:g}] rad; the bar loops are singular at 0 and pi: "
                "keep it inside"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class LegDesign:
    """A whole leg: the 15 parameters of Fig. 2a, damping and joint limits.

    Raises:
        DesignError: a value that no leg can have, or l2 != l1 + l3 (the constraint of sec. II-A
            that makes the polar angle linear in q).
    """

    name: str
    trunk_mass: float
    """Mass of the trunk [kg]."""
    thigh: Segment
    shank: Segment
    foot: Segment
    stiffness: tuple[float, float]
    """Stiffness of series springs 1 and 2, acting on q1 and q2 [N m/rad]."""
    damping: tuple[float, float]
    """Viscous damping of q1 and q2 [N m s/rad]."""
    limits: Limits = field(default_factory=Limits)

    def __post_init__(self) -> None:
        _positive("trunk mass", self.trunk_mass, "kg")
        for index, (stiffness, damping) in enumerate(
            zip(self.stiffness, self.damping, strict=True), start=1
        ):
            _positive(f"stiffness of spring {index}", stiffness, "N m/rad")
            if not (math.isfinite(damping) and damping >= 0.0):
                raise DesignError(
                    f"damping of joint {index} is {damping:g} N m s/rad; it must be zero or more"
                )
        thigh, shank, foot = self.lengths
        if abs(shank - thigh - foot) > LENGTH_TOLERANCE:
            raise DesignError(
                f"shank length is {shank:.9g} m but thigh + foot make {thigh + foot:.9g} m; the "
                "leg needs l2 = l1 + l3 (section II-A): change one of the three"
            )

    @property
    def segments(self) -> tuple[Segment, Segment, Segment]:
        """Segments in the order thigh, shank, foot."""
        return (self.thigh, self.shank, self.foot)

    @property
    def lengths(self) -> tuple[float, float, float]:
        """Lengths l1, l2, l3 of the segments [m]."""
        return (self.thigh.length, self.shank.length, self.foot.length)

    @property
    def leg_mass(self) -> float:
        """Mass of the three segments [kg]."""
        return sum(segment.mass for segment in self.segments)

    @property
    def total_mass(self) -> float:
        """Mass of trunk and leg [kg]."""
        return self.trunk_mass + self.leg_mass
