"""Conditions that end a piece of a hop: functions that rise through zero when an event is due."""

from typing import final

import numpy as np
from reference.lanes import Lanes
from reference.law import NEVER
from reference.legs import STOPS, depth

from legbench.signals import Bools, Floats, Ints

RISE, FALL, TURN, FELL, FELL_BACK, LIMIT, CONTACT, PUSH = 0, 1, 2, 3, 4, 5, 9, 10
"""Rows of the conditions: y rises through its upper level, falls through its lower one, or has the
extreme that its controller waits for; the leg leans too far; a joint meets or leaves one of four
limits; the foot lands or lifts off; one of four stops begins or ends to push."""
COUNT = PUSH + len(STOPS)
FALLEN = 2.4
"""Angle |q1 + q2|, twice the polar angle, at which a leg has fallen [rad]."""


@final
class Conditions:
    """The conditions of some lanes, whose switches stand still meanwhile.

    Args:
        lanes: the lanes.
        only: one condition a lane (n,), if no other is wanted; the rest may then be `-NEVER`.
    """

    def __init__(self, lanes: Lanes, only: Ints | None = None) -> None:
        self._lanes = lanes
        every = np.ones(lanes.number.size, dtype=bool)
        contact = every if only is None else only == CONTACT
        push = every if only is None else only >= PUSH
        contact = contact & (lanes.time >= lanes.blind)
        self._air = contact & lanes.flies
        self._ground = _Part(lanes, contact & ~lanes.flies)
        self._out = np.where(lanes.touched, -1.0, 1.0)
        self._stops = _Part(lanes, push & lanes.touched.any(axis=0))

    def at(self, y: Floats, time: Floats) -> Floats:
        """Values (14, ...) at states (4, ...) and times (...), lanes last."""
        lanes = self._lanes
        found = np.full((COUNT, *y.shape[1:]), -NEVER)
        reading = lanes.probe[0] * y[0] + lanes.probe[1] * y[1]
        found[RISE], found[FALL] = reading - lanes.upper, lanes.lower - reading
        found[TURN] = lanes.turning * (lanes.probe[0] * y[2] + lanes.probe[1] * y[3])
        lean = y[0] + y[1]
        found[FELL], found[FELL_BACK] = lean - FALLEN, -lean - FALLEN
        for stop in range(len(STOPS)):
            found[LIMIT + stop] = self._out[stop] * depth(lanes.legs, stop, y)
        if self._air.any():
            found[CONTACT] = np.where(self._air, -lanes.height(y, time), -NEVER)
        if (ground := self._ground).columns.size:
            found[CONTACT][..., ground.columns] = ground.lanes.pull(y[..., ground.columns])
        if self._stops.columns.size:
            self._push(found, y)
        return found

    def _push(self, found: Floats, y: Floats) -> None:
        """Fill in the conditions of the stops that are touched."""
        lanes, columns = self._stops.lanes, self._stops.columns
        asked = lanes.asked(y[..., columns])
        for stop in range(len(STOPS)):
            value = np.where(lanes.pushing[stop], -asked[stop], asked[stop])
            found[PUSH + stop][..., columns] = np.where(lanes.touched[stop], value, -NEVER)


class _Part:
    """Some of the lanes, and where they are."""

    def __init__(self, lanes: Lanes, which: Bools) -> None:
        self.columns = np.flatnonzero(which)
        self.lanes = lanes.take(self.columns)
