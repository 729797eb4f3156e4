"""What a drive tells of its joint: motor, link and spring, whichever encoders it has; pure."""

import math

from legbench.drives.master.axis_link import AxisLink
from legbench.drives.setup.encoders import Side


def joint_of(axis: AxisLink, stiffness: float) -> tuple[float, float, float]:
    """Motor position [rad], link angle [rad] and spring torque [N m] of a joint.

    What the drive does not tell is not a number. With one encoder and a torque, which counts as
    the spring's, the other side of the spring lies beside by torque over stiffness: inertia and
    friction between motor and spring are in it.

    Args:
        axis: its drive.
        stiffness: stiffness of the series spring [N m/rad].
    """
    shown = axis.motor_pos
    if axis.node.link is not None:
        return shown, axis.link_pos, stiffness * (shown - axis.link_pos)
    torque = axis.torque
    wound = torque / stiffness if stiffness > 0.0 else math.nan
    if axis.node.side is Side.MOTOR:
        return shown, shown - wound, torque
    return shown + wound, shown, torque
