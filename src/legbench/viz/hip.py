"""Position of the hip of a recorded leg."""

import numpy as np

from legbench.design.setup import SetupKind
from legbench.kinematics import leg_points
from legbench.metrics.source import Recorded
from legbench.signals import Floats
from legbench.viz.facts import Facts

GROUNDED = (SetupKind.JUMP, SetupKind.FFS)


def hip_of(rows: Recorded, facts: Facts) -> Floats:
    """Hip positions in the plane of motion (n, 2) [m]: as recorded, else as the setup holds it."""
    hip = rows["trunk_pos"]
    if np.isfinite(hip).all():
        return hip
    if facts.run.setup.kind in GROUNDED:
        return -leg_points(rows["joint_pos"], facts.run.design.lengths)[:, 3]
    return np.zeros_like(hip)
