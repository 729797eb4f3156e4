"""Events of a leg in motion: levels of the probe, its turning points, limits and the ground.

A piece of its integration begins where something has happened. Before the integration goes on, the
sign of every event function that could be near zero there is made certain (`compiled_regime`). A
condition that holds already, because a motor, the regime or a level has jumped, is at once an
event.
"""

from typing import final

from legbench.analytic.compiled_regime import (
    FALL,
    FELL,
    FELL_BACK,
    NEVER,
    NUDGE,
    OFF,
    RISE,
    SILENT,
    TURN,
    CompiledRegime,
    Levels,
)
from legbench.analytic.contact_watch import ContactWatch
from legbench.analytic.moving_leg import MovingLeg
from legbench.analytic.parameters import Event, Watched

JUMPED = 1e-9
"""Rate beyond zero that a turning point cannot leave by rounding, only an impact [rad/s]."""
KNEE_LOW, KNEE_HIGH, HIP_LOW, HIP_HIGH = range(Event.KNEE_LOW, Event.HIP_HIGH + 1)
SEEN = (Watched.RISE, Watched.FALL, Watched.TURN, Watched.FELL, Watched.FELL)
"""Events of angles as the caller sees them, in their order, which are the first ones."""


@final
class EventDetector:
    """Events that are watched while one leg moves.

    Attributes:
        levels: levels of the probe.
        lean: largest |q1 + q2| of a leg that has not fallen [rad].
    """

    __slots__ = (
        "_bounds",
        "_compiled",
        "_contact",
        "_leg",
        "_probe",
        "_turn",
        "_turns",
        "lean",
        "levels",
    )

    def __init__(self, leg: MovingLeg, contact: ContactWatch) -> None:
        self._leg, self._contact, self._probe = leg, contact, leg.probe
        self.levels, self.lean = SILENT, NEVER
        self._turns, self._turn = False, 0.0
        self._bounds = (-NEVER, NEVER, NEVER)

    def begin(self, lean: float) -> None:
        """Begin with a leg in a new state, whose turning points are those after it."""
        self._turn = 0.0
        if lean != self.lean:
            self.lean, self._bounds = lean, (*self._bounds[:2], lean - NUDGE)

    def move_to(self, compiled: CompiledRegime) -> None:
        """Set all levels in another integrator."""
        self._compiled = compiled
        if compiled.moved:
            compiled.restore()
        if compiled.lean != self.lean:
            compiled.lay_lean(self.lean)
        switches = self._leg.stop_switches
        if compiled.beyond != switches.beyond:
            switches.lay(compiled)
        if compiled.levels is not self.levels:
            self.lay(self.levels)
        if compiled.gain[TURN] != self._turn:
            compiled.lay(TURN, self._turn, 0.0) if self._turn else compiled.lay(TURN, *OFF)

    def lay(self, levels: Levels) -> None:
        """Replace the levels of the probe."""
        self._compiled.lay_levels(levels)
        self.levels, self._turns = levels, levels.turns
        self._bounds = (levels.lower - NUDGE, levels.upper - NUDGE, self.lean - NUDGE)
        if self._turn != 0.0 and not self._turns:
            self._turn = 0.0
            self._compiled.lay(TURN, *OFF)

    def turned(self) -> None:
        """Watch the probe's next turning point: a minimum after a maximum, or the reverse."""
        self._turn = -self._turn
        self._compiled.lay(TURN, self._turn, 0.0)

    def due(self) -> int | None:
        """Guard every event, and return one whose condition holds already, if there is one."""
        leg, compiled = self._leg, self._compiled
        if compiled.moved:
            compiled.restore()
        (p1, p2), (q1, q2), switches = self._probe, leg.plain_q, leg.stop_switches
        (below, above, most), due = self._bounds, None
        low, high, back, front = switches.clear
        if not (
            below < p1 * q1 + p2 * q2 < above
            and -most < q1 + q2 < most
            and low < q2 - q1 < high
            and back < q1 < front
        ):
            due = self._near(q1, q2)
        if self._turns:
            v1, v2 = leg.plain_v
            rate = p1 * v1 + p2 * v2
            if not self._turn * (rate + NUDGE) < 0.0 and self._guard_turn(rate) and due is None:
                due = TURN
        if switches.touched:
            switches.guard(compiled, leg.plain_motor, leg.plain_q, leg.plain_v)
        if compiled.free:
            contact = self._contact.due()
            due = contact if due is None else due
        return due

    def _near(self, q1: float, q2: float) -> int | None:
        """Guard the events of angles, and return one whose condition holds already, or None."""
        due = self._guard_two(RISE, FALL, self._probe[0] * q1 + self._probe[1] * q2)
        fell = self._guard_two(FELL, FELL_BACK, q1 + q2)
        self._guard_two(KNEE_LOW, KNEE_HIGH, q2 - q1)
        self._guard_two(HIP_LOW, HIP_HIGH, q1)
        return fell if due is None else due

    def _guard_two(self, first: int, second: int, value: float) -> int | None:
        """Guard two events of an angle, and return the one whose condition holds already."""
        compiled, due = self._compiled, None
        for event in (first, second):
            if compiled.guard(event, value) and due is None:
                due = event
        return due

    def _guard_turn(self, rate: float) -> bool:
        """Watch the probe's next turning point, the kind of which follows from its present rate.

        Returns whether an impact has just turned the probe, which is a turning point, too.
        """
        if self._turn == 0.0:
            self._turn = -1.0 if self._towards(rate) > 0.0 else 1.0
            self._compiled.lay(TURN, self._turn, 0.0)
        self._compiled.guard(TURN, rate)
        return self._turn * rate > JUMPED

    def _towards(self, rate: float) -> float:
        """Rate of the probe, or its acceleration if it is at rest."""
        if abs(rate) > NUDGE:
            return rate
        leg = self._leg
        a1, a2 = leg.stop_switches.accelerations(
            leg.terms, leg.plain_motor, leg.plain_q, leg.plain_v
        )
        return self._probe[0] * a1 + self._probe[1] * a2
