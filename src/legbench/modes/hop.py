"""Return map of hopping, from the apex of one flight to the apex of the next.

The Poincare section is the instant in flight when the centre of mass is highest. The motion does
not depend on the place along the ground, so six numbers are the state of the leg there (`Apex`).
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from legbench.analytic.course import Course
from legbench.analytic.equations import Pair
from legbench.analytic.model import LegModel
from legbench.analytic.state import LegState, flying
from legbench.analytic.taylor import TaylorLeg, Watched
from legbench.errors import PlantFault
from legbench.modes.drive import AbstractDrive
from legbench.signals import Floats

HORIZON = 2.0
"""Time within which a hopping leg reaches an apex; without one it counts as standing [s]."""
FALLEN = 1.2
"""Polar angle |x1| at which the leg counts as fallen [rad]."""
CALLS = 400
"""Largest number of events in one hop [-]."""
BUDGET = range(CALLS)
NAMES = ("height", "speed", "z1", "z2", "dz1", "dz2")
SCALE = math.sqrt(0.5)
CONTACT, FELL = Watched.CONTACT, Watched.FELL
"""Members that are asked for at every event; the enumeration itself takes longer to find them."""


class Ending(StrEnum):
    """How a hop ended."""

    APEX = "apex"
    STANDS = "stands"
    """No lift-off within two seconds."""
    FELL = "fell"
    """The leg leans so far that it has fallen."""
    FAULT = "fault"
    """The integration failed, or the hop has too many events."""


APEX, FAULT = Ending.APEX, Ending.FAULT


@dataclass(frozen=True, slots=True, kw_only=True)
class Apex:
    """State of a leg in flight when its centre of mass is highest."""

    height: float
    """Height of the centre of mass over the ground [m]."""
    speed: float
    """Forward speed of the centre of mass [m/s]."""
    z1: float
    """Polar coordinate z1 of the joint space [rad]."""
    z2: float
    """Radial coordinate z2 of the joint space [rad]."""
    dz1: float
    """Rate of z1 [rad/s]."""
    dz2: float
    """Rate of z2 [rad/s]."""

    def vector(self) -> Floats:
        """State as an array in the order of `NAMES` (6,)."""
        return np.array([getattr(self, name) for name in NAMES])

    @classmethod
    def of(cls, vector: Floats) -> "Apex":
        """Inverse of `vector`."""
        return cls(**dict(zip(NAMES, vector.tolist(), strict=True)))

    @classmethod
    def at(cls, height: float, speed: float, q: Pair, v: Pair) -> "Apex":
        """The apex of a leg with these angles [rad] and rates [rad/s]."""
        (q1, q2), (v1, v2) = q, v
        return cls(
            height=height,
            speed=speed,
            z1=SCALE * (q1 + q2),
            z2=SCALE * (q2 - q1),
            dz1=SCALE * (v1 + v2),
            dz2=SCALE * (v2 - v1),
        )

    def angles(self) -> tuple[Pair, Pair]:
        """Angles q1, q2 [rad] and their rates [rad/s]."""
        return (
            (SCALE * (self.z1 - self.z2), SCALE * (self.z1 + self.z2)),
            (SCALE * (self.dz1 - self.dz2), SCALE * (self.dz1 + self.dz2)),
        )

    def state(self, model: LegModel) -> LegState:
        """The leg there, at time zero.

        Raises:
            ConfigError: the foot would be below the ground.
        """
        q, v = self.angles()
        centre = model.mass_centre_from_hip(q)
        moved = model.mass_centre_vel_from_hip(q, v)
        trunk = (-centre[0], self.height - centre[1])
        return flying(model, q, v, trunk, (self.speed - moved[0], -moved[1]))


def apex_of(model: LegModel, state: LegState) -> Apex:
    """Apex of a leg in flight, from its state."""
    height = state.trunk_pos[1] + model.mass_centre_from_hip(state.q)[1]
    speed = state.trunk_vel[0] + model.mass_centre_vel_from_hip(state.q, state.v)[0]
    return Apex.at(height, speed, state.q, state.v)


class Hop(NamedTuple):
    """Result of one hop; a tuple, because a map makes thousands a second."""

    ending: Ending
    after: Apex | None
    """Apex at which the hop ended, if it reached one."""
    duration: float
    """Time from apex to apex [s]."""
    touchdown: float
    """Time of the first touchdown [s]; NaN if there is none."""
    liftoff: float
    """Time of the last lift-off [s]; NaN if there is none."""
    impact: float
    """Energy lost in the impact with the ground [J]."""


def hop(leg: TaylorLeg, drive: AbstractDrive, start: Apex) -> Hop:
    """Follow a leg from an apex through stance to its next apex.

    Raises:
        ConfigError: a start below the ground.
    """
    course, (p1, p2) = leg.course, drive.probe
    _launch(course, start)
    touchdown = liftoff = math.nan
    apex, landed, ending = math.inf, False, FAULT
    try:
        for _ in BUDGET:
            alarm = drive.alarm
            until = alarm if alarm < HORIZON else HORIZON
            if course.time <= apex <= until:
                until = apex
            if drive.motor is not course.motor:
                course.hold(drive.motor)
            what = course.go(until, drive.levels)
            if what is CONTACT:
                course.switch()
                drive.stands = not course.compiled.flies
                if not drive.stands:
                    liftoff, apex = course.time, course.apex_time()
                else:
                    touchdown, landed = touchdown if landed else course.time, True
                    apex = math.inf
            elif what is FELL:
                ending = Ending.FELL
                break
            elif what is not None:
                q1, q2 = course.q
                drive.on_event(what, p1 * q1 + p2 * q2, course.time)
            elif course.time >= alarm:
                q1, q2 = course.q
                drive.on_alarm(p1 * q1 + p2 * q2, course.time)
            else:
                ending = _end(drive, course.time, reached=until == apex)
                break
    except PlantFault:
        ending = FAULT
    return Hop(
        ending=ending,
        after=_reached(course) if ending is APEX else None,
        duration=course.time,
        touchdown=touchdown,
        liftoff=liftoff,
        impact=course.lost,
    )


def _end(drive: AbstractDrive, time: float, *, reached: bool) -> Ending:
    """How a hop ends at its horizon, or at an apex that it has `reached`."""
    if not reached:
        return Ending.STANDS
    return APEX if drive.settled(time) else FAULT


def _launch(course: Course, start: Apex) -> None:
    """Set a leg to an apex.

    Raises:
        ConfigError: the foot would be below the ground.
    """
    q, v = start.angles()
    if start.height + course.foot_height(q) < 0.0:
        start.state(course.model)  # says so
    course.fly(q, v, (0.0, start.height), (start.speed, 0.0), 2.0 * FALLEN)


def _reached(course: Course) -> Apex:
    """Apex of a leg that has reached it."""
    (_, height), (speed, _) = course.centre()
    return Apex.at(height, speed, course.q, course.v)


def return_map(leg: TaylorLeg, drive: AbstractDrive, start: Apex) -> Hop:
    """One hop from an apex.

    Raises:
        ConfigError: a start below the ground.
    """
    drive.restart()
    return hop(leg, drive, start)


def settle(leg: TaylorLeg, drive: AbstractDrive, start: Apex, hops: int) -> list[Apex]:
    """Apexes of up to `hops` consecutive hops, the start first; fewer if the leg stops hopping."""
    apexes = [start]
    for _ in range(hops):
        done = return_map(leg, drive, apexes[-1])
        if done.after is None:
            break
        apexes.append(done.after)
    return apexes
