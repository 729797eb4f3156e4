"""A leg without damping around an equilibrium: what all mode analysis starts from."""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from legbench.analytic import LegModel, PairTerms, equations
from legbench.analytic.matrices import pair_gravity, pair_mass
from legbench.design import LegDesign
from legbench.design.statics import GRAVITY, Support, equilibrium, motor_holding
from legbench.errors import ConfigError, DesignError
from legbench.kinematics import modal_to_joint
from legbench.signals import Floats


class Holding(StrEnum):
    """How the leg is held while it oscillates."""

    HFTS = "hfts"
    """Trunk fixed, no gravity."""
    VFTS = "vfts"
    """Trunk fixed, the leg hangs."""
    FFS = "ffs"
    """Foot pinned."""
    JUMP = "jump"
    """The stance of a jump: foot pinned."""
    FLIGHT = "flight"
    """Nothing held: the angles turn about the falling centre of mass."""


SUPPORTED = {
    Holding.HFTS: Support.NONE,
    Holding.VFTS: Support.TRUNK,
    Holding.FFS: Support.FOOT,
    Holding.JUMP: Support.FOOT,
    Holding.FLIGHT: Support.NONE,
}
"""What carries the leg's weight."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """Two angles, their springs at fixed motors, and the posture in which they rest."""

    design: LegDesign
    kind: Holding
    model: LegModel
    terms: PairTerms
    motor: tuple[float, float]
    """[rad]"""
    rest: tuple[float, float]
    """[rad]"""

    def potential(self, q: Floats) -> Floats:
        """Gravity and springs over the value at rest (...) [J]."""
        total = [
            equations.pair_potential(equations.ARRAY, self.terms, pair)
            + equations.spring_energy(self.model.stiffness, self.motor, pair)
            for pair in ((q[..., 0], q[..., 1]), self.rest)
        ]
        return np.asarray(total[0] - total[1])

    def force(self, q: Floats) -> Floats:
        """Springs less gravity, `tau - g` (..., 2) [N m]."""
        stretch = np.asarray(self.motor) - q
        return np.asarray(self.model.stiffness) * stretch - pair_gravity(self.terms, q)

    def mass(self, q: Floats) -> Floats:
        """Inertia matrix (..., 2, 2) [kg m^2]."""
        return pair_mass(self.terms, q)

    def stiffness(self, q: Floats) -> Floats:
        """Second derivative of the potential (2, 2) [N m/rad]."""
        moment = np.asarray(self.terms.moment) * np.cos(q)
        return np.diag(np.asarray(self.model.stiffness) + moment)

    def rates(self, y: list[complex]) -> list[complex]:
        """Time derivative of (q1, q2, v1, v2), for complex numbers too."""
        q, v = (y[0], y[1]), (y[2], y[3])
        torque = equations.spring_torque(self.model.stiffness, self.motor, q)
        a = equations.pair_acceleration(equations.COMPLEX, self.terms, q, v, torque)
        return [v[0], v[1], a[0], a[1]]

    def inside(self, q: Floats) -> bool:
        """Whether a posture lies within the joint limits."""
        limits = self.design.limits
        low = limits.hip[0] <= q[0] <= limits.hip[1]
        return bool(low and limits.knee[0] <= q[1] - q[0] <= limits.knee[1])


def make_scene(design: LegDesign, kind: Holding, z2: float) -> Scene:
    """The leg at rest at the radial set point z2 (orthonormal, of the link) [rad].

    Raises:
        ConfigError: the set point lies outside the joint limits, or gravity folds the leg there.
    """
    if not math.isfinite(z2):
        raise ConfigError(f"set point z2 is {z2:g} rad; it must be a number")
    gravity = 0.0 if kind in (Holding.HFTS, Holding.FLIGHT) else GRAVITY
    model = LegModel.of(design, gravity=gravity, stops=False, undamped=True)
    support = SUPPORTED[kind]
    rest = modal_to_joint(np.array([0.0, z2]))
    motor = motor_holding(design, rest, support)
    try:
        held = equilibrium(design, motor, support)
    except DesignError as error:
        raise ConfigError(f"set point z2 = {z2:g} rad in {kind}: {error}") from None
    if np.max(np.abs(held - rest)) > 1e-6:
        raise ConfigError(
            f"set point z2 = {z2:g} rad in {kind}: no stable equilibrium there, stiffness "
            f"{design.stiffness} N m/rad lets the leg fold; take a smaller z2 or stiffer springs"
        )
    scene = Scene(
        design=design,
        kind=kind,
        model=model,
        terms=_terms(model, kind),
        motor=(float(motor[0]), float(motor[1])),
        rest=(float(rest[0]), float(rest[1])),
    )
    if np.any(np.diag(scene.stiffness(rest)) <= 0.0):
        raise ConfigError(
            f"set point z2 = {z2:g} rad in {kind}: no stable equilibrium there, stiffness "
            f"{design.stiffness} N m/rad does not carry the leg"
        )
    if not scene.inside(rest):
        limits = design.limits
        raise ConfigError(
            f"set point z2 = {z2:g} rad puts the hip at {rest[0]:.3f} and the knee at "
            f"{rest[1] - rest[0]:.3f} rad; design '{design.name}' allows {limits.hip} and "
            f"{limits.knee}"
        )
    return scene


def _terms(model: LegModel, kind: Holding) -> PairTerms:
    match kind:
        case Holding.FLIGHT:
            return model.falling
        case Holding.FFS | Holding.JUMP:
            return model.stance
        case _:
            return model.hanging
