"""How a run moved in the paper's coordinates: polar x, modal z, and their rates (Figs. 4 and 6)."""

from dataclasses import dataclass

from legbench.kinematics import joint_to_modal, joint_to_polar, joint_to_polar_rate
from legbench.metrics.source import Recorded
from legbench.signals import Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectory:
    """Polar and modal coordinates of every row, in the run's own modal convention."""

    time: Floats
    """Times of the rows (n,) [s]."""
    polar: Floats
    """Polar coordinates x1, x2 of eq. (2) (n, 2) [rad], [m]."""
    polar_rate: Floats
    """Rates of the polar coordinates (n, 2) [rad/s], [m/s]."""
    modal: Floats
    """Modal coordinates z1 (polar) and z2 (radial) of eq. (15) (n, 2) [rad]."""
    modal_rate: Floats
    """Rates of the modal coordinates (n, 2) [rad/s]."""


def trajectory(run: Recorded) -> Trajectory:
    """Transform the measured joint angles and velocities of a run, eqs. (2) and (15)."""
    joint_pos, joint_vel = run["joint_pos"], run["joint_vel"]
    shank, convention = run.description.design.shank.length, run.description.convention
    return Trajectory(
        time=run.time,
        polar=joint_to_polar(joint_pos, shank),
        polar_rate=joint_to_polar_rate(joint_pos, joint_vel, shank),
        modal=joint_to_modal(joint_pos, convention),
        modal_rate=joint_to_modal(joint_vel, convention),
    )
