"""Events that a course watches: levels of the probe, its turning points, limits and the ground.

A piece of a course begins where something has happened. Before the integration goes on, the sign of
every event function that could be near zero there is made certain (`compiled_regime`). A condition
that holds already, because a motor, the regime or a level has jumped, is an event at once.
"""

from typing import TYPE_CHECKING, NamedTuple, final

from legbench.analytic.compiled import foot_from_centre
from legbench.analytic.compiled_regime import NUDGE, OFF, CompiledRegime
from legbench.analytic.dual import floats
from legbench.analytic.equations import (
    Pair,
    contact_force,
    free_foot_acceleration,
    pair_acceleration,
    sweep_height,
    sweep_rate,
)
from legbench.analytic.model import LegModel
from legbench.analytic.parameters import Event, Kind, Watched
from legbench.analytic.state import Regime
from legbench.design.statics import GRAVITY

if TYPE_CHECKING:
    from legbench.analytic.course import Course

NEVER = 1e6
"""Level that is never reached [rad]."""
TIE = 1e-7
"""Tolerance of acceleration over gravity and of force over weight when the foot is released [-]: on
the radial mode both vanish together, and rounding decides their signs."""
JUMPED = 1e-9
"""Rate beyond zero that a turning point cannot leave by rounding, only an impact [rad/s]."""
RISE, FALL, TURN, FELL, FELL_BACK = range(Event.RISE, Event.FELL_BACK + 1)
KNEE_LOW, KNEE_HIGH, HIP_LOW, HIP_HIGH = range(Event.KNEE_LOW, Event.HIP_HIGH + 1)
CONTACT, RECOVER = int(Event.CONTACT), int(Event.RECOVER)
SEEN = {
    RISE: Watched.RISE,
    FALL: Watched.FALL,
    FELL: Watched.FELL,
    FELL_BACK: Watched.FELL,
}
"""Events of angles that the caller sees, whose condition may hold already when a piece begins."""
KINDS = {Regime.FLIGHT: Kind.FLIGHT, Regime.STANCE: Kind.STANCE}
"""Compiled equations with which a regime begins; regimes that are not listed take `Kind.FIXED`."""


class Levels(NamedTuple):
    """Values of the probe at which an integration stops [rad]."""

    upper: float = NEVER
    lower: float = -NEVER
    turns: bool = False
    """Whether turning points of the probe stop it, too."""


SILENT = Levels()
"""Levels that are never reached, so that no value of the probe stops an integration."""


