"""The state a run begins in."""

from dataclasses import dataclass

from legbench.signals import Floats

PERIOD = 0.001
"""Control period of every plant [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """A leg at rest; in a batch, one row a leg."""

    joint_pos: Floats
    """(..., 2) [rad]"""
    motor_pos: Floats
    """(..., 2) [rad]"""
