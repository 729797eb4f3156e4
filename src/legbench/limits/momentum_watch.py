"""Whether link encoders agree with springs and momentum, for a leg that sways; pure."""

import math
from collections import deque
from collections.abc import Sequence
from typing import final

from legbench.limits.ground_contact import GroundContact
from legbench.limits.knee import Range
from legbench.limits.momentum import LegMomentum, LegMotion, MomentumReading, motion_of
from legbench.limits.plausibility import Doubt
from legbench.limits.spring_mismatch import SpringMismatch
from legbench.limits.support_watch import CONTACT_TIME, MovingAverage, SupportWatch

RUBBER = 0.01
"""Distance from a stop of rubber at which it may push already [rad]."""
WEIGHT_SHARE = 0.2
"""Torque on the knee that rules a support out, relative to what the weight can do there [-]: in the
middle of a stance the springs carry twice the weight, in flight they carry nothing."""


@final
class MomentumWatch:
    """Looks for torque that no support of the leg explains.

    While the averages reach from the ground into the air, or back, no support explains all of it.
    So the torque must last for longer than a change of supports, and averages over both, unless the
    knee tells for certain which one the leg has. Torque of that one is evidence, of one sign or the
    other; cycles that are explained take evidence away.

    Attributes:
        residual: smallest torque along q1 + q2 that a support leaves unexplained, of those that the
            knee does not rule out; infinite if it rules out all, none while averages fill [N m].
    """

    def __init__(self, leg: LegMomentum, link_error: float, period: float) -> None:
        """Watch over a leg.

        Args:
            leg: what its momentum obeys.
            link_error: angle by which a link encoder may be wrong [rad].
            period: of the cycles [s].
        """
        self._leg, self._link_error, self._period = leg, link_error, period
        self._torque = link_error * min(leg.stiffness)
        only = len(leg.supports) == 1
        weight = max(sum(map(abs, support.moment)) for support in leg.supports)
        # A leg that is always supported alike needs nothing to be ruled out.
        self._knee_torque = math.inf if only else WEIGHT_SHARE * weight
        self._supports = [
            SupportWatch(leg, support, self._torque, period) for support in leg.supports
        ]
        self._reaches = sorted({one.reach for one in self._supports})
        self._reach = max(one.reach for one in self._supports)
        reaches = sum(one.reach for one in self._supports)
        self._patience = round(CONTACT_TIME / period) + reaches
        self._contact: GroundContact | None = None
        if not only:
            ground = self._supports[0].reach
            self._contact = GroundContact(self._knee_torque, ground, period)
        self.start()

    def start(self) -> None:
        """Begin anew with whatever is shown next, and forget the leg's springs."""
        self._mismatch = SpringMismatch(self._torque, self._period)
        self._begin()

    def restart(self) -> None:
        """Begin anew with whatever is shown next, unless nothing has been seen yet."""
        if self._readings:
            self._begin()

    def _begin(self) -> None:
        self.residual: float | None = None
        self._readings = deque[MomentumReading](maxlen=3)
        for support in self._supports:
            support.restart()
        self._wound = {reach: MovingAverage(reach) for reach in self._reaches}
        if self._contact is not None:
            self._contact.forget()
        self._seen = self._age = self._evidence = 0

    def see(self, reading: MomentumReading, *, stands: bool = False) -> Doubt | None:
        """Look at one more cycle, in which every drive has told something new.

        Args:
            reading: of that cycle.
            stands: whether one link stands while the other one swings.
        """
        # A reading must have come about a period after the one before.
        regular = 0.5 * self._period < reading.interval < 1.5 * self._period
        if not (regular and _inside(reading.joint[0], self._leg.hip_range)):
            self.restart()
            return None
        self._readings.append(reading)
        if len(self._readings) < 3:
            return None
        joint_1, joint_2 = reading.joint
        free = _inside(joint_2 - joint_1, self._leg.knee_range)
        left = self._left(motion_of(self._leg, self._readings), free=free)
        self._seen += 1
        if self._seen < self._reach:
            return None
        self.residual = min(map(abs, left))
        self._age += 1
        lasts = False
        if self.residual <= self._torque:
            self._age = 0
            self._evidence -= (self._evidence > 0) - (self._evidence < 0)
        else:
            lasts = self._contradicted(left)
        # A link that is thrown onto the ground, or off it, does not stand.
        lasts = lasts or self._age > (self._supports[-1].patience if stands else self._patience)
        return self._doubt() if lasts and self._mismatch.known else None

    def _contradicted(self, left: Sequence[float]) -> bool:
        """Whether the support that the leg has for certain leaves torque of one sign for long."""
        contact = self._contact
        if contact is None or not (contact.in_flight or contact.in_stance):
            return False
        place = -1 if contact.in_flight else 0
        torque, patience = left[place], self._supports[place].patience
        if torque < math.inf:
            more = self._evidence + (1 if torque > 0.0 else -1)
            # Just enough, since what comes before the springs are known must not outlast them.
            self._evidence = min(max(more, -patience - 1), patience + 1)
        return abs(self._evidence) > patience

    def _left(self, motion: LegMotion, *, free: bool) -> list[float]:
        """Torques along q1 + q2 that the supports leave; infinite where the knee rules one out."""
        wound = {reach: average.after(motion.wound) for reach, average in self._wound.items()}
        share, most = self._mismatch.share, self._knee_torque
        left: list[float] = []
        likeliest, torque, knee = math.inf, (math.inf, 0.0), 0.0
        for support in self._supports:
            polar, knee = support.after(motion, free=free)
            by = wound[support.reach]
            allowed = support.pushed or abs(knee) <= most
            unexplained = polar - share * by if allowed else math.inf
            left.append(unexplained)
            if abs(unexplained) < likeliest:
                likeliest, torque = abs(unexplained), (polar, by)
        self._judge_contact(knee)
        if self._seen >= self._reach:
            self._mismatch.learn(*torque)
        return left

    def _judge_contact(self, knee: float) -> None:
        """Judge whether the leg is in flight by the torque on the knee that free fall leaves."""
        if self._contact is None:
            return
        if self._supports[-1].pushed:
            self._contact.forget()
        else:
            self._contact.after(knee)

    def _doubt(self) -> Doubt:
        cycles = max(self._age, abs(self._evidence))
        return Doubt(
            "joint encoder",
            "the springs' torques contradict the motion of the links, on the ground and in the air "
            f"alike, by more than {self._torque:.3f} N m for {cycles} cycles; the limit is a "
            f"link_error of {self._link_error:g} rad: look at the link encoders, at the springs' "
            "stiffness, and whether the foot slides",
        )


def _inside(angle: float, between: Range) -> bool:
    return between[0] + RUBBER < angle < between[1] - RUBBER
