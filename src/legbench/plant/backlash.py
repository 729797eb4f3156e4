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
    """

    def __init__(self, imperfections: Imperfections | Sequence[Imperfections]) -> None:
        """Collect the play of one leg, or of each leg of a batch."""
        if isinstance(imperfections, Imperfections):
            self._half = 0.5 * np.array(imperfections.backlash or (0.0, 0.0))
        else:
            self._half = 0.5 * np.array([leg.backlash or (0.0, 0.0) for leg in imperfections])

    @property
    def none(self) -> bool:
        """Whether no gear has any play."""
        return not self._half.any()

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


def rest_of(
    design: LegDesign, support: Support, motor_pos: Floats, imperfections: Imperfections
) -> Floats:
    """Link angles (2,) [rad] at which a leg with imperfections rests.

    A spring that carries gravity leans on the flank that gravity presses it to. Friction, which
    would hold the links beside their equilibrium, too, is left out.

    Args:
        design: what the controller believes.
        support: what carries the leg.
        motor_pos: positions that the motors are told (2,) [rad].
        imperfections: what the leg has besides.

    Raises:
        DesignError: the springs are too soft to hold the leg there.
    """
    servo = Servo(ServoConfig(), PERIOD, imperfections)
    servo.reset(motor_pos)
    built, shaft = imperfections.leg_of(design), servo.shaft(servo.position)
    half = 0.5 * np.array(imperfections.backlash or (0.0, 0.0))
    load = gravity_load(built, support).torque(shaft)
    return equilibrium(built, shaft - np.sign(load) * half, support)
