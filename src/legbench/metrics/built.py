"""The leg of a simulated run as it was built, and what its encoders would have shown unharmed."""

from dataclasses import dataclass

import numpy as np

from legbench.design import LegDesign
from legbench.metrics.source import Recorded
from legbench.signals import Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Built:
    """True leg of a run as far as its readings tell; where they are noisy, positions are NaN."""

    design: LegDesign
    shaft: Floats
    """Positions of the motors' shafts (n, 2) [rad]."""
    joint: Floats
    """Link angles (n, 2) [rad]."""
    other_power: Floats
    """Power of dry friction and of the trunk's guide (n,) [W]."""
    half_play: Floats
    """Half of the play between motor and spring (2,) [rad]."""

    def stretch(self, shaft: Floats, joint: Floats) -> Floats:
        """Stretch of the springs (..., 2) [rad], which have none within the play."""
        angle = shaft - joint
        return angle - np.clip(angle, -self.half_play, self.half_play)

    def spring_energy(self, shaft: Floats, joint: Floats) -> Floats:
        """U = 1/2 sum k_i stretch_i^2 of the series springs (...) [J]."""
        return 0.5 * np.square(self.stretch(shaft, joint)) @ np.asarray(self.design.stiffness)


def built_of(recording: Recorded) -> Built:
    """The true leg of a simulated run, from what the run says of its imperfections."""
    run = recording.description
    found = run.imperfections
    friction = np.asarray(found.coulomb_friction or (0.0, 0.0))
    guide = np.asarray(found.guide_damping or (0.0, 0.0))
    noisy = found.motor_noise is not None or found.link_noise is not None
    known = np.nan if noisy else 0.0
    power = np.zeros(len(recording.time))
    if friction.any():
        power = power + np.abs(recording["joint_vel"]) @ friction
    if guide.any():
        power = power + np.square(recording["trunk_vel"]) @ guide
    return Built(
        design=found.leg_of(run.design),
        shaft=recording["motor_pos"] + np.asarray(found.motor_zero or (0.0, 0.0)) + known,
        joint=recording["joint_pos"] - np.asarray(found.link_zero or (0.0, 0.0)) + known,
        other_power=power,
        half_play=0.5 * np.asarray(found.backlash or (0.0, 0.0)),
    )
