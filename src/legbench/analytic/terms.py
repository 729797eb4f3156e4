"""Constants of the equations of motion, summed over the bodies of a design.

Every body of the leg stays parallel to the thigh or to the shank, so its centre of mass is
`hip + along_1 dir(q1) + along_2 dir(q2)`, and five sums over the bodies suffice.
"""

from dataclasses import dataclass

from legbench.design import LegDesign
from legbench.design.statics import GRAVITY
from legbench.errors import ConfigError


@dataclass(frozen=True, slots=True, kw_only=True)
class Bars:
    """Crank and parallel bars as thin rods; the trunk is lightened by their mass.

    Raises:
        ConfigError: a negative density, or a crank without length.
    """

    density: float
    """Mass per length [kg/m]."""
    crank_length: float = 0.02
    """Length of hip crank and thigh extension [m]."""

    def __post_init__(self) -> None:
        if not self.density >= 0.0:
            raise ConfigError(f"bar density is {self.density:g} kg/m; it must be zero or more")
        if not self.crank_length > 0.0:
            raise ConfigError(f"crank_length is {self.crank_length:g} m; it must be positive")


@dataclass(frozen=True, slots=True, kw_only=True)
class PairTerms:
    """Constants of two absolute angles that turn about a fixed point.

    `M = [[inertia_1, coupling c], [coupling c, inertia_2]]` with `c = cos(q1 - q2)` and
    `g_i = moment_i sin(q_i)`: the form of Appendix I, of the fixed trunk and of free fall.
    """

    inertia: tuple[float, float]
    """Inertias about the fixed point, of q1 and q2 [kg m^2]."""
    coupling: float
    """Coupling of the two inertias [kg m^2]."""
    moment: tuple[float, float]
    """Moments of gravity about q1 and q2 at sin(q) = 1 [N m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FloatingTerms:
    """Constants of the leg with a free trunk, `[x_t, z_t, q1, q2]` (section IV-A)."""

    mass: float
    """Mass of the whole system [kg]."""
    first: tuple[float, float]
    """`sum m along_i`: first moments about the hip [kg m]."""
    inertia: tuple[float, float]
    """`sum m along_i^2 + I` of the bodies that turn with q_i [kg m^2]."""
    coupling: float
    """`sum m along_1 along_2` [kg m^2]."""
    reach: float
    """Distance of the foot tip along either direction, l1 + l3 = l2 [m]."""
    gravity: float
    """Acceleration of gravity [m/s^2]."""

    def about(self, along: tuple[float, float], moment_mass: float = 0.0) -> PairTerms:
        """Constants of the angles about the point `hip + along_1 dir(q1) + along_2 dir(q2)`.

        `moment_mass` is the mass on which gravity acts when that point is held [kg]; it is zero
        in free fall.
        """
        (s1, s2), (a1, a2) = self.first, along
        shifted_1, shifted_2 = s1 - self.mass * a1, s2 - self.mass * a2
        weight = self.gravity * (moment_mass / self.mass)
        return PairTerms(
            inertia=(
                self.inertia[0] - 2.0 * a1 * s1 + self.mass * a1 * a1,
                self.inertia[1] - 2.0 * a2 * s2 + self.mass * a2 * a2,
            ),
            coupling=self.coupling - a2 * s1 - a1 * s2 + self.mass * a1 * a2,
            moment=(weight * shifted_1, weight * shifted_2),
        )

    def hanging(self) -> PairTerms:
        """Constants with the trunk held (vFTS; hFTS when `gravity` is zero)."""
        return self.about((0.0, 0.0), self.mass)

    def pinned(self) -> PairTerms:
        """Constants with the foot held: Appendix I by another way, and with bars if there are."""
        return self.about((self.reach, self.reach), self.mass)

    def falling(self) -> PairTerms:
        """Constants of the angles in flight, about the falling centre of mass."""
        return self.about((self.first[0] / self.mass, self.first[1] / self.mass))

    @property
    def above_foot(self) -> tuple[float, float]:
        """First moments about the foot tip [kg m]: `first - mass reach`."""
        return (self.first[0] - self.mass * self.reach, self.first[1] - self.mass * self.reach)


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """Body of the leg below the trunk, with its centre of mass at `hip + sum along_i dir(q_i)`."""

    mass: float
    """Mass [kg]."""
    along: tuple[float, float]
    """Distance of the centre of mass from the hip along dir(q1) and dir(q2) [m]."""
    inertia: float
    """Inertia about an axis across the body through its centre of mass [kg m^2]."""
    turns: tuple[float, float]
    """Whether it turns with q1 or with q2: (1, 0) or (0, 1)."""


FIRST, SECOND = (1.0, 0.0), (0.0, 1.0)
"""Angle that a body turns with."""


def bodies_of(design: LegDesign, bars: Bars | None = None) -> tuple[Body, ...]:
    """Return the bodies of a design below its trunk: thigh, shank, foot, and bars if given."""
    thigh, shank, foot = design.segments
    l1, l2, _ = design.lengths
    rods = () if bars is None else _rods(bars, l1, l2)
    return (
        Body(mass=thigh.mass, along=(thigh.com, 0.0), inertia=thigh.inertia, turns=FIRST),
        Body(mass=shank.mass, along=(l1, shank.com), inertia=shank.inertia, turns=SECOND),
        Body(mass=foot.mass, along=(l1 + foot.com, l2), inertia=foot.inertia, turns=FIRST),
        *rods,
    )


def floating_terms(
    design: LegDesign, gravity: float = GRAVITY, bars: Bars | None = None
) -> FloatingTerms:
    """Sum the bodies of a design: trunk, thigh, shank, foot, and bars if given."""
    # (mass, inertia on q1, inertia on q2, along_1, along_2)
    bodies = [
        (body.mass, body.inertia * body.turns[0], body.inertia * body.turns[1], *body.along)
        for body in bodies_of(design, bars)
    ]
    return FloatingTerms(
        mass=design.total_mass,
        first=(sum(m * a for m, _, _, a, _ in bodies), sum(m * b for m, _, _, _, b in bodies)),
        inertia=(
            sum(m * a * a + i for m, i, _, a, _ in bodies),
            sum(m * b * b + i for m, _, i, _, b in bodies),
        ),
        coupling=sum(m * a * b for m, _, _, a, b in bodies),
        reach=design.lengths[1],
        gravity=gravity,
    )


def _rods(bars: Bars, l1: float, l2: float) -> tuple[Body, ...]:
    """Rods of the linkage: crank (turning with q2), bars along thigh (q1) and along shank (q2)."""
    arm, density = bars.crank_length, bars.density

    def rod(length: float, along: tuple[float, float], turns: tuple[float, float]) -> Body:
        inertia = density * length**3 / 12.0
        return Body(mass=density * length, along=along, inertia=inertia, turns=turns)

    return (
        rod(arm, (0.0, 0.5 * arm), SECOND),
        rod(l1, (0.5 * l1, arm), FIRST),
        rod(l2, (l1 + arm, 0.5 * l2), SECOND),
    )


def stance_terms(design: LegDesign, gravity: float = GRAVITY) -> PairTerms:
    """Constants of Appendix I, line by line: the foot pinned, bars without mass."""
    m_t = design.trunk_mass
    m1, m2, m3 = (segment.mass for segment in design.segments)
    c1, c2, c3 = (segment.com for segment in design.segments)
    i1, i2, i3 = (segment.inertia for segment in design.segments)
    l1, _, l3 = design.lengths
    t1 = (m_t + m1) * l1 - c1 * m1
    t2 = (m_t + m1 + m2) * (l1 + l3) - c2 * m2
    t3 = (m_t + m1 + m2 + m3) * l3 - c3 * m3
    t4 = t1 * (l1 + l3) + t2 * l3
    t5 = (t1 - c1 * m1) * l1 + m1 * c1**2 + i1
    t6 = (t2 - c2 * m2) * (l1 + l3) + m2 * c2**2 + i2
    t7 = (t3 - c3 * m3) * l3 + m3 * c3**2 + i3
    return PairTerms(
        inertia=(2.0 * t1 * l3 + t5 + t7, t6),
        coupling=t4,
        moment=(-gravity * (t1 + t3), -gravity * t2),
    )
