"""Readings of the events on dual numbers: the compiled event functions with their derivatives."""

from collections.abc import Sequence
from dataclasses import replace

from legbench.analytic.compiled import foot_from_centre, terms_of
from legbench.analytic.dual import DUAL
from legbench.analytic.equations import Term, contact_force, free_foot_acceleration, sweep
from legbench.analytic.moving_leg import MovingLeg
from legbench.analytic.parameters import Event
from legbench.design.statics import GRAVITY


def read(
    leg: MovingLeg, event: int, state: Sequence[Term], elapsed: Term, *, plain: bool = False
) -> Term:
    """Reading of an event, in the unit of its level.

    Args:
        leg: the leg, in the regime and with the stops of the piece that the event ends.
        event: one of `places.Event`.
        state: angles and rates (4,) [rad, rad/s].
        elapsed: time since the piece began [s].
        plain: take everything but `state` and `elapsed` without derivatives.
    """
    q1, q2, v1, v2 = state
    match event:
        case Event.RISE | Event.FALL:
            return leg.probe[0] * q1 + leg.probe[1] * q2
        case Event.TURN:
            return leg.probe[0] * v1 + leg.probe[1] * v2
        case Event.FELL | Event.FELL_BACK:
            return q1 + q2
        case Event.KNEE_LOW | Event.KNEE_HIGH:
            return q2 - q1
        case Event.HIP_LOW | Event.HIP_HIGH:
            return q1
        case Event.CONTACT if leg.compiled.flies:
            return _height(leg, state, elapsed, plain=plain)
        case _:
            return _pressed(leg, event, state, plain=plain)


def _height(leg: MovingLeg, state: Sequence[Term], elapsed: Term, *, plain: bool) -> Term:
    """Height of the foot in flight [m]."""
    model, z, dz = leg.model, leg.point[1], leg.drift[1]
    if plain:
        model, z, dz = leg.plain, float(z), float(dz)
    centre = z + (dz - 0.5 * model.floating.gravity * elapsed) * elapsed
    return centre + sweep(DUAL, (state[0], state[1]), foot_from_centre(model))[1]


def _pressed(leg: MovingLeg, event: int, state: Sequence[Term], *, plain: bool) -> Term:
    """Push of a stop by its law, contact force, or acceleration of the released foot."""
    model = replace(leg.plain, ops=DUAL) if plain else leg.model
    motor = leg.plain_motor if plain else leg.motor
    q, v = (state[0], state[1]), (state[2], state[3])
    free = event >= Event.KNEE_FREE or (event == Event.CONTACT and leg.compiled.held)
    terms = model.falling if free else terms_of(model, leg.regime)
    turns, a = leg.stop_switches.turns(DUAL, terms, model.torque(motor, q, v), q, v, free=free)
    match event:
        case Event.KNEE_PUSH | Event.HIP_PUSH:
            joint = event - Event.KNEE_PUSH
            return leg.stop_switches.sign(joint) * turns[joint]
        case Event.KNEE_FREE | Event.HIP_FREE:
            joint = event - Event.KNEE_FREE
            return leg.stop_switches.sign(joint) * turns[joint]
        case Event.CONTACT if free:
            return free_foot_acceleration(DUAL, model.floating, q, v, a)[1] / GRAVITY
        case _:
            force = contact_force(DUAL, model.floating, q, v, a)[1]
            return force / (model.floating.mass * GRAVITY)
