"""Layout of the run-time parameters of a compiled leg, and the meaning of its events.

One compiled integrator serves every leg because no parameter of a leg is compiled in: inertias,
springs, dampers, gravity, motors, stops, and the levels of the events are entries of one array.

An event occurs when `gain * reading - level` rises through zero. A gain of 0 and a level of 1
switch it off. All readings are of the order of one, because the integrator measures its error
against the largest of them.
"""

from enum import IntEnum

INERTIA, COUPLING, MOMENT, STIFFNESS, DAMPING, MOTOR = 0, 2, 3, 5, 7, 9
"""First indices of the parameters of two angles that turn about a steady point: inertias [kg m^2],
their coupling [kg m^2], moments of gravity [N m], stiffness [N m/rad], damping [N m s/rad], motor
positions [rad]."""
SMOOTH = 11
"""Number of parameters of the equations of motion between events, which come first [-]."""
FRICTION, SHARPNESS = 11, 13
"""First indices of what a batch of legs (`analytic.leg_batch`) has in addition: Coulomb friction of
both joints [N m], and the inverse width of its smoothing over the rate [s/rad]."""
GUIDE, REACH = 14, 16
"""First indices of what a batch of legs has for a damped guide: its damping forward and upward
[N s/m], and the distance of the foot tip along either direction [m]."""
PUSHES = 11
"""First index of the stops, knee then hip: whether the stop pushes [0 or 1], its limit [rad]."""
PROBE = 15
"""First index of the factors of q1 and q2 in the probe [-]."""
ALONG = 17
"""First index of the two moment arms [m]: in flight those of the foot about the centre of mass, in
stance the first moments about the foot per mass."""
HEIGHT, SPEED, GRAVITY = 19, 20, 21
"""Indices of height [m] and upward speed [m/s] of the centre of mass at time zero of a flight, and
of gravity [m/s^2]; in stance the last is the weight per mass."""
FREE_INERTIA, FREE_COUPLING, FREE_PUSHES = 22, 24, 25
"""First indices of the inertias of the leg in the air [kg m^2], their coupling [kg m^2], and
whether the stops of knee and hip would push there [0 or 1]."""
GAIN = 27
"""First index of the gains of the events [-]."""


class Event(IntEnum):
    """Event of a compiled leg, numbered in the order of the gains and levels."""

    RISE = 0
    """The probe rises through the upper level."""
    FALL = 1
    """The probe falls through the lower level."""
    TURN = 2
    """The probe has a turning point."""
    FELL = 3
    """The leg leans forward too far."""
    FELL_BACK = 4
    """The leg leans backward too far."""
    KNEE_LOW = 5
    KNEE_HIGH = 6
    HIP_LOW = 7
    HIP_HIGH = 8
    """A joint meets or leaves a limit; this and the three events before it."""
    KNEE_PUSH = 9
    HIP_PUSH = 10
    """The stop of a joint begins or ends to push; this and the event before it."""
    CONTACT = 11
    """Touchdown, or a condition of lift-off."""
    RECOVER = 12
    """The contact force stops pulling on a foot that is held because it would go down."""
    KNEE_FREE = 13
    HIP_FREE = 14
    """A stop would begin or end to push if the foot were released; this and the event before."""


LEVEL = GAIN + len(Event)
"""First index of the levels of the events, in units of their readings."""


class Watched(IntEnum):
    """Event that can end an integration, as its caller sees it."""

    CONTACT = 0
    """Touchdown or lift-off."""
    RISE = 1
    """The probe rises through the upper level."""
    FALL = 2
    """The probe falls through the lower level."""
    TURN = 3
    """The probe has a turning point."""
    FELL = 4
    """The leg leans too far."""


class Kind(IntEnum):
    """Set of equations and events that is compiled together."""

    FIXED = 0
    """Leg without touchdown and lift-off: its trunk is held, or its foot pinned."""
    FLIGHT = 1
    """Leg in the air, with the event of touchdown."""
    STANCE = 2
    """Leg on the ground, with the event of a contact force that vanishes."""
    HELD = 3
    """Stance in which the ground pulls, because the foot would go down if it were released."""
