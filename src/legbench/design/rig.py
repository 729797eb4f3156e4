"""Parts of the test rig that count only where the trunk turns with its boom.

In a plane the trunk never turns, and no inertia but that about the joints' axis takes part.
"""

from typing import Final

TRUNK_COM_HEIGHT: Final = 0.03
"""Height of the trunk's centre of mass over the hip [m]."""
TRUNK_INERTIA: Final = (5e-4, 7e-4, 7e-4)
"""Inertia of the trunk about its centre of mass: forward, sideways and upward axis [kg m^2]."""
AXIAL_SHARE: Final = 0.1
"""Inertia of a segment or a bar about its own long axis over that across it: it is slender [-]."""
PIN_MASS: Final = 0.001
"""Mass of the slider that carries the pinned foot sideways [kg]."""
BOOM_BEND: Final = 0.6
"""Half knee angle of the posture in which the boom is level [rad]."""
