"""One compiled regime of one leg, whose events are kept from starting on a zero.

An integrator looks for zeros of an event function's polynomial inside a step. A function that is
zero where the step begins, because the event has just happened or because its level is the present
reading, has no sign there, and its next zero in the same step would be lost. So the sign at the
start of a step is made certain, in two ways. The level of an angle is `2 NUDGE` lower for falling
than for rising, so that an angle which has just crossed it is on the far side for the way back. A
level that is the present reading, or has been passed by the error of the step before, is moved
until the function is `NUDGE` below zero; the event then happens that much later.
"""

from typing import final

from legbench.analytic.compiled import event_integrator, parameters_of, terms_of
from legbench.analytic.equations import Pair
from legbench.analytic.model import LegModel
from legbench.analytic.parameters import GAIN, LEVEL, MOTOR, Event, Kind
from legbench.analytic.state import Regime
from legbench.signals import Floats

NUDGE = 1e-13
"""Distance from zero beyond which a sign is no rounding error, in units of the readings."""
BACK = 2.0 * NUDGE
"""Distance by which the level of a falling angle is below that of a rising one [rad]."""
RISE, FALL, TURN, FELL, FELL_BACK = range(Event.RISE, Event.FELL_BACK + 1)
CONTACT, RECOVER = int(Event.CONTACT), int(Event.RECOVER)
LAST_LOWERED = int(Event.HIP_HIGH)
"""Number of the last event whose level is lowered for falling."""
OFF = (0.0, 1.0)
"""Gain and level of an event that is not watched."""
FALLS, RISES = (-1.0, 0.0), (1.0, 0.0)
"""Gain and level of an event whose reading falls, or rises, through zero."""
KINDS = {Regime.FLIGHT: Kind.FLIGHT, Regime.STANCE: Kind.STANCE}
"""Compiled equations with which a regime begins; regimes that are not listed take `Kind.FIXED`."""
NEVER = 1e6
"""Level that is never reached [rad]."""


@final
class Levels:
    """Values of the probe at which an integration stops.

    It is no dataclass, because a hop makes several and a frozen one takes three times as long.

    Attributes:
        upper: value that stops it when the probe rises through it [rad].
        lower: value that stops it when the probe falls through it [rad].
        turns: whether turning points of the probe stop it, too.
    """

    __slots__ = ("lower", "turns", "upper")

    def __init__(self, upper: float = NEVER, lower: float = -NEVER, turns: bool = False) -> None:
        self.upper, self.lower, self.turns = upper, lower, turns


SILENT = Levels()
"""Levels that are never reached, so that no value of the probe stops an integration."""


