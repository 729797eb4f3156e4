"""The state a run begins in."""

from dataclasses import dataclass

from legbench.signals import Floats

PERIOD = 0.001
"""Control period of every plant [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """State of a leg at rest; in a batch, one row for each leg."""

    joint_pos: Floats
    """Link angles of the leg (..., 2) [rad]."""
    motor_pos: Floats
    """Motor positions of the leg (..., 2) [rad]."""
