"""Hopping as a map: from the apex of one flight to the apex of the next.

The section is the instant in flight when the centre of mass is highest. Travel along the ground
changes nothing, so six numbers say where the leg is (`Apex`), and a hop maps six onto six.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from legbench.analytic.course import Course
from legbench.analytic.equations import Pair, pair_kinetic
from legbench.analytic.model import LegModel
from legbench.analytic.state import LegState, Regime, flying
from legbench.analytic.taylor import TaylorLeg, Watched
from legbench.errors import PlantFault
from legbench.modes.drive import AbstractDrive
from legbench.signals import Floats

HORIZON = 2.0
"""A leg that has not flown through an apex by then stands [s]."""
FALLEN = 1.2
"""|x1| beyond which the leg lies rather than stands [rad]."""
CALLS = 400
"""Events in one hop after which it is given up."""
NAMES = ("height", "speed", "z1", "z2", "dz1", "dz2")
SCALE = math.sqrt(0.5)


class Ending(StrEnum):
    """How a hop ended."""

    APEX = "apex"
    STANDS = "stands"
    """No lift-off within two seconds."""
    FELL = "fell"
    """The leg swung too far."""
    FAULT = "fault"
    """Integration or drive lost step."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Apex:
    """A leg at the highest point of its centre of mass."""

    height: float
    """Height of the centre of mass over the ground [m]."""
    speed: float
    """Forward speed of the centre of mass [m/s]."""
    z1: float
    """[rad]"""
    z2: float
    """[rad]"""
    dz1: float
    """[rad/s]"""
    dz2: float
    """[rad/s]"""

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
    """The section's numbers of a leg in flight."""
    height = state.trunk_pos[1] + model.mass_centre_from_hip(state.q)[1]
    speed = state.trunk_vel[0] + model.mass_centre_vel_from_hip(state.q, state.v)[0]
    return Apex.at(height, speed, state.q, state.v)


@dataclass(frozen=True, slots=True, kw_only=True)
class Hop:
    """One application of the map."""

    ending: Ending
    after: Apex | None
    """Apex at which the hop ended, if it did."""
    duration: float
    """[s]"""
    touchdown: float
    """Time of the first [s]; NaN if none."""
    liftoff: float
    """Time of the last [s]; NaN if none."""
    impact: float
    """Energy lost to the ground [J]."""


def hop(leg: TaylorLeg, drive: AbstractDrive, start: Apex) -> Hop:
    """Follow a leg from an apex through stance to its next apex.

    Raises:
        ConfigError: a start below the ground.
    """
    course = leg.course
    _launch(course, start)
    touchdown = liftoff = math.nan
    lost, ending = 0.0, None
    try:
        for _ in range(CALLS):
            what, ending = _pause(course, drive, flew=not math.isnan(liftoff))
            if ending is not None:
                break
            if what is Watched.CONTACT and course.regime is Regime.FLIGHT:
                lost += _kinetic(course)
                course.switch()
                lost -= _kinetic(course)
                touchdown = course.time if math.isnan(touchdown) else touchdown
            elif what is Watched.CONTACT:
                course.switch()
                liftoff = course.time
            elif what is None:
                drive.ring(_probe(drive, course.q), course.time)
            else:
                drive.happen(what, _probe(drive, course.q), course.time)
    except PlantFault:
        ending = Ending.FAULT
    return Hop(
        ending=ending or Ending.FAULT,
        after=_reached(course) if ending is Ending.APEX else None,
        duration=course.time,
        touchdown=touchdown,
        liftoff=liftoff,
        impact=lost,
    )


def _pause(
    course: Course, drive: AbstractDrive, *, flew: bool
) -> tuple[Watched | None, Ending | None]:
    """Go on to the next event, alarm or ending; `flew` if the leg has let go of the ground."""
    until, apex = min(HORIZON, drive.alarm), math.inf
    if flew and course.regime is Regime.FLIGHT:
        apex = course.apex_time()
        if course.time <= apex <= until:
            until = apex
    course.hold(drive.motor)
    what = course.go(until, drive.levels())
    if what is Watched.FELL:
        return what, Ending.FELL
    if what is not None or course.time >= drive.alarm:
        return what, None
    if until == apex:
        return what, Ending.APEX if drive.settled else Ending.FAULT
    return what, Ending.STANDS


def _launch(course: Course, start: Apex) -> None:
    """Put a leg at an apex.

    Raises:
        ConfigError: the foot would be below the ground.
    """
    q, v = start.angles()
    if start.height + course.foot_from_centre(q)[1] < 0.0:
        start.state(course.model)  # says so
    course.fly(q, v, (0.0, start.height), (start.speed, 0.0), 2.0 * FALLEN)


def _reached(course: Course) -> Apex:
    """The section's numbers of a leg at its apex."""
    (_, height), (speed, _) = course.centre()
    return Apex.at(height, speed, course.q, course.v)


def _kinetic(course: Course) -> float:
    """Kinetic energy of a leg in flight or stance [J]."""
    model, ops = course.model, course.model.ops
    if course.regime is not Regime.FLIGHT:
        return pair_kinetic(ops, model.stance, course.q, course.v)
    dx, dz = course.centre()[1]
    own = 0.5 * model.floating.mass * (dx * dx + dz * dz)
    return own + pair_kinetic(ops, model.falling, course.q, course.v)


def _probe(drive: AbstractDrive, q: Pair) -> float:
    return drive.probe[0] * q[0] + drive.probe[1] * q[1]


def return_map(leg: TaylorLeg, drive: AbstractDrive, start: Apex) -> Hop:
    """One hop from an apex.

    Raises:
        ConfigError: a start below the ground.
    """
    drive.restart()
    return hop(leg, drive, start)


def settle(leg: TaylorLeg, drive: AbstractDrive, start: Apex, hops: int) -> list[Apex]:
    """Apexes of up to `hops` hops in a row, the start first; fewer when the leg stops hopping."""
    apexes = [start]
    for _ in range(hops):
        done = return_map(leg, drive, apexes[-1])
        if done.after is None:
            break
        apexes.append(done.after)
    return apexes
