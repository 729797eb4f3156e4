"""What a course looks out for: levels, turns, limits and the ground, each guarded.

A piece of a course begins where something has happened. Before it goes on, every event that could
be near its zero there is put on its own side (`watch`), and a condition that holds already is told:
it has come about by a jump, of a motor, of a regime or of the levels themselves.
"""

from typing import TYPE_CHECKING, NamedTuple, final

from legbench.analytic.compiled import foot_from_centre
from legbench.analytic.dual import floats
from legbench.analytic.equations import (
    Pair,
    contact_force,
    free_foot_acceleration,
    pair_acceleration,
    sweep,
    sweep_rate,
)
from legbench.analytic.model import LegModel
from legbench.analytic.places import Event, Kind, Watched
from legbench.analytic.state import Regime
from legbench.analytic.watch import NUDGE, OFF, Watch
from legbench.design.statics import GRAVITY

if TYPE_CHECKING:
    from legbench.analytic.course import Course

NEVER = 1e6
"""Level that is never reached [rad]."""
TIE = 1e-7
"""Acceleration over gravity below which the released foot counts as rising: on the radial mode it
vanishes together with the force [-]."""
RISE, FALL, FELL, FELL_BACK, TURN, CONTACT = map(
    int, (Event.RISE, Event.FALL, Event.FELL, Event.FELL_BACK, Event.TURN, Event.CONTACT)
)
ANGLES = (RISE, FALL, FELL, FELL_BACK, *range(Event.KNEE_LOW, Event.HIP_HIGH + 1))
"""Events that look at angles: two at the probe, two at q1 + q2, two at the knee, two at q1."""
SEEN = {
    RISE: Watched.RISE,
    FALL: Watched.FALL,
    FELL: Watched.FELL,
    FELL_BACK: Watched.FELL,
}
"""Conditions on angles, which may hold already when a piece begins."""
KINDS = {Regime.FLIGHT: Kind.FLIGHT, Regime.STANCE: Kind.STANCE}
"""The compiled equations that a regime begins with; the fixed ones for all others."""


class Levels(NamedTuple):
    """Values of the probe at which an integration stops [rad]."""

    upper: float = NEVER
    lower: float = -NEVER
    turns: bool = False
    """Whether the probe's turns stop it, too."""


SILENT = Levels()


