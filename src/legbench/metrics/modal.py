"""How a run moved in the paper's coordinates: polar x, modal z, and their rates (Figs. 4 and 6)."""

from dataclasses import dataclass

from legbench.kinematics import joint_to_modal, joint_to_polar, joint_to_polar_rate
from legbench.metrics.source import Recorded, terms_of
from legbench.signals import Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectory:
    """Polar and modal coordinates of every row, in the run's own modal convention."""

    time: Floats
    """(n,) [s]"""
    polar: Floats
    """x1, x2 of eq. (2) (n, 2) [rad], [m]."""
    polar_rate: Floats
    """(n, 2) [rad/s], [m/s]."""
    modal: Floats
    """z1 (polar mode), z2 (radial mode) of eq. (15) (n, 2) [rad]."""
    modal_rate: Floats
    """(n, 2) [rad/s]."""


def trajectory(recording: Recorded) -> Trajectory:
    """Transform the measured joint angles and velocities of a run, eqs. (2) and (15).

    Raises:
        FormatError: a manifest without a leg or with an unknown convention.
    """
    terms = terms_of(recording.manifest)
    joint_pos, joint_vel = recording["joint_pos"], recording["joint_vel"]
    shank = terms.design.shank.length
    return Trajectory(
        time=recording.time,
        polar=joint_to_polar(joint_pos, shank),
        polar_rate=joint_to_polar_rate(joint_pos, joint_vel, shank),
        modal=joint_to_modal(joint_pos, terms.convention),
        modal_rate=joint_to_modal(joint_vel, terms.convention),
    )
