"""The equations of one regime as formulas for the Taylor integrator, and its events."""

from enum import IntEnum
from typing import Any

from legbench.analytic._heyoka import SYMBOLS
from legbench.analytic._heyoka import heyoka as hy
from legbench.analytic.equations import (
    Pair,
    contact_force,
    free_foot_acceleration,
    pair_acceleration,
    pair_solve,
    sweep,
)
from legbench.analytic.model import LegModel
from legbench.analytic.state import Regime
from legbench.analytic.terms import PairTerms

RISING, FALLING = hy.event_direction.positive, hy.event_direction.negative
EITHER = hy.event_direction.any
MOTOR, FALL, UPPER, LOWER, TURNS, STOPS = 0, 2, 4, 5, 6, 7
"""Places of the parameters: two motor positions, height and rise of the falling centre of mass,
two levels, whether turning counts (of a leg at rest the probe would turn all the time), and for
each stop whether its joint is beyond the limit and whether it pushes."""
FORCE = 0
"""Place of the event that the contact force vanishes, first of the two conditions of lift-off."""


class Watched(IntEnum):
    """What can end an integration."""

    CONTACT = 0
    """Touchdown or lift-off."""
    RISE = 1
    """The probe rises through the upper level."""
    FALL = 2
    """The probe falls through the lower level."""
    TURN = 3
    """The probe turns round."""
    STOP = 4
    """A joint meets or leaves a limit, or its stop begins or ends to push."""


def steady_point(model: LegModel, regime: Regime) -> tuple[Pair, float]:
    """First moments per mass of the point that moves steadily, seen from the hip [m], and its fall
    [m/s^2].
    """
    match regime:
        case Regime.FLIGHT:
            mass, first = model.floating.mass, model.floating.first
            return (first[0] / mass, first[1] / mass), model.floating.gravity
        case Regime.STANCE:
            return (model.floating.reach, model.floating.reach), 0.0
        case _:
            return (0.0, 0.0), 0.0


def terms_of(model: LegModel, regime: Regime) -> PairTerms:
    """How the angles turn about the steady point."""
    match regime:
        case Regime.FLIGHT:
            return model.falling
        case Regime.STANCE:
            return model.stance
        case _:
            return model.hanging


def equations_of(
    model: LegModel, regime: Regime, q: Any, v: Any
) -> tuple[Pair, list[Any], list[Any]]:
    """Accelerations of the angles, events of the contact, events of the stops.

    Lift-off has two conditions, and the event of either may come last (see `hybrid`).
    """
    torque = model.torque((hy.par[MOTOR], hy.par[MOTOR + 1]), q, v)
    floating = model.floating
    a, stops = _stopped(model, terms_of(model, regime), q, v, torque)
    ground: list[Any] = []
    if regime is Regime.FLIGHT:
        (first, second), gravity = steady_point(model, regime)
        foot = sweep(SYMBOLS, q, (floating.reach - first, floating.reach - second))[1]
        fallen = hy.par[FALL + 1] * hy.time - 0.5 * gravity * (hy.time * hy.time)
        ground = [(Watched.CONTACT, hy.par[FALL] + fallen + foot, FALLING)]
    elif regime is Regime.STANCE:
        force = contact_force(SYMBOLS, floating, q, v, a)[1]
        free = _let_go(model, q, v, torque)
        released = free_foot_acceleration(SYMBOLS, floating, q, v, free)[1]
        ground = [(Watched.CONTACT, force, FALLING), (Watched.CONTACT, released, RISING)]
    return a, ground, stops


def _stopped(
    model: LegModel, terms: PairTerms, q: Any, v: Any, torque: Pair
) -> tuple[Pair, list[Any]]:
    """Accelerations with the stops that push (`analytic.stops.pushes`), and the stops' events."""
    a = pair_acceleration(SYMBOLS, terms, q, v, torque)
    events = []
    for index, stop in enumerate(model.stops):
        beyond, pushing = (hy.par[STOPS + 2 * index + place] for place in (0, 1))
        answer = pair_solve(SYMBOLS, terms, q, stop.normal)
        push = stop.push(q, v, a, answer)
        a = a[0] + pushing * push * answer[0], a[1] + pushing * push * answer[1]
        events += [
            (Watched.STOP, stop.depth(q), EITHER),
            (Watched.STOP, beyond * push + (1.0 - beyond), EITHER),
        ]
    return a, events


def _let_go(model: LegModel, q: Any, v: Any, torque: Pair) -> Pair:
    """Accelerations that the standing leg would have in the air; there other stops may push."""
    a = pair_acceleration(SYMBOLS, model.falling, q, v, torque)
    for index, stop in enumerate(model.stops):
        answer = pair_solve(SYMBOLS, model.falling, q, stop.normal)
        push = hy.par[STOPS + 2 * index] * hy.relu(stop.push(q, v, a, answer))
        a = a[0] + push * answer[0], a[1] + push * answer[1]
    return a


def probed(probe: Pair, q: Any, v: Any) -> list[Any]:
    """Events of a probe: through its upper level, through its lower level, turning round."""
    reading, rate = (probe[0] * x[0] + probe[1] * x[1] for x in (q, v))
    turning = hy.par[TURNS] * rate + (1.0 - hy.par[TURNS])
    return [
        (Watched.RISE, reading - hy.par[UPPER], RISING),
        (Watched.FALL, reading - hy.par[LOWER], FALLING),
        (Watched.TURN, turning, EITHER),
    ]
