"""Places of the numbers that a compiled leg takes at run time, and what its events mean.

One compile serves every leg because nothing of a leg is compiled in: inertias, springs, dampers,
gravity, motors, stops, and the levels of the events are entries of one array of parameters.

Every event is the rise of `gain * reading - level` through zero. A gain of 0 and a level of 1
switch it off. All readings are of the order of one, because the integrator measures its error
against the largest of them.
"""

from enum import IntEnum

INERTIA, COUPLING, MOMENT, STIFFNESS, DAMPING, MOTOR = 0, 2, 3, 5, 7, 9
"""Two angles turning about a steady point: inertias [kg m^2], their coupling [kg m^2], moments of
gravity [N m], stiffness [N m/rad], damping [N m s/rad], motor positions [rad]."""
SMOOTH = 11
"""Number of the parameters of the equations of motion between events, those above [-]."""
FRICTION, SHARPNESS = 11, 13
"""Legs side by side only: Coulomb friction of both joints [N m], and how sharply it sets in with
the rate [s/rad]."""
PUSHES = 11
"""Knee and hip: whether the stop pushes, and its limit [rad]."""
PROBE = 15
"""Factors of q1 and q2 in the probe [-]."""
ALONG = 17
"""Flight: foot seen from the centre of mass. Stance: first moments about the foot per mass [m]."""
HEIGHT, SPEED, GRAVITY = 19, 20, 21
"""Height [m], rise [m/s] at time zero and fall [m/s^2] of the centre of mass in flight; in stance
the last is the weight per mass."""
FREE_INERTIA, FREE_COUPLING, FREE_PUSHES = 22, 24, 25
"""Inertias of the same leg in the air, and whether knee and hip stop would push there."""
GAIN = 27
"""Gains of the events [-]."""


class Event(IntEnum):
    """What is watched in every regime, in the order of the gains and levels."""

    RISE = 0
    """The probe rises through the upper level."""
    FALL = 1
    """The probe falls through the lower level."""
    TURN = 2
    """The probe turns round."""
    FELL = 3
    """The leg leans forward too far."""
    FELL_BACK = 4
    KNEE_LOW = 5
    KNEE_HIGH = 6
    HIP_LOW = 7
    HIP_HIGH = 8
    """A joint meets or leaves a limit."""
    KNEE_PUSH = 9
    HIP_PUSH = 10
    """A stop begins or ends to push."""
    CONTACT = 11
    """Touchdown, or a condition of lift-off."""
    RECOVER = 12
    """The ground need no longer pull on a foot that is held though it does."""
    KNEE_FREE = 13
    HIP_FREE = 14
    """A stop would begin or end to push if the foot were let go."""


LEVEL = GAIN + len(Event)
"""Levels of the events, in units of their readings."""


class Watched(IntEnum):
    """What can end an integration."""

    CONTACT = 0
    """Touchdown or lift-off."""
    RISE = 1
    """The probe rises through the upper level."""
    FALL = 2
    """The probe falls through the lower level."""
    TURN = 3
    """The probe turns round."""
    FELL = 4
    """The leg leans too far."""


class Kind(IntEnum):
    """Which equations and events are compiled together."""

    FIXED = 0
    """Nothing can let go: trunk held, or foot pinned."""
    FLIGHT = 1
    STANCE = 2
    HELD = 3
    """Stance in which the ground pulls, because the foot would go down if it were let go."""
