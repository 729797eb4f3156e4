"""Play between motor and spring: a dead zone, in which the spring is slack."""

from collections.abc import Sequence
from typing import final

import numpy as np

from legbench.design import LegDesign
from legbench.design.statics import Support, equilibrium, gravity_load
from legbench.imperfections import Imperfections
from legbench.plant.start import PERIOD
from legbench.servo import Servo, ServoConfig
from legbench.signals import Floats


@final
class Backlash:
    """Play of the gears of one leg, or of one leg a row.

    What lies between gear and spring has no mass (the dead-zone model of backlash): a spring that
    is loaded leans on a flank, half of the play behind its shaft, and between the flanks there is
    no torque.

    Attributes:
        none: whether no gear has any play.
    """

    def __init__(self, imperfections: Imperfections | Sequence[Imperfections]) -> None:
        """Collect the play of one leg, or of each leg of a batch."""
        if isinstance(imperfections, Imperfections):
            self._half = 0.5 * np.array(imperfections.backlash or (0.0, 0.0))
        else:
            self._half = 0.5 * np.array([leg.backlash or (0.0, 0.0) for leg in imperfections])
        self.none = not self._half.any()

    def flank(self, shaft: Floats, joint_pos: Floats, joint_vel: Floats, step: float) -> Floats:
        """Return where the springs begin (..., 2) [rad] during a step of the simulation.

        Args:
            shaft: positions of the shafts [rad].
            joint_pos: link angles at the beginning of the step [rad].
            joint_vel: their velocities [rad/s].
            step: length of the step [s]; a slack spring begins where its link is in the middle.
        """
        middle = joint_pos + 0.5 * step * joint_vel
        return np.minimum(np.maximum(middle, shaft - self._half), shaft + self._half)

    def resting(self, shaft: Floats, load: Floats) -> Floats:
        """Return where the springs begin (..., 2) [rad] that carry a load (..., 2) [N m]."""
        return shaft - np.sign(load) * self._half


def rest_of(
    design: LegDesign | Sequence[LegDesign],
    support: Support,
    motor_pos: Floats,
    imperfections: Imperfections | Sequence[Imperfections],
) -> Floats:
    """Link angles (..., 2) [rad] at which legs with imperfections rest.

    A spring that carries gravity leans on the flank that gravity presses it to. Friction, which
    would hold the links beside their equilibrium, too, is left out.

    Args:
        design: what the controller believes; of a batch, one for each leg.
        support: what carries the legs.
        motor_pos: positions that the motors are told (..., 2) [rad].
        imperfections: what a leg has besides; of a batch, one for each leg.

    Raises:
        DesignError: the springs are too soft to hold a leg there.
    """
    servo = Servo(ServoConfig(), PERIOD, imperfections)
    servo.reset(motor_pos)
    shaft, play = servo.shaft(servo.position), Backlash(imperfections)
    one = isinstance(design, LegDesign)
    legs = [design] if one else design
    flaws = [imperfections] if isinstance(imperfections, Imperfections) else imperfections
    built = [each.leg_of(leg) for leg, each in zip(legs, flaws, strict=True)]
    moment = np.array([gravity_load(leg, support).moment for leg in built])
    load = (moment[0] if one else moment) * np.sin(shaft)
    return equilibrium(built[0] if one else built, play.resting(shaft, load), support)
