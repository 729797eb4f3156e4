"""Batch of legs as arrays: the equations of two angles, integrated in step by Runge-Kutta.

Every leg has its own constants; its results do not depend on the others of the batch.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from legbench.analytic.equations import (
    ARRAY,
    Pair,
    damped,
    pair_acceleration,
    pair_solve,
    spring_torque,
)
from legbench.analytic.many_losses import ManyLosses
from legbench.analytic.model import LegModel
from legbench.analytic.stops import Stop
from legbench.analytic.terms import PairTerms
from legbench.signals import Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class ManyLegs:
    """Constants of n legs that are held alike, each an array (n,) where `LegModel` has a number."""

    terms: PairTerms
    stiffness: Pair
    """Stiffness of the springs on q1 and q2 [N m/rad]."""
    damping: Pair
    """Damping of q1 and q2 [N m s/rad]."""
    stops: tuple[Stop, ...]
    losses: ManyLosses | None = None
    """Dry friction, damped guide and backlash; none if no leg has any."""

    @classmethod
    def of(cls, models: Sequence[LegModel], *, standing: bool, step: float = 0.001) -> "ManyLegs":
        """Collect the legs of some models, all with stops or all without.

        They stand on a pinned foot, or hang from a fixed trunk if not `standing`; dry friction is
        as hard as integration by steps of `step` [s] allows.
        """
        pairs = [model.stance if standing else model.hanging for model in models]
        stops = [
            # pyrefly: ignore[bad-argument-type]
            Stop(sign=few[0].sign, limit=np.array([stop.limit for stop in few]), on=few[0].on)
            for few in zip(*(model.stops for model in models), strict=True)
        ]
        terms = PairTerms(
            inertia=_columns([terms.inertia for terms in pairs]),
            # pyrefly: ignore[bad-argument-type]
            coupling=np.array([terms.coupling for terms in pairs]),
            moment=_columns([terms.moment for terms in pairs]),
        )
        return cls(
            terms=terms,
            stiffness=_columns([model.stiffness for model in models]),
            damping=_columns([model.damping for model in models]),
            stops=tuple(stops),
            losses=ManyLosses.of(models, terms, step),
        )

    def acceleration(self, motor: Pair, q: Pair, v: Pair) -> Pair:
        """Accelerations of q1 and q2, joint stops included, two arrays (n,) [rad/s^2].

        A stop acts by the law of `analytic.stops`, on the legs that are beyond it.
        """
        losses = self.losses
        begin = motor if losses is None else losses.gear(motor, q)
        torque = damped(spring_torque(self.stiffness, begin, q), self.damping, v)
        if losses is not None:
            drag = losses.drag(q, v)
            torque = torque[0] + drag[0], torque[1] + drag[1]
        a = pair_acceleration(ARRAY, self.terms, q, v, torque)
        for stop in self.stops:
            beyond = stop.depth(q) > 0.0
            if beyond.any():
                answer = pair_solve(ARRAY, self.terms, q, stop.normal)
                force = np.where(beyond, np.maximum(stop.push(q, v, a, answer), 0.0), 0.0)
                a = a[0] + answer[0] * force, a[1] + answer[1] * force
        return a


def _columns(pairs: Sequence[Pair]) -> Pair:
    first, second = np.array(pairs).T
    return first, second


def motion(
    legs: ManyLegs, joint_pos: Floats, motor_pos: Floats, step: float, count: int
) -> Iterator[tuple[Floats, Floats]]:
    """Angles and rates (n, 2) after each of `count` steps of `step` [s], from rest at `joint_pos`.

    Classical Runge-Kutta of order 4, motors held at `motor_pos` (n, 2) [rad]. A leg that runs away
    becomes infinite or NaN, without effect on the others.
    """
    motor = (motor_pos[:, 0], motor_pos[:, 1])
    q, v = joint_pos.T.copy(), np.zeros_like(joint_pos.T)
    for _ in range(count):
        q, v = advance(legs, motor, q, v, step)
        yield q.T, v.T


def advance(
    legs: ManyLegs, motor: Pair, q: Floats, v: Floats, step: float
) -> tuple[Floats, Floats]:
    """Angles and rates (2, n) a step of `step` [s] later, motors held at two arrays (n,) [rad].

    Classical Runge-Kutta of order 4.
    """

    def slope(at: Floats, rate: Floats) -> Floats:
        return np.stack(legs.acceleration(motor, (at[0], at[1]), (rate[0], rate[1])))

    half = 0.5 * step
    with np.errstate(all="ignore"):
        a1 = slope(q, v)
        v2 = v + half * a1
        a2 = slope(q + half * v, v2)
        v3 = v + half * a2
        a3 = slope(q + half * v2, v3)
        v4 = v + step * a3
        a4 = slope(q + step * v3, v4)
        return (
            q + step / 6.0 * (v + 2.0 * (v2 + v3) + v4),
            v + step / 6.0 * (a1 + 2.0 * (a2 + a3) + a4),
        )
