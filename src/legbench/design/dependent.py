"""A whole leg from seven ratios: lengths, masses, I1 and k follow from the conditions.

Everything is batched: `free` has the seven decision variables last, `(..., 7)`.

Lengths come from the relaxed length. The masses solve

    m1 + m2 + m3 = m_leg
    m1 c1 + m2 (l1 + c2) + m3 (l1 + l2 + c3) = m_leg c_leg          stretched leg
    -m1 c1 - m2 (l1 - c2) + m3 (l3 - c3) = 0                        eq. (9), corrected

where, with l2 = l1 + l3, the sum of the last two leaves `c2 m2 + l2 m3 = m_leg c_leg / 2`.
I1 makes eq. (5) vanish, and k gives the radial stiffness `k / (2 l2^2 sin^2)` at l_o.
"""

from dataclasses import dataclass

import numpy as np

from legbench.design.leg import LegDesign, Segment
from legbench.design.matching import Inertial, inertia_terms, upright_terms
from legbench.design.realisable import largest_inertia
from legbench.design.requirements import Requirements
from legbench.signals import Bools, Floats

STICK = 1.0 / 12.0
"""I / (m l^2) of a homogeneous stick, objective (11)."""
INFEASIBLE = 1e6
"""Cost of a leg that cannot exist; grows with how far it is from existing."""

MARGINS = (
    "a positive thigh mass",
    "a positive shank mass",
    "a positive foot mass",
    "a positive thigh inertia, condition (5)",
    "upright stability, condition (10)",
    "a thigh inertia within reach of the overhang",
    "a shank inertia within reach of the overhang",
    "a foot inertia within reach of the overhang",
)
"""Names of the margins, which have to be positive besides the bounds; the last three only where
an overhang is bounded."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidates:
    """Legs that meet all decoupling conditions, whether or not they can be built."""

    leg: Inertial
    trunk_mass: float
    """[kg]"""
    stiffness: Floats
    """Stiffness of both springs, k1 = k2 (...) [N m/rad]."""
    relaxed_angle: Floats
    """Half angle at the relaxed length (...) [rad]."""


def solve_dependent(requirements: Requirements, free: Floats) -> Candidates:
    """The dependent parameters of ratios (..., 7); not finite where the masses have no solution."""
    relaxed, thigh, *rest = np.moveaxis(free, -1, 0)
    l2 = requirements.relaxed_length / (2.0 * relaxed)
    l1 = thigh * l2
    l3 = l2 - l1
    length = np.stack((l1, l2, l3), axis=-1)
    com = np.stack(rest[:3], axis=-1) * length
    with np.errstate(all="ignore"):
        mass = _masses(requirements, length, com)
        inertia = np.stack(
            (np.zeros_like(l1), rest[3] * mass[..., 1] * l2**2, rest[4] * mass[..., 2] * l3**2),
            axis=-1,
        )
        without = Inertial(mass=mass, length=length, com=com, inertia=inertia)
        inertia[..., 0] = inertia_terms(without).sum(axis=-1)
    return Candidates(
        leg=Inertial(mass=mass, length=length, com=com, inertia=inertia),
        trunk_mass=requirements.total_mass - requirements.leg_mass,
        stiffness=requirements.leg_stiffness * 2.0 * l2**2 * (1.0 - relaxed**2),
        relaxed_angle=np.arccos(relaxed),
    )


def _masses(requirements: Requirements, length: Floats, com: Floats) -> Floats:
    """m1, m2, m3 (..., 3) [kg] by Cramer's rule, m1 eliminated."""
    total = requirements.leg_mass
    l1, l2, l3 = length[..., 0], length[..., 1], length[..., 2]
    c1, c2, c3 = com[..., 0], com[..., 1], com[..., 2]
    moment = 0.5 * total * requirements.leg_com
    # c2 m2 + l2 m3 = moment;  (l1 - c2 - c1) m2 - (l3 - c3 + c1) m3 = -c1 total
    shank, foot = l1 - c2 - c1, -(l3 - c3 + c1)
    determinant = c2 * foot - l2 * shank
    m2 = (moment * foot + l2 * c1 * total) / determinant
    m3 = (-c2 * c1 * total - moment * shank) / determinant
    return np.stack((total - m2 - m3, m2, m3), axis=-1)


def objective(requirements: Requirements, candidates: Candidates) -> Floats:
    """Objective (11) with the requirements' weights (...) [-]."""
    leg, weights = candidates.leg, requirements.weights
    share = leg.mass / requirements.leg_mass
    share = share - leg.length / leg.length.sum(axis=-1, keepdims=True)
    with np.errstate(all="ignore"):
        stick = leg.inertia[..., 0] / (leg.mass[..., 0] * leg.length[..., 0] ** 2) - STICK
    uneven = (np.asarray(weights.mass_share) * share**2).sum(axis=-1)
    return uneven + weights.thigh_inertia * stick**2


def margins(requirements: Requirements, candidates: Candidates) -> Floats:
    """`MARGINS` of candidates (..., n), dimensionless; a leg exists where all are positive.

    n is 8 where the requirements bound the overhang of masses, else 5.
    """
    leg = candidates.leg
    share = leg.mass / requirements.leg_mass
    inertia = leg.inertia[..., 0] / (requirements.leg_mass * leg.length[..., 1] ** 2)
    pair = np.stack((candidates.stiffness, candidates.stiffness), axis=-1)
    stands = upright_terms(
        leg, np.asarray(candidates.trunk_mass), pair, candidates.relaxed_angle
    ).sum(axis=-1)
    stability = stands / (2.0 * candidates.stiffness)
    found = [share, inertia[..., np.newaxis], stability[..., np.newaxis]]
    if requirements.overhang is not None:
        spare = largest_inertia(leg, requirements.overhang) - leg.inertia
        found.append(spare / (requirements.leg_mass * leg.length[..., 1:2] ** 2))
    return np.concatenate(found, axis=-1)


def cost(requirements: Requirements, free: Floats) -> Floats:
    """Cost that a search minimises (...): objective (11), or, where no leg exists, far more [-].

    Legs that cannot exist are ordered by how far their margins are from positive.
    """
    candidates = solve_dependent(requirements, free)
    lacking = shortfall(margins(requirements, candidates))
    value = objective(requirements, candidates)
    return np.where((lacking == 0.0) & np.isfinite(value), value, INFEASIBLE * (1.0 + lacking))


def shortfall(margin: Floats) -> Floats:
    """Sum (...) of what is missing from margins (..., n): zero where all are positive [-]."""
    missing: Bools = ~(margin > 0.0)
    size = np.where(np.isfinite(margin), np.abs(margin), 1e3)
    return np.where(missing, size + 1e-9, 0.0).sum(axis=-1)


def design_of(requirements: Requirements, free: Floats, name: str | None = None) -> LegDesign:
    """Design of the leg with one set of ratios (7,).

    Raises:
        DesignError: no such leg can exist.
    """
    candidates = solve_dependent(requirements, free)
    leg, stiffness = candidates.leg, float(candidates.stiffness)
    thigh, shank, foot = (
        Segment(
            mass=float(leg.mass[index]),
            length=float(leg.length[index]),
            com=float(leg.com[index]),
            inertia=float(leg.inertia[index]),
        )
        for index in range(3)
    )
    return LegDesign(
        name=name or requirements.name,
        trunk_mass=candidates.trunk_mass,
        thigh=thigh,
        shank=shank,
        foot=foot,
        stiffness=(stiffness, stiffness),
        damping=(requirements.damping, requirements.damping),
        limits=requirements.limits,
    )
