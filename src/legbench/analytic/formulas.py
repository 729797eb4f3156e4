"""The equations of one regime as formulas for the Taylor integrator, and its events."""

from typing import Any

from legbench.analytic._heyoka import SYMBOLS
from legbench.analytic._heyoka import heyoka as hy
from legbench.analytic.equations import (
    Pair,
    damped,
    guide_torque,
    pair_acceleration,
    pair_share,
    spring_torque,
    sweep,
    sweep_acceleration,
)
from legbench.analytic.parameters import (
    ALONG,
    COUPLING,
    DAMPING,
    FREE_COUPLING,
    FREE_INERTIA,
    FREE_PUSHES,
    FRICTION,
    GAIN,
    GRAVITY,
    GUIDE,
    HEIGHT,
    INERTIA,
    LEVEL,
    MOMENT,
    MOTOR,
    PROBE,
    PUSHES,
    REACH,
    SHARPNESS,
    SPEED,
    STIFFNESS,
    Event,
    Kind,
)
from legbench.analytic.stops import HIP, KNEE, TIME_CONSTANT, Stop
from legbench.analytic.terms import PairTerms
from legbench.design.statics import GRAVITY as EARTH

STATE = hy.make_vars("q1", "q2", "v1", "v2")
"""Angles and their rates."""


def pair_at(place: int) -> Pair:
    """Pair of consecutive parameters."""
    return hy.par[place], hy.par[place + 1]


def smooth_system(*, friction: bool, guide: bool = False) -> list[tuple[Any, Any]]:
    """The equations of motion of two angles, without stops.

    Friction is Coulomb's, `-f_i tanh(s v_i)`, smooth for the sake of the series; a guide brakes
    the trunk over a pinned foot.
    """
    q, v = STATE[:2], STATE[2:]
    torque = _torque(q, v)
    if friction:
        rubbing, sharpness = pair_at(FRICTION), hy.par[SHARPNESS]
        torque = (
            torque[0] - rubbing[0] * hy.tanh(sharpness * v[0]),
            torque[1] - rubbing[1] * hy.tanh(sharpness * v[1]),
        )
    if guide:
        guided = guide_torque(SYMBOLS, hy.par[REACH], pair_at(GUIDE), q, v)
        torque = torque[0] + guided[0], torque[1] + guided[1]
    a = pair_acceleration(SYMBOLS, _terms(), q, v, torque)
    return [(STATE[0], v[0]), (STATE[1], v[1]), (STATE[2], a[0]), (STATE[3], a[1])]


def stopped_system() -> tuple[list[tuple[Any, Any]], list[Any]]:
    """Equations of motion with the stops that push, and the reading of each stop's event."""
    q, v = STATE[:2], STATE[2:]
    a = pair_acceleration(SYMBOLS, _terms(), q, v, _torque(q, v))
    a, pushes = _pushed(_terms(), q, v, a, (PUSHES, PUSHES + 2))
    return [(STATE[0], v[0]), (STATE[1], v[1]), (STATE[2], a[0]), (STATE[3], a[1])], pushes


def events(kind: Kind, a: Pair, pushes: list[Any]) -> dict[Event, Any]:
    """Event functions of a regime whose angles accelerate by `a`; events are their rising zeros."""
    q, v = STATE[:2], STATE[2:]
    probe = pair_at(PROBE)
    reading, rate = (probe[0] * x[0] + probe[1] * x[1] for x in (q, v))
    lean, knee = q[0] + q[1], q[1] - q[0]
    readings: list[Any] = [reading, reading, rate, lean, lean, knee, knee, q[0], q[0], *pushes]
    readings += _ground(kind, q, v, a)
    return {
        event: hy.par[GAIN + event] * value - hy.par[LEVEL + event]
        for event, value in zip(Event, readings, strict=False)
    }


def _ground(kind: Kind, q: Any, v: Any, a: Pair) -> list[Any]:
    """Height of the foot in flight; force and acceleration of the released foot in stance."""
    along, gravity = pair_at(ALONG), hy.par[GRAVITY]
    if kind is Kind.FLIGHT:
        fallen = hy.par[SPEED] * hy.time - 0.5 * gravity * (hy.time * hy.time)
        return [hy.par[HEIGHT] + fallen + sweep(SYMBOLS, q, along)[1]]
    force = (sweep_acceleration(SYMBOLS, q, v, a, along)[1] + gravity) / EARTH
    if kind is Kind.STANCE:
        return [force]
    if kind is Kind.HELD:
        free = PairTerms(
            inertia=pair_at(FREE_INERTIA), coupling=hy.par[FREE_COUPLING], moment=(0.0, 0.0)
        )
        bare = pair_acceleration(SYMBOLS, free, q, v, _torque(q, v))
        let_go, pushes = _pushed(free, q, v, bare, (FREE_PUSHES, FREE_PUSHES + 1))
        released = -(sweep_acceleration(SYMBOLS, q, v, let_go, along)[1] + gravity) / EARTH
        return [released, force, *pushes]
    return []


def _terms() -> PairTerms:
    return PairTerms(inertia=pair_at(INERTIA), coupling=hy.par[COUPLING], moment=pair_at(MOMENT))


def _torque(q: Any, v: Any) -> Pair:
    return damped(spring_torque(pair_at(STIFFNESS), pair_at(MOTOR), q), pair_at(DAMPING), v)


def _pushed(
    terms: PairTerms, q: Any, v: Any, a: Pair, switches: tuple[int, int]
) -> tuple[Pair, list[Any]]:
    """`analytic.stops.pushes`, switched by parameters instead of comparisons.

    At most one of a joint's two stops acts, and the sign of its law cancels in what it adds.
    """
    found = []
    for on, place, limit in zip((KNEE, HIP), switches, (PUSHES + 1, PUSHES + 3), strict=True):
        stop = Stop(sign=1.0, limit=hy.par[limit], on=on)
        turn, share = stop.turn(q, v, a), pair_share(SYMBOLS, terms, q, stop.normal)
        pushed = hy.par[place] * turn
        a = a[0] + pushed * share[0], a[1] + pushed * share[1]
        found.append(TIME_CONSTANT**2 * turn)
    return a, found
