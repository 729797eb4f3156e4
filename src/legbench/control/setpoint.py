"""Motor positions for a radial set point z2, within what the leg can do."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import final

import numpy as np

from legbench.design import LegDesign
from legbench.design.statics import Support, equilibrium, gravity_load, motor_holding
from legbench.errors import ConfigError, DesignError
from legbench.kinematics import ModalConvention, modal_to_joint
from legbench.signals import Floats


class SetpointMeaning(StrEnum):
    """Meaning of the set point z2."""

    LINK = "link"
    """The link's equilibrium: the motor is placed so that the leg rests there under gravity."""
    MOTOR = "motor"
    """The motor's position, from which the leg sags."""


def check_delay(delay: float) -> None:
    """Refuse a time at rest [s] that never ends or has no meaning.

    Raises:
        ConfigError: it is negative or not finite.
    """
    if not 0.0 <= delay < math.inf:
        raise ConfigError(f"delay is {delay:g} s; it must be zero or more, and finite")


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LegTargets:
    """Motor positions for radial set points of one leg, or of one leg a row.

    All postures lie on the radial mode, z1 = 0, at the link or at the motor.
    """

    designs: LegDesign | Sequence[LegDesign]
    support: Support
    meaning: SetpointMeaning = SetpointMeaning.LINK
    convention: ModalConvention = ModalConvention.ORTHONORMAL

    def each(self) -> Iterator["LegTargets"]:
        """Set points of the single legs of a batch."""
        designs = [self.designs] if isinstance(self.designs, LegDesign) else self.designs
        for design in designs:
            yield replace(self, designs=design)

    def motor_at(self, z2: float | Floats, name: str) -> Floats:
        """Motor positions (..., 2) [rad] for the set point `z2` [rad], called `name` in errors.

        Args:
            z2: the set point; of a batch, one for all or one for each leg (n,).
            name: what to call it.

        Raises:
            ConfigError: a leg has no equilibrium there, or it lies outside the joint limits.
        """
        if isinstance(self.designs, LegDesign):
            return self._motor_of(self.designs, float(z2), name)
        wanted = np.broadcast_to(np.asarray(z2, dtype=np.float64), len(self.designs))
        motor = self._motors_of(self.designs, wanted)
        if motor is None:
            # One by one, so that the first leg that refuses says why.
            pairs = zip(self.designs, wanted.tolist(), strict=True)
            return np.array([self._motor_of(design, each, name) for design, each in pairs])
        return motor

    def link_at_rest(self, motor_pos: Floats) -> Floats:
        """Link angles (..., 2) [rad] at which the supported leg rests for motor positions."""
        return equilibrium(self.designs, motor_pos, self.support)

    def modal_stiffness(self) -> Floats:
        """Stiffness of the springs along z2, smallest over the joints (...) [N m/rad]."""
        if isinstance(self.designs, LegDesign):
            return np.asarray(min(self.designs.stiffness))
        return np.array([min(design.stiffness) for design in self.designs])

    def radial(self, joint: Floats) -> Floats:
        """The z2 component (...) of joint angles, rates or torques (..., 2), eq. (15)."""
        return self.convention.scale * (joint[..., 1] - joint[..., 0])

    def _motors_of(self, designs: Sequence[LegDesign], z2: Floats) -> Floats | None:
        """Motor positions (n, 2) of all legs at once; None if one of them refuses its own."""
        if not np.isfinite(z2).all():
            return None
        target = modal_to_joint(np.stack([np.zeros_like(z2), z2], axis=-1), self.convention)
        stiffness = np.array([design.stiffness for design in designs])
        moment = np.array([gravity_load(design, self.support).moment for design in designs])
        if self.meaning is SetpointMeaning.LINK:
            link, motor = target, target + moment * np.sin(target) / stiffness
            held = bool(np.all(stiffness + moment * np.cos(link) > 0.0))
        else:
            try:
                link, motor, held = equilibrium(designs, target, self.support), target, True
            except DesignError:
                return None
        hip = np.array([design.limits.hip for design in designs])
        knee = np.array([design.limits.knee for design in designs])
        for angle, ends in ((link[:, 0], hip), (link[:, 1] - link[:, 0], knee)):
            held &= bool(np.all((ends[:, 0] <= angle) & (angle <= ends[:, 1])))
        return motor if held else None

    def _motor_of(self, design: LegDesign, z2: float, name: str) -> Floats:
        if not math.isfinite(z2):
            raise ConfigError(f"set point {name} is {z2:g} rad; it must be a finite number")
        target = modal_to_joint(np.array([0.0, z2]), self.convention)
        try:
            if self.meaning is SetpointMeaning.LINK:
                link, motor = target, motor_holding(design, target, self.support)
                self._check_stable(design, link)
            else:
                link, motor = equilibrium(design, target, self.support), target
        except DesignError as error:
            raise ConfigError(f"set point {name} = {z2:g} rad ({self.meaning}): {error}") from None
        self._check_limits(design, link, z2, name)
        return motor

    def _check_stable(self, design: LegDesign, link: Floats) -> None:
        moment = np.asarray(gravity_load(design, self.support).moment)
        if not np.all(np.asarray(design.stiffness) + moment * np.cos(link) > 0.0):
            raise DesignError(
                f"stiffness {design.stiffness} N m/rad does not hold the leg up there"
            )

    def _check_limits(self, design: LegDesign, link: Floats, z2: float, name: str) -> None:
        knee, hip = float(link[1] - link[0]), float(link[0])
        for joint, angle, (low, high) in (
            ("knee", knee, design.limits.knee),
            ("hip", hip, design.limits.hip),
        ):
            if not low <= angle <= high:
                raise ConfigError(
                    f"set point {name} = {z2:g} rad ({self.meaning}) puts the {joint} at "
                    f"{angle:.3f} rad; design '{design.name}' allows {low:g} to {high:g} rad"
                )
