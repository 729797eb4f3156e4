"""Axis of a contact force that shows stance, whatever the foot's impacts peak at."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from legbench.design.statics import GRAVITY
from legbench.signals import Bools, Floats

SHARE: Final = 99.0
"""Percentile of the forces in stance that the axis shows [%]: an impact lasts a few rows."""
ROOM: Final = 1.3
"""Length of the axis over that force [-]."""
LIVE_WEIGHTS: Final = 5.0
"""Largest force shown while a run goes on, whose stances are yet to come, over the weight [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceAxis:
    """Range of an axis of contact forces, and what lies beyond it."""

    low: float
    """Lower end [N]."""
    high: float
    """Upper end [N]."""
    peak: float | None = None
    """Largest force, where the axis does not show it [N]."""

    @property
    def words(self) -> str:
        """Words about what lies beyond the axis; empty where nothing does."""
        return "" if self.peak is None else f"impacts reach {self.peak:.0f} N"


def force_axis(force: Floats, stance: Bools) -> ForceAxis | None:
    """Axis for the contact forces (n, 2) [N] of a run; none where it knows none, or has no stance.

    Args:
        force: contact forces, forward and up.
        stance: mask of the rows in stance (n,).
    """
    known = np.isfinite(force).all(axis=1)
    loads = force[known & stance]
    if not len(loads):
        return None
    low, high = (float(np.percentile(loads, share)) for share in (100.0 - SHARE, SHARE))
    room = (ROOM - 1.0) * max(high - low, 1e-3)
    low, high = min(low, 0.0) - 0.2 * room, high + room
    beyond = max(float(loads.max()), -float(loads.min()))
    shown = low <= float(force[known].min()) and float(force[known].max()) <= high
    return ForceAxis(low=low, high=high, peak=None if shown else beyond)


def live_force_axis(mass: float) -> ForceAxis:
    """Axis for the contact forces of a leg of some mass [kg] while its run goes on."""
    high = LIVE_WEIGHTS * GRAVITY * mass
    return ForceAxis(low=-0.2 * high, high=high)
