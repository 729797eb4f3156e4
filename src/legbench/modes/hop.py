"""Hopping as a map: from the apex of one flight to the apex of the next.

The section is the instant in flight when the centre of mass is highest. Travel along the ground
changes nothing, so six numbers say where the leg is (`Apex`), and a hop maps six onto six.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from legbench.analytic.equations import Pair
from legbench.analytic.hybrid import switch
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

    def state(self, model: LegModel) -> LegState:
        """The leg there, at time zero.

        Raises:
            ConfigError: the foot would be below the ground.
        """
        q = (SCALE * (self.z1 - self.z2), SCALE * (self.z1 + self.z2))
        v = (SCALE * (self.dz1 - self.dz2), SCALE * (self.dz1 + self.dz2))
        centre = model.mass_centre_from_hip(q)
        moved = model.mass_centre_vel_from_hip(q, v)
        trunk = (-centre[0], self.height - centre[1])
        return flying(model, q, v, trunk, (self.speed - moved[0], -moved[1]))


def apex_of(model: LegModel, state: LegState) -> Apex:
    """The section's numbers of a leg in flight."""
    (q1, q2), (v1, v2) = state.q, state.v
    return Apex(
        height=state.trunk_pos[1] + model.mass_centre_from_hip(state.q)[1],
        speed=state.trunk_vel[0] + model.mass_centre_vel_from_hip(state.q, state.v)[0],
        z1=SCALE * (q1 + q2),
        z2=SCALE * (q2 - q1),
        dz1=SCALE * (v1 + v2),
        dz2=SCALE * (v2 - v1),
    )


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


Observer = Callable[[LegState], None]
"""Called with every state at which the integration paused."""


def hop(
    leg: TaylorLeg, drive: AbstractDrive, start: LegState, observer: Observer | None = None
) -> Hop:
    """Follow a leg in flight, from wherever in it, through stance to its next apex."""
    model, state, first = leg.model, start, start.time
    touchdown = liftoff = math.nan
    lost, ending = 0.0, Ending.STANDS
    try:
        for _ in range(CALLS):
            until, at_apex = min(first + HORIZON, drive.alarm), False
            if state.regime is Regime.FLIGHT and not math.isnan(liftoff):
                apex = state.time + _rise_time(model, state)
                if state.time < apex <= until:
                    until, at_apex = apex, True
            state, what = leg.watch(state, until, drive.motor, drive.levels())
            if observer is not None:
                observer(state)
            if abs(state.q[0] + state.q[1]) > 2.0 * FALLEN:
                ending = Ending.FELL
                break
            if what is Watched.CONTACT:
                after = switch(model, state)
                if after.regime is Regime.STANCE:
                    lost += _kinetic(model, state) - _kinetic(model, after)
                    touchdown = state.time if math.isnan(touchdown) else touchdown
                else:
                    liftoff = state.time
                state = after
            elif what is not None:
                drive.happen(what, _probe(drive, state.q), state.time)
            elif state.time >= drive.alarm:
                drive.ring(_probe(drive, state.q), state.time)
            elif at_apex:
                ending = Ending.APEX if drive.settled else Ending.FAULT
                break
            else:
                break
        else:
            ending = Ending.FAULT
    except PlantFault:
        ending = Ending.FAULT
    return Hop(
        ending=ending,
        after=apex_of(model, state) if ending is Ending.APEX else None,
        duration=state.time - first,
        touchdown=touchdown - first,
        liftoff=liftoff - first,
        impact=lost,
    )


def _rise_time(model: LegModel, state: LegState) -> float:
    moved = model.mass_centre_vel_from_hip(state.q, state.v)[1]
    return (state.trunk_vel[1] + moved) / model.floating.gravity


def _probe(drive: AbstractDrive, q: Pair) -> float:
    return drive.probe[0] * q[0] + drive.probe[1] * q[1]


def _kinetic(model: LegModel, state: LegState) -> float:
    return model.floating_energy(0.0, state.trunk_vel, state.q, state.v)[1]


def return_map(leg: TaylorLeg, drive: AbstractDrive, start: Apex) -> Hop:
    """One hop from an apex.

    Raises:
        ConfigError: a start below the ground.
    """
    drive.restart()
    return hop(leg, drive, start.state(leg.model))


def settle(leg: TaylorLeg, drive: AbstractDrive, start: Apex, hops: int) -> list[Apex]:
    """Apexes of up to `hops` hops in a row, the start first; fewer when the leg stops hopping."""
    drive.restart()
    apexes, state = [start], start.state(leg.model)
    for _ in range(hops):
        done = hop(leg, drive, state)
        if done.after is None:
            break
        apexes.append(done.after)
        drive.restart()
        state = done.after.state(leg.model)
    return apexes