@final
class Lookout:
    """The events that one course watches.

    Attributes:
        levels: those of the probe.
        lean: largest |q1 + q2| of a leg that has not fallen [rad].
        blind: time until which the ground is not looked at [s].
    """

    def __init__(self, course: "Course", model: LegModel, min_phase: float) -> None:
        self._course, self._plain, self._min_phase = course, model, min_phase
        self._arm = floats(foot_from_centre(model))
        self._weight = model.floating.mass * GRAVITY
        self.levels, self.lean, self.blind = SILENT, NEVER, 0.0
        self._turn, self._free = 0.0, False

    def enter(self, regime: Regime, since: float) -> None:
        """Begin a regime: the ground is not looked at for the shortest phase, turns start anew."""
        self._free, self._turn = regime in KINDS, 0.0
        self.blind = since + self._min_phase if self._free else since

    def move_to(self, watch: Watch) -> None:
        """Lay all levels in another integrator."""
        course, self._watch = self._course, watch
        watch.restore()
        watch.lay_bounds(FELL, FELL_BACK, -self.lean, self.lean, NEVER)
        course.bumpers.lay(watch)
        self.lay(self.levels)

    def lay(self, levels: Levels) -> None:
        """Watch other levels."""
        self.levels, watch = levels, self._watch
        watch.lay_bounds(FALL, RISE, levels.lower, levels.upper, NEVER)
        if not levels.turns:
            self._turn = 0.0
            if watch.gain[TURN] != 0.0:
                watch.lay(TURN, *OFF)

    def turned(self) -> None:
        """Watch the probe's next turn, which is the other kind."""
        self._turn = -self._turn
        self._watch.lay(TURN, self._turn, 0.0)

    def due(self) -> int | None:
        """Guard every event against the zero it starts on; one whose condition holds already."""
        course, watch = self._course, self._watch
        if watch.moved:
            watch.restore()
        due = self._near()
        if self.levels.turns:
            self._guard_turn()
        if course.bumpers.touched:
            course.bumpers.guard(
                watch, course.terms, course.plain_motor, course.plain_q, course.plain_v
            )
        if self._free:
            contact = self._contact()
            due = contact if due is None else due
        return due

    def _near(self) -> int | None:
        """Guard the events of angles; one whose condition holds already."""
        course, watch = self._course, self._watch
        (p1, p2), (q1, q2), gain, level = course.probe, course.plain_q, watch.gain, watch.level
        reading, lean, knee = p1 * q1 + p2 * q2, q1 + q2, q2 - q1
        due = None
        for event, value in zip(
            ANGLES, (reading, reading, lean, lean, knee, knee, q1, q1), strict=True
        ):
            if gain[event] * value - level[event] > -NUDGE:
                beyond = watch.guard(event, value)
                if beyond and due is None and event in SEEN:
                    due = event
        return due

    def _contact(self) -> int | None:
        """Guard touchdown or lift-off; the event if the leg cannot stay in its regime."""
        course, watch = self._course, self._watch
        if course.time < self.blind:
            if watch.gain[CONTACT] != 0.0:
                watch.lay(CONTACT, *OFF)
            return None
        if watch.flies:
            return self._touchdown()
        force = self._force()
        if not watch.held:
            if force < 0.0:
                return CONTACT
            self._expect(force)
            return None
        released = self.released()
        if force > TIE or released > -TIE:
            return Event.RECOVER if force > TIE else CONTACT
        for event, reading in ((CONTACT, released), (Event.RECOVER, force)):
            watch.lay(event, 1.0, 0.0)
            watch.guard(event, reading)
        return None

    def _touchdown(self) -> int | None:
        """Guard touchdown; the event if the foot is through the ground and sinking."""
        course, watch = self._course, self._watch
        elapsed = float(watch.integrator.time)
        z, dz = float(course.point[1]), float(course.drift[1])
        fallen = self._plain.floating.gravity * elapsed
        height = z + (dz - 0.5 * fallen) * elapsed
        height += sweep(self._plain.ops, course.plain_q, self._arm)[1]
        if height > 0.0:
            self._expect(height)
            return None
        arm_vel = sweep_rate(self._plain.ops, course.plain_q, course.plain_v, self._arm)
        if dz - fallen + arm_vel[1] < 0.0:
            return CONTACT
        self.blind = course.time + self._min_phase  # under the ground and rising: look later
        watch.lay(CONTACT, *OFF)
        return None

    def _expect(self, reading: float) -> None:
        """Watch height or force fall to zero."""
        if self._watch.gain[CONTACT] != -1.0:
            self._watch.lay(CONTACT, -1.0, 0.0)
        if reading < NUDGE:
            self._watch.guard(CONTACT, reading)

    def _force(self) -> float:
        """Vertical force on the standing foot, over the weight."""
        course, plain = self._course, self._plain
        q, v = course.plain_q, course.plain_v
        a = self._accelerations()
        return contact_force(plain.ops, plain.floating, q, v, a)[1] / self._weight

    def released(self) -> float:
        """Acceleration that the standing foot would have if it were let go, over gravity."""
        course, plain = self._course, self._plain
        q, v = course.plain_q, course.plain_v
        torque = plain.torque(course.plain_motor, q, v)
        a = course.bumpers.released(plain.falling, torque, q, v)
        return free_foot_acceleration(plain.ops, plain.floating, q, v, a)[1] / GRAVITY

    def _accelerations(self) -> Pair:
        """Accelerations of the angles, where those stops act that are known to."""
        course, plain = self._course, self._plain
        q, v = course.plain_q, course.plain_v
        torque = plain.torque(course.plain_motor, q, v)
        if course.bumpers.touched:
            return course.bumpers.turns(plain.ops, course.terms, torque, q, v)[1]
        return pair_acceleration(plain.ops, course.terms, q, v, torque)

    def _guard_turn(self) -> None:
        """Watch the probe's next turn, which is the other kind after one that has just been."""
        course = self._course
        (p1, p2), (v1, v2) = course.probe, course.plain_v
        rate = p1 * v1 + p2 * v2
        if self._turn == 0.0:
            towards = rate
            if abs(rate) <= NUDGE:
                a = self._accelerations()
                towards = p1 * a[0] + p2 * a[1]
            self._turn = -1.0 if towards > 0.0 else 1.0
        if self._watch.gain[TURN] != self._turn:
            self._watch.lay(TURN, self._turn, 0.0)
        if self._turn * rate > -NUDGE:
            self._watch.guard(TURN, rate)
