"""Hopping without motors: the hops at which touchdown costs nothing.

A plastic impact takes `m v^2 / 2` of the foot, so an undamped leg loses height at every hop,
unless its own oscillation in flight brings the foot down with no speed. By time reversal that
happens when the leg's length stands still at the apex: the flight is then its own mirror image,
and ends as it began. On x1 = 0 this is one condition on one number, the depth of the stance.
"""

import math

import numpy as np
from scipy.optimize import root_scalar

from legbench.analytic.hybrid import switch
from legbench.analytic.state import standing
from legbench.analytic.taylor import SILENT, TaylorLeg, Watched
from legbench.modes.drive import Passive
from legbench.modes.hop import Apex, apex_of
from legbench.signals import Floats

STANCE = 2.0
"""Longest [s]."""


def rebound(leg: TaylorLeg, drive: Passive, half: float) -> Apex | None:
    """Apex after a leg is let go at rest, on x1 = 0, folded to a half angle [rad].

    None if it does not fly, or meets the ground before its apex.
    """
    state = standing(leg.model, (-half, half))
    state, what = leg.watch(state, STANCE, drive.motor, SILENT)
    if what is not Watched.CONTACT:
        return None
    state = switch(leg.model, state)
    moved = leg.model.mass_centre_vel_from_hip(state.q, state.v)[1]
    rise = (state.trunk_vel[1] + moved) / leg.model.floating.gravity
    if rise <= 0.0:
        return None
    state, what = leg.watch(state, state.time + rise, drive.motor, SILENT)
    return None if what is not None else apex_of(leg.model, state)


def free_hops(leg: TaylorLeg, drive: Passive, halves: Floats) -> list[Apex]:
    """Apexes of all hops on x1 = 0 without impact, for depths between `halves` (n,) [rad]."""

    def still(half: float) -> float:
        apex = rebound(leg, drive, half)
        return math.nan if apex is None else apex.dz2

    values = np.array([still(float(half)) for half in halves])
    found = []
    for low, high, before, after in zip(
        halves[:-1], halves[1:], values[:-1], values[1:], strict=True
    ):
        if not before * after < 0.0:
            continue
        half = float(root_scalar(still, bracket=(low, high), xtol=1e-14).root)
        apex = rebound(leg, drive, half)
        if apex is not None and abs(apex.dz2) < 1e-6:
            found.append(apex)
    return found
