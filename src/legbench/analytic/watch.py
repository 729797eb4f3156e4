"""One compiled regime of one leg, and the guard of its events against the zeros they start on.

An integrator looks for zeros of an event function's polynomial inside a step. A function that is
zero where the step begins, because the event has just happened or because a level was laid where
the leg stands, has no sign there, and its next zero in the same step would be lost. So each event
has a side that it is known to be on. When a piece begins nearer to the zero than `NUDGE`, or on
the wrong side of it by the error of the step before, the level is moved until the function is
`NUDGE` on its own side; the event then happens that much later.
"""

import math
from typing import final

from legbench.analytic.compiled import event_integrator
from legbench.analytic.places import GAIN, LEVEL, Event, Kind
from legbench.signals import Floats

NUDGE = 1e-13
"""Distance from zero that tells a side from rounding, in units of the events' readings."""
OFF = (0.0, 1.0)
"""Gain and level of an event that is not watched."""
PAIRS = (
    (Event.RISE, Event.FALL),
    (Event.FELL, Event.FELL_BACK),
    (Event.KNEE_LOW, Event.KNEE_HIGH),
    (Event.HIP_LOW, Event.HIP_HIGH),
)
"""Events that look at the same reading: probe, q1 + q2, knee, q1."""
READINGS = len(PAIRS)
PAIR_OF = {
    int(event): (reading, *map(int, pair)) for reading, pair in enumerate(PAIRS) for event in pair
}
"""Reading of an event, and the two events that look at it."""


@final
class Watch:
    """A compiled regime with the parameters of one leg.

    Attributes:
        kind: which equations and events.
        held: whether the ground pulls on a foot that would go down if it were let go.
        flies: whether nothing touches the ground.
        pushed: whether a joint is beyond a limit.
        integrator: heyoka's, for (q1, q2, v1, v2).
        state: view of its state (4,).
        pars: view of its parameters (n,).
        gain: gain of each event.
        level: level of each event, before the guard moves it.
        low: largest of each reading of `PAIRS` at which one of its events is near.
        high: smallest.
    """

    def __init__(self, kind: Kind, values: list[float], tolerance: float) -> None:
        self.kind = kind
        self.held = kind is Kind.HELD
        self.flies = kind is Kind.FLIGHT
        self.pushed = False
        self.integrator = event_integrator(kind, tolerance)
        self.state: Floats = self.integrator.state
        self.pars: Floats = self.integrator.pars
        self.pars[:] = values[: len(self.pars)]
        self.gain, self.level = [0.0] * len(Event), [1.0] * len(Event)
        self.low, self.high = [-math.inf] * READINGS, [math.inf] * READINGS
        self._moved: list[int] = []

    def lay(self, event: int, gain: float, level: float) -> None:
        """Watch `gain * reading` rise through a level."""
        self.gain[event], self.level[event] = gain, level
        self.pars[GAIN + event], self.pars[LEVEL + event] = gain, level
        pair = PAIR_OF.get(event)
        if pair is not None:
            self._bound(*pair)

    def _bound(self, reading: int, first: int, second: int) -> None:
        """Find the range in which neither event of a reading is near."""
        low, high = -math.inf, math.inf
        for event in (first, second):
            level = self.level[event]
            if self.gain[event] > 0.0:
                high = min(high, level - NUDGE)
            elif self.gain[event] < 0.0:
                low = max(low, NUDGE - level)
        self.low[reading], self.high[reading] = low, high

    def lay_bounds(self, fall: int, rise: int, lower: float, upper: float, never: float) -> None:
        """Watch a reading fall through a lower and rise through an upper level, unless `never`."""
        if upper != self.level[rise] or self.gain[rise] == 0.0:
            self.lay(rise, *((1.0, upper) if upper < never else OFF))
        if -lower != self.level[fall] or self.gain[fall] == 0.0:
            self.lay(fall, *((-1.0, -lower) if lower > -never else OFF))

    def restore(self) -> None:
        """Put the levels back that the guard has moved."""
        if self._moved:
            for event in self._moved:
                self.pars[LEVEL + event] = self.level[event]
            self._moved.clear()

    def guard(self, event: int, reading: float) -> bool:
        """Put an event on its own side of zero; whether it was beyond by more than rounding."""
        ahead = self.gain[event] * reading - self.level[event]
        if ahead <= -NUDGE:
            return False
        self.pars[LEVEL + event] = self.gain[event] * reading + NUDGE
        self._moved.append(event)
        return ahead > NUDGE