@final
class EventDetector:
    """The events that one course watches.

    Attributes:
        levels: levels of the probe.
        lean: largest |q1 + q2| of a leg that has not fallen [rad].
        blind: time until which touchdown and lift-off are not watched [s].
    """

    def __init__(self, course: "Course", model: LegModel, min_phase: float) -> None:
        self._course, self._plain, self._min_phase = course, model, min_phase
        self._arm = floats(foot_from_centre(model))
        self._weight = model.floating.mass * GRAVITY
        self.levels, self.lean, self.blind = SILENT, NEVER, 0.0
        self._below, self._above = -NEVER, NEVER
        self._turn, self._free = 0.0, False

    def begin(self, lean: float) -> None:
        """Begin with a leg in a new state, whose turning points are those after it."""
        self.lean, self._turn = lean, 0.0

    def enter(self, regime: Regime, since: float) -> None:
        """Begin a regime, in which contact is not watched for the shortest phase at first."""
        self._free = regime in KINDS
        self.blind = since + self._min_phase if self._free else since

    def move_to(self, compiled: CompiledRegime) -> None:
        """Set all levels in another integrator."""
        course, self._compiled = self._course, compiled
        compiled.restore()
        compiled.lay_bounds(FELL, FELL_BACK, -self.lean, self.lean, NEVER)
        course.stop_switches.lay(compiled)
        self.lay(self.levels)

    def lay(self, levels: Levels) -> None:
        """Replace the levels of the probe."""
        self.levels, compiled = levels, self._compiled
        upper, lower, turns = levels
        compiled.lay_bounds(FALL, RISE, lower, upper, NEVER)
        self._below, self._above = lower + NUDGE, upper - NUDGE
        if not turns:
            self._turn = 0.0
            if compiled.gain[TURN] != 0.0:
                compiled.lay(TURN, *OFF)

    def turned(self) -> None:
        """Watch the probe's next turning point: a minimum after a maximum, or the reverse."""
        self._turn = -self._turn
        self._compiled.lay(TURN, self._turn, 0.0)

    def due(self) -> int | None:
        """Guard every event, and return one whose condition holds already, if there is one."""
        course, compiled = self._course, self._compiled
        if compiled.moved:
            compiled.restore()
        due = self._near()
        if self.levels.turns and self._guard_turn() and due is None:
            due = TURN
        if course.stop_switches.touched:
            course.stop_switches.guard(
                compiled, course.terms, course.plain_motor, course.plain_q, course.plain_v
            )
        if self._free:
            contact = self._contact()
            due = contact if due is None else due
        return due

    def _near(self) -> int | None:
        """Guard the events of angles, and return one whose condition holds already, or None."""
        course = self._course
        (p1, p2), (q1, q2) = course.probe, course.plain_q
        reading, lean = p1 * q1 + p2 * q2, q1 + q2
        due = None
        if not self._below < reading < self._above:
            due = self._guard_two(RISE, FALL, reading)
        if abs(lean) > self.lean - NUDGE:
            fell = self._guard_two(FELL, FELL_BACK, lean)
            due = fell if due is None else due
        if not course.stop_switches.clear(q2 - q1, q1):
            self._guard_two(KNEE_LOW, KNEE_HIGH, q2 - q1)
            self._guard_two(HIP_LOW, HIP_HIGH, q1)
        return due

    def _guard_two(self, first: int, second: int, value: float) -> int | None:
        """Guard two events of an angle, and return the one whose condition holds already."""
        compiled, due = self._compiled, None
        for event in (first, second):
            if compiled.guard(event, value) and due is None:
                due = event
        return due

    def _contact(self) -> int | None:
        """Guard touchdown or lift-off; return the event if the leg cannot stay in its regime."""
        course, compiled = self._course, self._compiled
        if course.time < self.blind:
            if compiled.gain[CONTACT] != 0.0:
                compiled.lay(CONTACT, *OFF)
            return None
        if compiled.flies:
            return self._touchdown()
        force = self._force()
        if not compiled.held:
            if force < 0.0:
                return CONTACT
            self._expect(force)
            return None
        released = self.released()
        if force > TIE or released > -TIE:
            return RECOVER if force > TIE else CONTACT
        for event, reading in ((CONTACT, released), (RECOVER, force)):
            compiled.lay(event, 1.0, 0.0)
            compiled.guard(event, reading)
        return None

    def _touchdown(self) -> int | None:
        """Guard touchdown, and return it if the foot is below the ground and sinking."""
        course, compiled = self._course, self._compiled
        elapsed = float(compiled.integrator.time)
        z, dz = float(course.point[1]), float(course.drift[1])
        fallen = self._plain.floating.gravity * elapsed
        height = z + (dz - 0.5 * fallen) * elapsed
        height += sweep_height(self._plain.ops, course.plain_q, self._arm)
        if height > 0.0:
            self._expect(height)
            return None
        arm_vel = sweep_rate(self._plain.ops, course.plain_q, course.plain_v, self._arm)
        if dz - fallen + arm_vel[1] < 0.0:
            return CONTACT
        self.blind = course.time + self._min_phase  # below the ground and rising: no touchdown yet
        compiled.lay(CONTACT, *OFF)
        return None

    def _expect(self, reading: float) -> None:
        """Watch the height or the contact force fall to zero."""
        if self._compiled.gain[CONTACT] != -1.0:
            self._compiled.lay(CONTACT, -1.0, 0.0)
        if reading < NUDGE:
            self._compiled.guard(CONTACT, reading)

    def _force(self) -> float:
        """Vertical contact force on the standing foot over the weight [-]."""
        course, plain = self._course, self._plain
        q, v = course.plain_q, course.plain_v
        a = self._accelerations()
        return contact_force(plain.ops, plain.floating, q, v, a)[1] / self._weight

    def released(self) -> float:
        """Upward acceleration that the standing foot would have if released, over gravity [-]."""
        course, plain = self._course, self._plain
        q, v = course.plain_q, course.plain_v
        torque = plain.torque(course.plain_motor, q, v)
        a = course.stop_switches.released(plain.falling, torque, q, v)
        return free_foot_acceleration(plain.ops, plain.floating, q, v, a)[1] / GRAVITY

    def _accelerations(self) -> Pair:
        """Accelerations of the angles, with the stops that are switched on [rad/s^2]."""
        course, plain = self._course, self._plain
        q, v = course.plain_q, course.plain_v
        torque = plain.torque(course.plain_motor, q, v)
        if course.stop_switches.touched:
            return course.stop_switches.turns(plain.ops, course.terms, torque, q, v)[1]
        return pair_acceleration(plain.ops, course.terms, q, v, torque)

    def _guard_turn(self) -> bool:
        """Watch the probe's next turning point, the kind of which follows from its present rate.

        Returns whether an impact has just turned the probe, which is a turning point, too.
        """
        course = self._course
        (p1, p2), (v1, v2) = course.probe, course.plain_v
        rate = p1 * v1 + p2 * v2
        if self._turn == 0.0:
            towards = rate
            if abs(rate) <= NUDGE:
                a = self._accelerations()
                towards = p1 * a[0] + p2 * a[1]
            self._turn = -1.0 if towards > 0.0 else 1.0
        if self._compiled.gain[TURN] != self._turn:
            self._compiled.lay(TURN, self._turn, 0.0)
        if self._turn * rate > -NUDGE:
            self._compiled.guard(TURN, rate)
        return self._turn * rate > JUMPED
