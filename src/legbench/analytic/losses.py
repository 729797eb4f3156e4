"""Imperfections of the joints in the equations: dry friction, a damped guide, backlash."""

import math
from dataclasses import dataclass
from typing import Final

from legbench.analytic.equations import SCALAR, Pair, guide_torque, sweep_rate
from legbench.imperfections import Imperfections

CREEP: Final = 1e-3
"""Speed at which dry friction has grown to tanh(1) of its size [rad/s]. A stuck joint creeps by
about as much; the simulation's friction, which is as hard as its loops, behaves alike."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Losses:
    """Losses and play of one leg, for plain floats."""

    friction: tuple[float, float] = (0.0, 0.0)
    """Coulomb friction on q1 and q2 [N m]."""
    guide: tuple[float, float] = (0.0, 0.0)
    """Viscous damping of the trunk's guide, forward and upward, foot pinned [N s/m]."""
    slack: tuple[float, float] = (0.0, 0.0)
    """Half of the play between motor and spring [rad]."""

    @classmethod
    def of(cls, imperfections: Imperfections) -> "Losses | None":
        """Collect those of some imperfections; None if there is neither loss nor play."""
        low, high = imperfections.backlash or (0.0, 0.0)
        found = cls(
            friction=imperfections.coulomb_friction or (0.0, 0.0),
            guide=imperfections.guide_damping or (0.0, 0.0),
            slack=(0.5 * low, 0.5 * high),
        )
        return None if found == cls() else found

    def gear(self, motor: Pair, q: Pair) -> Pair:
        """Return where the springs begin [rad]: the flank they lean on, or the slack link."""
        return (
            min(max(q[0], motor[0] - self.slack[0]), motor[0] + self.slack[0]),
            min(max(q[1], motor[1] - self.slack[1]), motor[1] + self.slack[1]),
        )

    def drag(self, reach: float, q: Pair, v: Pair) -> Pair:
        """Torques of friction and guide on q1 and q2 [N m]."""
        first, second = (
            -size * math.tanh(rate / CREEP) for size, rate in zip(self.friction, v, strict=True)
        )
        if any(self.guide):
            guided = guide_torque(SCALAR, reach, self.guide, q, v)
            first, second = first + guided[0], second + guided[1]
        return first, second

    def guide_force(self, reach: float, q: Pair, v: Pair) -> Pair:
        """Force of the guide on the trunk of a leg whose foot is pinned (forward, up) [N]."""
        foot_vel = sweep_rate(SCALAR, q, v, (reach, reach))
        return self.guide[0] * foot_vel[0], self.guide[1] * foot_vel[1]
