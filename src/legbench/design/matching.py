"""Modal matching (section III-A): the conditions under which the radial motion is a strict mode.

Each condition is a sum of terms that has to vanish, or, for stability, to be positive. The terms
are kept apart, because their size is the scale on which a residual is small or large.

With `l2 = l1 + l3` and x1 = 0 the task-space coupling is, in the paper's symbols,

    inertia    M_x[1, 0] = -t8 (2 t1 l3 + t5 + t7 - t6)                            eq. (20) = -(5)
    elastic    tau_x[0] = k1 (qd1 - q1) + k2 (qd2 - q2), zero for all x2 iff k1 = k2   eq. (6), (7)
    damping    the same with d1, d2
    gravity    g_x[0] = -g sin(q1) (t1 + t3) - g sin(q2) t2, zero iff t1 + t3 = t2     eq. (8), (9)

Eq. (9) is printed with `m1 c1` on the left; Appendix I and Table II both ask for `-m1 c1`.
"""

from dataclasses import dataclass

import numpy as np

from legbench.design.leg import LegDesign
from legbench.design.statics import GRAVITY
from legbench.errors import DesignError
from legbench.signals import Floats

TOLERANCE = 0.02
"""Ratio up to which a condition counts as met [-]: Table II rounded to whole grams and
millimetres leaves 0.018 of gravity's terms."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Inertial:
    """Segments as arrays, thigh, shank and foot last: one leg (3,) or candidates (n, 3)."""

    mass: Floats
    """(..., 3) [kg]"""
    length: Floats
    """(..., 3) [m]"""
    com: Floats
    """Distance of each centre of mass from the proximal joint (..., 3) [m]."""
    inertia: Floats
    """Inertias about the centres of mass (..., 3) [kg m^2]."""

    @classmethod
    def of(cls, design: LegDesign) -> "Inertial":
        """The segments of one design."""
        return cls(
            mass=np.array([segment.mass for segment in design.segments]),
            length=np.array([segment.length for segment in design.segments]),
            com=np.array([segment.com for segment in design.segments]),
            inertia=np.array([segment.inertia for segment in design.segments]),
        )


def _split(values: Floats) -> tuple[Floats, Floats, Floats]:
    return values[..., 0], values[..., 1], values[..., 2]


def inertia_terms(leg: Inertial) -> Floats:
    """Terms of eq. (5), as printed (..., 11) [kg m^2]; the trunk's mass cancels.

    Their sum is that of eq. (20), `2 t1 l3 + t5 + t7 - t6`, with the other sign.
    """
    (m1, m2, m3), (l1, _, l3), (c1, c2, c3) = map(_split, (leg.mass, leg.length, leg.com))
    i1, i2, i3 = _split(leg.inertia)
    terms = (
        2.0 * c1 * m1 * l3,
        m2 * (l1 + l3) ** 2,
        -2.0 * c2 * m2 * (l1 + l3),
        2.0 * c1 * m1 * l1,
        -(m2 + m3) * l3**2,
        2.0 * c3 * m3 * l3,
        m2 * c2**2 + i2,
        -m1 * c1**2,
        -m3 * c3**2,
        -i1,
        -i3,
    )
    return np.stack(terms, axis=-1)


def gravity_terms(leg: Inertial) -> Floats:
    """Terms of `t1 + t3 - t2`, eq. (9) with its first sign corrected (..., 3) [kg m]."""
    (m1, m2, m3), (l1, _, l3), (c1, c2, c3) = map(_split, (leg.mass, leg.length, leg.com))
    return np.stack((-m1 * c1, m3 * (l3 - c3), -m2 * (l1 - c2)), axis=-1)


def upright_terms(
    leg: Inertial, trunk_mass: Floats, stiffness: Floats, half_angle: Floats
) -> Floats:
    """Terms of eq. (10), d(tau - g)/dx1 of the leg standing at x1 = 0 (..., 3) [N m/rad].

    Args:
        leg: the segments.
        trunk_mass: (...) [kg]
        stiffness: k1, k2 (..., 2) [N m/rad]
        half_angle: (q2 - q1) / 2 at which the leg stands (...) [rad]
    """
    (m1, m2, m3), (l1, _, l3), (c1, c2, c3) = map(_split, (leg.mass, leg.length, leg.com))
    t1 = (trunk_mass + m1) * l1 - c1 * m1
    t2 = (trunk_mass + m1 + m2) * (l1 + l3) - c2 * m2
    t3 = (trunk_mass + m1 + m2 + m3) * l3 - c3 * m3
    sag = -GRAVITY * (t1 + t2 + t3) * np.cos(half_angle)
    return np.stack((stiffness[..., 0], stiffness[..., 1], sag), axis=-1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """Residual by which a leg misses one condition, and its scale."""

    name: str
    """`inertia`, `elastic`, `gravity`, `damping` or `stability`."""
    equation: str
    residual: float
    """Sum of the terms, in `unit`: zero where the condition is met; for stability the margin."""
    scale: float
    """Sum of the terms' sizes, in `unit`."""
    unit: str
    one_sided: bool = False
    """Whether the residual has to be positive instead of zero."""

    @property
    def ratio(self) -> float:
        """Residual over scale, -1 to 1 [-]; zero where all terms are."""
        return self.residual / self.scale if self.scale > 0.0 else 0.0

    def is_met(self, tolerance: float = TOLERANCE) -> bool:
        """Whether the condition holds, a decoupling one up to `tolerance` of its scale."""
        return self.residual > 0.0 if self.one_sided else abs(self.ratio) <= tolerance


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    """Parameters on which the conditions depend."""

    leg: Inertial
    trunk_mass: float
    """[kg]"""
    stiffness: Floats
    """(2,) [N m/rad]"""
    damping: Floats
    """(2,) [N m s/rad]"""

    @classmethod
    def of(cls, design: LegDesign) -> "Parameters":
        """The parameters of one design."""
        return cls(
            leg=Inertial.of(design),
            trunk_mass=design.trunk_mass,
            stiffness=np.array(design.stiffness),
            damping=np.array(design.damping),
        )


