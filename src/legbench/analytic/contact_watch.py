"""Watch over touchdown and lift-off of a leg: their event, and conditions that hold already.

After an event the new regime lasts a shortest time at least, at the end of which a foot that sinks
below the ground lands, and a force that pulls lifts the foot off. The event is watched from the
beginning all the same, because a piece of the integration then need not end at that time. It is
masked until then if it comes too early, or if its reading is negative from the beginning.

A foot lifts off at height zero, where its event is guarded (`compiled_regime`), so that it lands
below the ground by the guard's distance. If it lands so slowly that this takes a noticeable time,
the piece is taken again with the event masked at first.
"""

from math import cos
from typing import final

from legbench.analytic.compiled_regime import CONTACT, FALLS, NUDGE, OFF, RECOVER
from legbench.analytic.equations import Pair, contact_force, free_foot_acceleration, sweep_rate
from legbench.analytic.moving_leg import MovingLeg
from legbench.design.statics import GRAVITY

TIE = 1e-7
"""Tolerance of acceleration over gravity and of force over weight when the foot is released [-]: on
the radial mode both vanish together, and rounding decides their signs."""
SLOW = 0.01
"""Landing speed below which a guarded height is noticeable: it delays landing by 1e-11 s [m/s]."""
Beginning = tuple[float, Pair, Pair, Pair, Pair]
"""Time, angles, rates, and steady point with its velocity."""


@final
class ContactWatch:
    """Touchdown and lift-off of one leg.

    Attributes:
        earliest: time before which the regime cannot end [s].
        masked: whether the event is switched off until then.
    """

    __slots__ = (
        "_arm",
        "_floats",
        "_half",
        "_leg",
        "_lifted",
        "_min_phase",
        "_plain",
        "earliest",
        "masked",
    )

    def __init__(self, leg: MovingLeg, min_phase: float) -> None:
        self._leg, self._plain, self._floats = leg, leg.plain, leg.quick
        self._arm, self._min_phase = leg.plain_arm, min_phase
        self._half = 0.5 * leg.plain.floating.gravity
        self.earliest, self.masked = 0.0, False
        self._lifted: Beginning | None = None
        """Beginning of the present piece if that is a lift-off whose height is guarded."""

    def enter(self, since: float) -> None:
        """Begin a regime."""
        if self.masked:
            self._unmask()
        self.earliest, self._lifted = since + self._min_phase, None

    def due(self) -> int | None:
        """Guard touchdown or lift-off; return the event if the leg cannot stay in its regime."""
        leg = self._leg
        compiled = leg.compiled
        if self.masked:
            if leg.time < self.earliest:
                return None
            self._unmask()
        if compiled.flies:
            if leg.time == leg.since:
                self._lift()
                return None
            elapsed, (q1, q2), (arm_1, arm_2) = leg.elapsed, leg.plain_q, self._arm
            (_, z), (_, dz), self._lifted = leg.point, leg.drift, None
            height = z + (dz - self._half * elapsed) * elapsed - arm_1 * cos(q1) - arm_2 * cos(q2)
            return self._touchdown(height) if height < NUDGE else None
        if compiled.held:
            return self._held()
        if leg.stop_switches.touched:
            force = self._force()
        else:
            force = self._floats.force(leg.plain_motor, leg.plain_q, leg.plain_v)
        return self._liftoff(force) if force < NUDGE else None

    def repeats(self) -> Beginning | None:
        """Beginning of the last piece, if its landing is so slow that the guard delayed it."""
        late = self._lifted is not None and self._leg.time >= self.earliest
        return self._lifted if late and self._foot_speed() > -SLOW else None

    def ends_regime(self) -> bool:
        """Whether the event that has been met ends the regime.

        It does not if it is too early, which masks it, or if a foot without load would go down.
        """
        leg, compiled = self._leg, self._leg.compiled
        if leg.time < self.earliest:
            self.mask()
            return False
        return compiled.flies or compiled.held or self.released() > -TIE

    def released(self) -> float:
        """Upward acceleration that the standing foot would have if released, over gravity [-]."""
        leg, plain = self._leg, self._plain
        motor, q, v = leg.plain_motor, leg.plain_q, leg.plain_v
        if leg.stop_switches.touched:
            torque = self._floats.torque(motor, q, v)
            a = leg.stop_switches.released(plain.falling, torque, q, v)
            return free_foot_acceleration(plain.ops, plain.floating, q, v, a)[1] / GRAVITY
        return self._floats.released(motor, q, v)

    def mask(self) -> None:
        """Switch the event off until the regime may end."""
        self.masked = True
        self._leg.compiled.lay(CONTACT, *OFF)

    def _unmask(self) -> None:
        """Switch the event on again."""
        self.masked = False
        self._leg.compiled.lay(CONTACT, *FALLS)

    def _force(self) -> float:
        """Vertical contact force on the standing foot over the weight, with the stops [-]."""
        leg, plain = self._leg, self._plain
        motor, q, v = leg.plain_motor, leg.plain_q, leg.plain_v
        a = leg.stop_switches.accelerations(leg.terms, motor, q, v)
        weight = plain.floating.mass * GRAVITY
        return contact_force(plain.ops, plain.floating, q, v, a)[1] / weight

    def _lift(self) -> None:
        """Guard a foot that lifts off, which is at height zero."""
        leg = self._leg
        leg.compiled.guard(CONTACT, 0.0)
        self._lifted = (leg.time, leg.q, leg.v, leg.point, leg.drift)

    def _touchdown(self, height: float) -> int | None:
        """Guard a touchdown that is near; it is due if the foot is below the ground and sinking."""
        leg, compiled = self._leg, self._leg.compiled
        early = leg.time < self.earliest
        if height > (-NUDGE if early else 0.0):
            compiled.guard(CONTACT, height)
            return None
        if not early:
            if self._foot_speed() < 0.0:
                return CONTACT
            self.earliest = leg.time + self._min_phase
        self.mask()
        return None

    def _foot_speed(self) -> float:
        """Upward speed of the foot in flight [m/s]."""
        leg, plain = self._leg, self._plain
        arm_vel = sweep_rate(plain.ops, leg.plain_q, leg.plain_v, self._arm)
        drift = float(leg.drift[1]) - plain.floating.gravity * leg.elapsed
        return drift + arm_vel[1]

    def _liftoff(self, force: float) -> int | None:
        """Guard a lift-off that is near; it is due if the ground would have to pull."""
        if force >= 0.0:
            self._leg.compiled.guard(CONTACT, force)
            return None
        if self._leg.time >= self.earliest:
            return CONTACT
        self.mask()
        return None

    def _held(self) -> int | None:
        """Guard the end of a pull; return how it ends if it cannot go on."""
        force, released = self._force(), self.released()
        if force > TIE or released > -TIE:
            return RECOVER if force > TIE else CONTACT
        self._leg.compiled.guard(CONTACT, released)
        self._leg.compiled.guard(RECOVER, force)
        return None
