"""State of a leg: posture, velocities, contact regime; and the transitions between regimes."""

import math
from enum import StrEnum
from typing import NamedTuple

from legbench.analytic.equations import Pair
from legbench.analytic.model import LegModel
from legbench.errors import ConfigError


class Regime(StrEnum):
    """Contact regime, which decides the equations that hold."""

    FLIGHT = "flight"
    """The leg is in the air."""
    STANCE = "stance"
    """The foot stands still on the ground."""
    PINNED = "pinned"
    """The foot is held and cannot lift off (FFS)."""
    HANGING = "hanging"
    """The trunk is held (hFTS, vFTS)."""

    @property
    def stands(self) -> bool:
        """Whether the foot is held by the ground."""
        return self in (Regime.STANCE, Regime.PINNED)


class LegState(NamedTuple):
    """State of one leg at one instant; pairs are (1, 2) or (forward, up).

    It is a tuple and not a dataclass, because the fast path makes one every ten microseconds.
    """

    time: float
    """Time [s]."""
    regime: Regime
    q: Pair
    """Angles q1, q2 [rad]."""
    v: Pair
    """Rates of q1, q2 [rad/s]."""
    trunk_pos: Pair
    """Hip in the world, ground at height 0 [m]."""
    trunk_vel: Pair
    """Velocity of the hip (forward, up) [m/s]."""
    since: float = -math.inf
    """Time at which the regime began [s]; minus infinity for a start."""


class Transition(NamedTuple):
    """A touchdown or a lift-off."""

    time: float
    """Time [s]."""
    before: LegState
    after: LegState

    @property
    def touchdown(self) -> bool:
        """Whether the transition is a touchdown; otherwise it is a lift-off."""
        return self.after.regime is Regime.STANCE


def standing(
    model: LegModel, q: Pair, v: Pair = (0.0, 0.0), *, time: float = 0.0, pinned: bool = False
) -> LegState:
    """State of a leg whose foot stands at the origin."""
    return LegState(
        time=time,
        regime=Regime.PINNED if pinned else Regime.STANCE,
        q=q,
        v=v,
        trunk_pos=model.hip_over_foot(q),
        trunk_vel=model.hip_vel_over_foot(q, v),
    )


def flying(
    model: LegModel, q: Pair, v: Pair, trunk_pos: Pair, trunk_vel: Pair, *, time: float = 0.0
) -> LegState:
    """State of a leg in the air.

    Raises:
        ConfigError: the foot would be below the ground, or lower than the leg can ever be.
    """
    height = trunk_pos[1] + model.foot_from_hip(q)[1]
    if height < 0.0:
        raise ConfigError(
            f"the start puts the foot {-1e3 * height:.3g} mm below the ground; raise the trunk "
            f"from {trunk_pos[1]:.4g} m to {trunk_pos[1] - height:.4g} m or more"
        )
    return LegState(
        time=time, regime=Regime.FLIGHT, q=q, v=v, trunk_pos=trunk_pos, trunk_vel=trunk_vel
    )


def energy(model: LegModel, state: LegState, motor: Pair) -> float:
    """Energy of gravity, motion and springs [J].

    It is constant while no damper, impact, joint stop or command acts.
    """
    spring = model.spring_energy(motor, state.q)
    if model.boom is not None:
        potential, kinetic = model.boom.energy(state.q, state.v)
    elif state.regime is Regime.HANGING:
        potential, kinetic = model.pair_energy(model.hanging, state.q, state.v)
    else:
        potential, kinetic = model.floating_energy(
            state.trunk_pos[1], state.trunk_vel, state.q, state.v
        )
    return potential + kinetic + spring
