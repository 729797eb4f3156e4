"""Losses and play of many legs that are held alike, as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from legbench.analytic.equations import ARRAY, Pair, guide_torque
from legbench.analytic.losses import CREEP, Losses
from legbench.analytic.model import LegModel
from legbench.analytic.terms import PairTerms
from legbench.signals import Floats

STEADY = 1.4
"""Largest product of step and decay rate of creep [-]; the method of Runge and Kutta of order 4 is
stable up to 2.78."""
STRAIGHTEST = 0.96
"""Largest |cos(q1 - q2)| that joint limits leave, where the leg is lightest against a torque in
one joint [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ManyLosses:
    """Coulomb friction, damped guide and play of n legs; each entry is an array (n,)."""

    friction: Pair
    """Coulomb friction on q1 and q2 [N m]."""
    creep: Pair
    """Speed at which friction has grown to tanh(1) of its size [rad/s]."""
    guide: Pair
    """Viscous damping of the trunk's guide, forward and upward, foot pinned [N s/m]."""
    slack: Pair
    """Half of the play between motor and spring [rad]."""
    reach: Floats
    """Distance of the foot tip along either direction [m]."""

    @classmethod
    def of(cls, models: Sequence[LegModel], terms: PairTerms, step: float) -> "ManyLosses | None":
        """Collect those of some legs with inertias `terms`; None if no leg has any.

        Friction sets in over `CREEP`, or over as much more as steps of `step` [s] can follow.
        """
        if all(model.losses is None for model in models):
            return None
        losses = [model.losses or Losses() for model in models]
        friction = _columns([each.friction for each in losses])
        mean = 0.5 * (terms.inertia[0] + terms.inertia[1])
        apart = 0.5 * (terms.inertia[0] - terms.inertia[1])
        lightest = mean - np.hypot(apart, STRAIGHTEST * terms.coupling)
        first, second = (np.maximum(CREEP, step * size / (STEADY * lightest)) for size in friction)
        return cls(
            friction=friction,
            creep=(first, second),
            guide=_columns([each.guide for each in losses]),
            slack=_columns([each.slack for each in losses]),
            reach=np.array([model.floating.reach for model in models]),
        )

    def gear(self, motor: Pair, q: Pair) -> Pair:
        """Return where the springs begin [rad]: the flank they lean on, or the slack link."""
        first, second = (
            np.minimum(np.maximum(angle, shaft - slack), shaft + slack)
            for angle, shaft, slack in zip(q, motor, self.slack, strict=True)
        )
        return first, second

    def drag(self, q: Pair, v: Pair) -> Pair:
        """Torques of friction and guide on q1 and q2 [N m]."""
        # pyrefly: ignore[bad-argument-type]
        first, second = guide_torque(ARRAY, self.reach, self.guide, q, v)
        return (
            first - self.friction[0] * np.tanh(v[0] / self.creep[0]),
            second - self.friction[1] * np.tanh(v[1] / self.creep[1]),
        )


def _columns(pairs: Sequence[Pair]) -> Pair:
    first, second = np.array(pairs).T
    return first, second
