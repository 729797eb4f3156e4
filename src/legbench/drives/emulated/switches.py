"""Limit switches, home switch and index pulse of an emulated motor; pure."""

import math
from typing import final

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.homing_methods import Until
from legbench.drives.setup.units import AxisUnits

LIMIT_SWITCH = 0.05
"""Distance of each limit switch from the mechanical stop behind it [rad]."""


@final
class Switches:
    """Switches along the way of one motor, by its travel from the true zero [counts].

    The negative limit switch lies where counts are lowest, whatever the sign of the axis.
    """

    def __init__(self, units: AxisUnits, behaviour: Behaviour) -> None:
        per_rad = units.counts_per_rad
        self._per_rev, self._offset = units.counts_per_rev, units.offset_counts
        stops = behaviour.hard_stop or (-math.inf, math.inf)
        inside = LIMIT_SWITCH * abs(per_rad)
        low, high = sorted(stop * per_rad for stop in stops)
        self._limits = (low + inside, high - inside)
        home = behaviour.home_switch
        self._home = None if home is None else sorted(end * per_rad for end in home)
        self.present = behaviour.hard_stop is not None or home is not None

    def active(self, switch: Until, travel: float) -> bool:
        """Whether a switch is active at a place."""
        if switch is Until.NEGATIVE_LIMIT:
            return travel <= self._limits[0]
        if switch is Until.POSITIVE_LIMIT:
            return travel >= self._limits[1]
        return self._home is not None and self._home[0] <= travel <= self._home[1]

    def inputs(self, travel: float, sign: int = 1) -> int:
        """Bits 0 to 2 of the digital inputs (60FDh): negative limit, positive limit, home.

        Args:
            travel: place of the motor [counts].
            sign: -1 where the polarity (607Eh) turns the axis round, and its limits with it.
        """
        ends = (Until.NEGATIVE_LIMIT, Until.POSITIVE_LIMIT)[::sign]
        switches = (*ends, Until.HOME)
        return sum(self.active(switch, travel) << place for place, switch in enumerate(switches))

    def next_index(self, travel: float, direction: int) -> float:
        """Place of the next index pulse in a direction, one for each turn of the encoder."""
        turns = (travel + self._offset) / self._per_rev
        whole = math.floor(turns) if direction < 0 else math.ceil(turns)
        return float(whole * self._per_rev - self._offset)
