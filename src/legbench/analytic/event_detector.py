"""Events that a course watches: levels of the probe, its turning points, limits and the ground.

A piece of a course begins where something has happened. Before the integration goes on, the sign of
every event function that could be near zero there is made certain (`compiled_regime`). A condition
that holds already, because a motor, the regime or a level has jumped, is an event at once.
"""

from typing import TYPE_CHECKING, NamedTuple, final

from legbench.analytic.compiled_regime import NEVER, NUDGE, OFF, CompiledRegime
from legbench.analytic.equations import (
    Pair,
    contact_force,
    free_foot_acceleration,
    pair_acceleration,
    sweep_rate,
)
from legbench.analytic.float_leg import FloatLeg
from legbench.analytic.model import LegModel
from legbench.analytic.parameters import Event, Kind, Watched
from legbench.analytic.state import Regime
from legbench.design.statics import GRAVITY

if TYPE_CHECKING:
    from legbench.analytic.course import Course

TIE = 1e-7
"""Tolerance of acceleration over gravity and of force over weight when the foot is released [-]: on
the radial mode both vanish together, and rounding decides their signs."""
JUMPED = 1e-9
"""Rate beyond zero that a turning point cannot leave by rounding, only an impact [rad/s]."""
RISE, FALL, TURN, FELL, FELL_BACK = range(Event.RISE, Event.FELL_BACK + 1)
KNEE_LOW, KNEE_HIGH, HIP_LOW, HIP_HIGH = range(Event.KNEE_LOW, Event.HIP_HIGH + 1)
CONTACT, RECOVER = int(Event.CONTACT), int(Event.RECOVER)
SEEN = (Watched.RISE, Watched.FALL, Watched.TURN, Watched.FELL, Watched.FELL)
"""Events of angles as the caller sees them, in their order, which are the first ones."""
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

    __slots__ = (
        "_above",
        "_arm",
        "_below",
        "_compiled",
        "_course",
        "_floats",
        "_min_phase",
        "_most",
        "_plain",
        "_probe",
        "_turn",
        "_weight",
        "blind",
        "lean",
        "levels",
    )

    def __init__(
        self, course: "Course", model: LegModel, floats: FloatLeg, arm: Pair, min_phase: float
    ) -> None:
        self._course, self._plain, self._floats = course, model, floats
        self._arm, self._min_phase, self._probe = arm, min_phase, course.probe
        self._weight = model.floating.mass * GRAVITY
        self.levels, self.lean, self.blind = SILENT, NEVER, 0.0
        self._most = NEVER - NUDGE
        self._below, self._above = -NEVER, NEVER
        self._turn = 0.0

    def begin(self, lean: float) -> None:
        """Begin with a leg in a new state, whose turning points are those after it."""
        self.lean, self._most, self._turn = lean, lean - NUDGE, 0.0

    def enter(self, compiled: CompiledRegime, since: float) -> None:
        """Begin a regime, in which contact is not watched for the shortest phase at first."""
        self.blind = since + self._min_phase if compiled.free else since

    def move_to(self, compiled: CompiledRegime) -> None:
        """Set all levels in another integrator."""
        self._compiled = compiled
        if compiled.moved:
            compiled.restore()
        if compiled.lean != self.lean:
            compiled.lean = self.lean
            compiled.lay_bounds(FELL, FELL_BACK, -self.lean, self.lean)
        self._course.stop_switches.lay(compiled)
        self.lay(self.levels)
        if compiled.gain[TURN] != self._turn:
            compiled.lay(TURN, self._turn, 0.0) if self._turn else compiled.lay(TURN, *OFF)

    def lay(self, levels: Levels) -> None:
        """Replace the levels of the probe."""
        self.levels = levels
        upper, lower, turns = levels
        self._compiled.lay_bounds(FALL, RISE, lower, upper)
        self._below, self._above = lower + NUDGE, upper - NUDGE
        if not turns and self._turn != 0.0:
            self._turn = 0.0
            self._compiled.lay(TURN, *OFF)

    def turned(self) -> None:
        """Watch the probe's next turning point: a minimum after a maximum, or the reverse."""
        self._turn = -self._turn
        self._compiled.lay(TURN, self._turn, 0.0)

    def due(self) -> int | None:
        """Guard every event, and return one whose condition holds already, if there is one."""
        course, compiled = self._course, self._compiled
        if compiled.moved:
            compiled.restore()
        (p1, p2), (q1, q2) = self._probe, course.plain_q
        switches, due = course.stop_switches, None
        reading, lean, knee = p1 * q1 + p2 * q2, q1 + q2, q2 - q1
        if not self._below < reading < self._above:
            due = self._guard_two(RISE, FALL, reading)
        if not -self._most < lean < self._most:
            fell = self._guard_two(FELL, FELL_BACK, lean)
            due = fell if due is None else due
        low, high, back, front = switches.clear
        if not (low < knee < high and back < q1 < front):
            self._guard_two(KNEE_LOW, KNEE_HIGH, knee)
            self._guard_two(HIP_LOW, HIP_HIGH, q1)
        if self.levels.turns and self._guard_turn() and due is None:
            due = TURN
        if switches.touched:
            switches.guard(
                compiled, course.terms, course.plain_motor, course.plain_q, course.plain_v
            )
        if compiled.free:
            contact = self._contact()
            due = contact if due is None else due
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
        elapsed, z, dz = course.elapsed, float(course.point[1]), float(course.drift[1])
        fallen = self._plain.floating.gravity * elapsed
        height = z + (dz - 0.5 * fallen) * elapsed + self._floats.foot_height(course.plain_q)
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
        motor, q, v = course.plain_motor, course.plain_q, course.plain_v
        if not course.stop_switches.touched:
            return self._floats.force(motor, q, v)
        return contact_force(plain.ops, plain.floating, q, v, self._accelerations())[1] / self._weight

    def released(self) -> float:
        """Upward acceleration that the standing foot would have if released, over gravity [-]."""
        course, plain = self._course, self._plain
        motor, q, v = course.plain_motor, course.plain_q, course.plain_v
        if course.stop_switches.touched:
            torque = self._floats.torque(motor, q, v)
            a = course.stop_switches.released(plain.falling, torque, q, v)
        else:
            a = self._floats.accelerations(plain.falling, motor, q, v)
        return free_foot_acceleration(plain.ops, plain.floating, q, v, a)[1] / GRAVITY

    def _accelerations(self) -> Pair:
        """Accelerations of the angles, with the stops that are switched on [rad/s^2]."""
        course, plain = self._course, self._plain
        motor, q, v = course.plain_motor, course.plain_q, course.plain_v
        if course.stop_switches.touched:
            torque = self._floats.torque(motor, q, v)
            return course.stop_switches.turns(plain.ops, course.terms, torque, q, v)[1]
        return self._floats.accelerations(course.terms, motor, q, v)

    def _guard_turn(self) -> bool:
        """Watch the probe's next turning point, the kind of which follows from its present rate.

        Returns whether an impact has just turned the probe, which is a turning point, too.
        """
        (p1, p2), (v1, v2) = self._probe, self._course.plain_v
        rate = p1 * v1 + p2 * v2
        if self._turn == 0.0:
            towards = rate
            if abs(rate) <= NUDGE:
                a = self._accelerations()
                towards = p1 * a[0] + p2 * a[1]
            self._turn = -1.0 if towards > 0.0 else 1.0
            self._compiled.lay(TURN, self._turn, 0.0)
        if self._turn * rate > -NUDGE:
            self._compiled.guard(TURN, rate)
        return self._turn * rate > JUMPED
