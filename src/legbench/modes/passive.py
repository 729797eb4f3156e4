"""Hopping without motors: the hops at which touchdown costs nothing.

A plastic impact takes `m v^2 / 2` of the foot, so an undamped leg loses height at every hop,
unless its own oscillation in flight brings the foot down at rest. By time reversal that happens
when the stance turns round at rest and the flight at an apex where nothing but the fall moves:
each is then its own mirror image, and the hop ends as it began.

A stance that turns round at rest is two numbers, q1 and q2; the apex is three conditions, dz1 =
dz2 = speed = 0. So hops without impact exist at isolated values of one more number, taken here to
be z1 of the motors. On a matched leg that value is zero, because x1 = 0 meets two of the
conditions by itself, and the third one picks the depth of the stance.
"""

import math
from dataclasses import dataclass

import numpy as np

from legbench.analytic.contact import switch
from legbench.analytic.equations import Pair
from legbench.analytic.state import standing
from legbench.analytic.taylor import SILENT, TaylorLeg, Watched
from legbench.modes.drive import Passive
from legbench.modes.fixed_point import UNITS, FixedPoint, differences
from legbench.modes.hop import SCALE, Apex, apex_of, return_map
from legbench.modes.roots import bracketed, solved
from legbench.signals import Floats

STANCE = 2.0
"""Longest [s]."""
STILL = 1e-9
"""Speeds left at the apex of a solved hop [m/s, rad/s]."""
CLOSE = 1e-12
"""Speeds at which the solution ends [m/s, rad/s]."""
CLOSED = 1e-5
"""Distance between an apex and the next one of a hop without impact, in `UNITS` [-]."""
NUDGE = 1e-10
"""The foot may only touch the ground tangentially; so much lower it surely lands [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeHop:
    """A hop without impact."""

    motor: Pair
    """[rad]"""
    point: FixedPoint
    """Multipliers from differences: the foot lands as the square or the cube of time, so the map
    is not smooth there and they are an indication."""
    symmetric_loss: float
    """What the ground takes when the motors stand at z1 = 0 instead, z2 the same [J]."""

    @property
    def motor_z1(self) -> float:
        """Polar set point of the motors [rad]."""
        return SCALE * (self.motor[0] + self.motor[1])


def rebound(leg: TaylorLeg, motor: Pair, posture: Pair) -> Apex | None:
    """Apex after a leg is let go at rest from a standing posture (q1, q2) [rad].

    None if it does not fly, or meets the ground before its apex.
    """
    state = standing(leg.model, posture)
    state, what = leg.watch(state, STANCE, motor, SILENT)
    if what is not Watched.CONTACT:
        return None
    state = switch(leg.model, state)
    moved = leg.model.mass_centre_vel_from_hip(state.q, state.v)[1]
    rise = (state.trunk_vel[1] + moved) / leg.model.floating.gravity
    if rise <= 0.0:
        return None
    state, what = leg.watch(state, state.time + rise, motor, SILENT)
    return None if what is not None else apex_of(leg.model, state)


def depths(leg: TaylorLeg, half: float, halves: Floats) -> list[float]:
    """Depths on x1 = 0, among `halves` (n,), from which z2 stands still at the apex [rad].

    The motors stand at (-half, half). On a matched leg these are the hops without impact.
    """

    def still(depth: float) -> float:
        apex = rebound(leg, (-half, half), (-depth, depth))
        return math.nan if apex is None else apex.dz2

    values = np.array([still(float(depth)) for depth in halves])
    found = []
    for low, high, before, after in zip(
        halves[:-1], halves[1:], values[:-1], values[1:], strict=True
    ):
        if before * after < 0.0:
            depth = bracketed(still, float(low), float(high), 1e-14)
            if abs(still(depth)) < 1e-6:  # else a jump, not a zero
                found.append(depth)
    return found


def free_hop(leg: TaylorLeg, half: float, depth: float) -> FreeHop | None:
    """The hop without impact near a depth of `depths`; None if there is none.

    Unknown are the posture in which the stance turns round and z1 of the motors.
    """

    def motor_of(z1: float) -> Pair:
        return SCALE * z1 - half, SCALE * z1 + half

    def let_go(unknown: Floats) -> Apex | None:
        folded, lean, z1 = unknown.tolist()
        return rebound(leg, motor_of(z1), (lean - folded, lean + folded))

    def moving(unknown: Floats) -> Floats:
        apex = let_go(unknown)
        if apex is None:
            return np.full(3, math.nan)
        return np.array([apex.dz1, apex.dz2, 10.0 * apex.speed])

    found = solved(moving, np.array([depth, 0.0, 0.0]), CLOSE)
    apex = let_go(found)
    if apex is None or not np.max(np.abs(moving(found))) < STILL:
        return None
    motor = motor_of(float(found[2]))
    point = _closed(leg, Passive(motor), apex)
    if point is None:
        return None
    loss = return_map(leg, Passive(motor_of(0.0)), apex).impact
    return FreeHop(motor=motor, point=point, symmetric_loss=loss)


def _closed(leg: TaylorLeg, drive: Passive, apex: Apex) -> FixedPoint | None:
    """The whole hop, if it comes back: a leg that met a joint stop does not."""
    for lower in (0.0, NUDGE):
        start = Apex.of(apex.vector() - lower * np.eye(6)[0])
        done = return_map(leg, drive, start)
        if done.after is None:
            continue
        residual = float(np.max(np.abs(done.after.vector() - apex.vector()) / UNITS))
        if residual < CLOSED:
            values = np.linalg.eigvals(differences(leg, drive, start))
            values = values[np.argsort(-np.abs(values))]
            multipliers = tuple(complex(value) for value in values)
            return FixedPoint(apex=apex, hop=done, multipliers=multipliers, residual=residual)
    return None