@final
class CompiledRegime:
    """A compiled regime with the parameters of one leg, given in plain floats.

    Attributes:
        kind: set of equations and events.
        regime: contact regime.
        terms: inertia and gravity of the angles.
        free: whether touchdown or lift-off ends the regime.
        opposite: regime on the other side of touchdown or lift-off, once the leg has been there.
        held: whether the ground pulls on a foot that would go down if it were released.
        flies: whether the leg is in the air.
        pushed: the limits that joints were beyond when their pushes were set here, as bits.
        integrator: heyoka's integrator of (q1, q2, v1, v2).
        run: its integration to a time, or to the first event.
        state: view of its state (4,).
        pars: view of its parameters (n,).
        numbers: view of the state from which single numbers are read and written fast.
        slots: view of the parameters, for the same reason.
        gain: gain of each event.
        level: level of each event, before the guard moves it.
        moved: events whose levels the guard has moved.
        beyond: the limits that joints were beyond when their events were set here, as bits.
        lean: largest |q1 + q2| whose events are set here [rad].
        levels: levels of the probe whose events are set here.
    """

    __slots__ = (
        "beyond",
        "flies",
        "free",
        "gain",
        "held",
        "integrator",
        "kind",
        "lean",
        "level",
        "levels",
        "moved",
        "numbers",
        "opposite",
        "pars",
        "pushed",
        "regime",
        "run",
        "slots",
        "state",
        "terms",
    )

    def __init__(
        self, model: LegModel, regime: Regime, probe: Pair, tolerance: float, *, held: bool
    ) -> None:
        kind = self.kind = Kind.HELD if held else KINDS.get(regime, Kind.FIXED)
        self.regime, self.terms = regime, terms_of(model, regime)
        self.free = kind is not Kind.FIXED
        self.opposite: CompiledRegime | None = None
        self.held = held
        self.flies = kind is Kind.FLIGHT
        self.pushed = 0
        self.integrator = event_integrator(kind, tolerance)
        self.run = self.integrator.propagate_until
        self.state: Floats = self.integrator.state
        self.pars: Floats = self.integrator.pars
        self.pars[:] = parameters_of(model, regime, probe)[: len(self.pars)]
        self.numbers, self.slots = _slots(self.state), _slots(self.pars)
        self.gain, self.level = [0.0] * len(Event), [1.0] * len(Event)
        self.moved: list[int] = []
        self.beyond = -1
        self.lean, self.levels = 0.0, SILENT
        if self.free:
            self.lay(CONTACT, *(RISES if held else FALLS))
        if held:
            self.lay(RECOVER, *RISES)

    def put(self, q: Pair, v: Pair, motor: Pair) -> None:
        """Set angles [rad], rates [rad/s] and motors [rad] at time zero of the integrator."""
        numbers, slots = self.numbers, self.slots
        numbers[0], numbers[1] = q
        numbers[2], numbers[3] = v
        slots[MOTOR], slots[MOTOR + 1] = motor
        self.integrator.time = 0.0
        self.integrator.reset_cooldowns()

    def lay(self, event: int, gain: float, level: float) -> None:
        """Set an event to the rise of `gain * reading` through a level."""
        self.gain[event], self.level[event] = gain, level
        self.slots[GAIN + event] = gain
        if gain < 0.0 and event <= LAST_LOWERED:
            level += BACK
        self.slots[LEVEL + event] = level

    def lay_levels(self, levels: Levels) -> None:
        """Set the levels of the probe: it rises through `upper`, and falls through `lower`.

        A level as far from zero as `NEVER` switches its event off.
        """
        self.levels, upper, lower = levels, levels.upper, levels.lower
        gain, level, slots = self.gain, self.level, self.slots
        if upper < NEVER:
            gain[RISE] = slots[GAIN + RISE] = 1.0
            level[RISE] = slots[LEVEL + RISE] = upper
        elif gain[RISE] != 0.0:
            self.lay(RISE, *OFF)
        if lower > -NEVER:
            gain[FALL] = slots[GAIN + FALL] = -1.0
            level[FALL] = -lower
            slots[LEVEL + FALL] = BACK - lower
        elif gain[FALL] != 0.0:
            self.lay(FALL, *OFF)

    def lay_lean(self, lean: float) -> None:
        """Set the largest |q1 + q2| of a leg that has not fallen [rad]; `NEVER` for none."""
        self.lean = lean
        for event, gain in ((FELL, 1.0), (FELL_BACK, -1.0)):
            self.lay(event, *((gain, lean) if lean < NEVER else OFF))

    def restore(self) -> None:
        """Restore the levels that the guard has moved."""
        for event in self.moved:
            lowered = self.gain[event] < 0.0 and event <= LAST_LOWERED
            self.slots[LEVEL + event] = self.level[event] + (BACK if lowered else 0.0)
        self.moved = []

    def guard(self, event: int, reading: float) -> bool:
        """Make an event's function negative; true if it was positive by more than rounding."""
        reading *= self.gain[event]
        ahead = reading - self.slots[LEVEL + event]
        if ahead <= -NUDGE:
            return False
        self.slots[LEVEL + event] = reading + NUDGE
        self.moved.append(event)
        return ahead > NUDGE


def _slots(values: Floats) -> "memoryview[float]":
    """View of an array of floats into which single ones are written fast."""
    return values.data.cast("B").cast("d")
