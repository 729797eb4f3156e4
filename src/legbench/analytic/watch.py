"""One compiled regime of one leg, and the guard of its events against the zeros they start on.

An integrator looks for zeros of an event function's polynomial inside a step. A function that is
zero where the step begins, because the event has just happened or because a level was laid where
the leg stands, has no sign there, and its next zero in the same step would be lost. So each event
has a side that it is known to be on, in two ways. An angle's level lies `2 NUDGE` lower for who
falls than for who rises, so whoever has just crossed it is on the far side for the way back. And
what is laid where the leg stands, or has been on the wrong side of zero by the error of the step
before, is moved until it is `NUDGE` on its own side; the event then happens that much later.
"""

from typing import final

from legbench.analytic.compiled import event_integrator
from legbench.analytic.places import GAIN, LEVEL, Event, Kind
from legbench.signals import Floats

NUDGE = 1e-13
"""Distance from zero that tells a side from rounding, in units of the events' readings."""
BACK = 2.0 * NUDGE
"""How much further an angle or rate falls than it rises until a level is crossed."""
OFF = (0.0, 1.0)
"""Gain and level of an event that is not watched."""


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
        moved: events whose levels the guard has moved.
        version: of the limits that are watched.
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
        self.moved: list[int] = []
        self.version = -1

    def lay(self, event: int, gain: float, level: float) -> None:
        """Watch `gain * reading` rise through a level."""
        self.gain[event], self.level[event] = gain, level
        self.pars[GAIN + event] = gain
        back = BACK if gain < 0.0 and event <= Event.HIP_HIGH else 0.0
        self.pars[LEVEL + event] = level + back

    def lay_bounds(self, fall: int, rise: int, lower: float, upper: float, never: float) -> None:
        """Watch a reading fall through a lower and rise through an upper level, unless `never`."""
        if upper != self.level[rise] or self.gain[rise] == 0.0:
            self.lay(rise, *((1.0, upper) if upper < never else OFF))
        if -lower != self.level[fall] or self.gain[fall] == 0.0:
            self.lay(fall, *((-1.0, -lower) if lower > -never else OFF))

    def restore(self) -> None:
        """Put the levels back that the guard has moved."""
        for event in self.moved:
            self.lay(event, self.gain[event], self.level[event])
        self.moved.clear()

    def guard(self, event: int, reading: float) -> bool:
        """Put an event on its own side of zero; whether it was beyond by more than rounding."""
        ahead = self.gain[event] * reading - self.level[event]
        if ahead <= -NUDGE:
            return False
        self.pars[LEVEL + event] = self.gain[event] * reading + NUDGE
        self.moved.append(event)
        return ahead > NUDGE
