"""Contact with the ground on plain numbers: impact, lift-off, and overdue changes of regime."""

from legbench.analytic.equations import Pair, touchdown
from legbench.analytic.model import LegModel
from legbench.analytic.state import LegState, Regime

MIN_PHASE = 2e-4
"""Shortest stance or flight after an event [s]: the foot leaves and lands at speed zero, and the
sign of a zero is decided by rounding."""


def hold(model: LegModel, motor: Pair, q: Pair, v: Pair) -> float:
    """Event function of lift-off [N]: negative if the ground pulls and the released foot rises."""
    force = model.stance_force(motor, q, v)[1]
    return max(force, -model.floating.mass * model.released_rise(motor, q, v))


def overdue(model: LegModel, state: LegState, motor: Pair) -> bool:
    """Whether a leg has to change its regime at once, by a new command or an unwatched event."""
    q, v = state.q, state.v
    if state.regime is Regime.STANCE:
        return model.stance_force(motor, q, v)[1] < 0.0 < model.released_rise(motor, q, v)
    if state.trunk_pos[1] + model.foot_from_hip(q)[1] > 0.0:
        return False
    return state.trunk_vel[1] + model.foot_vel_from_hip(q, v)[1] < 0.0


def switch(model: LegModel, state: LegState) -> LegState:
    """State of the leg after the touchdown or lift-off that ends its regime."""
    if state.regime is Regime.STANCE:
        return state._replace(regime=Regime.FLIGHT, since=state.time)
    return land(model, state)


def land(model: LegModel, state: LegState) -> LegState:
    """State after a touchdown: the foot is at rest, joints and trunk move as eq. (12) says."""
    q, v = state.q, state.v
    relative = model.foot_vel_from_hip(q, v)
    foot_vel = state.trunk_vel[0] + relative[0], state.trunk_vel[1] + relative[1]
    after, _ = touchdown(model.ops, model.stance, model.floating, q, v, foot_vel)
    relative = model.foot_vel_from_hip(q, after)
    return state._replace(
        regime=Regime.STANCE,
        v=after,
        trunk_vel=(-relative[0], -relative[1]),
        since=state.time,
    )