def standing_angle(design: LegDesign, relaxed_length: float | None) -> float:
    """Half angle [rad] at which stability is asked for.

    Without a relaxed length [m] it is the straightest posture that the stops allow: gravity's
    moment is largest there.

    Raises:
        DesignError: a relaxed length that the leg cannot have.
    """
    if relaxed_length is None:
        return 0.5 * design.limits.knee[0]
    longest = 2.0 * design.shank.length
    if not 0.0 < relaxed_length < longest:
        raise DesignError(
            f"relaxed length is {relaxed_length:g} m; leg '{design.name}' is {longest:g} m long "
            "when stretched: choose a length between zero and that"
        )
    return float(np.arccos(relaxed_length / longest))


def check_conditions(
    parameters: Parameters, half_angle: float
) -> tuple[Condition, Condition, Condition, Condition, Condition]:
    """All conditions of section III-A; stability for the leg standing at `half_angle` [rad]."""
    stands = upright_terms(
        parameters.leg,
        np.asarray(parameters.trunk_mass),
        parameters.stiffness,
        np.asarray(half_angle),
    )
    opposed = np.array([1.0, -1.0])
    return (
        _condition("inertia", "(20), -(5)", -inertia_terms(parameters.leg), "kg m^2"),
        _condition("elastic", "(6), (7)", opposed * parameters.stiffness, "N m/rad"),
        _condition("gravity", "(8), (9) corrected", gravity_terms(parameters.leg), "kg m"),
        _condition("damping", "d1 = d2, Table II", opposed * parameters.damping, "N m s/rad"),
        _condition("stability", "(10)", stands, "N m/rad", one_sided=True),
    )


def _condition(
    name: str, equation: str, terms: Floats, unit: str, *, one_sided: bool = False
) -> Condition:
    return Condition(
        name=name,
        equation=equation,
        residual=float(terms.sum()),
        scale=float(np.abs(terms).sum()),
        unit=unit,
        one_sided=one_sided,
    )
