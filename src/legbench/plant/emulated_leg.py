"""The simulated leg as the body of emulated drives."""

from collections.abc import Sequence
from typing import final

import numpy as np

from legbench.design import LegDesign
from legbench.encoders import EncoderErrors
from legbench.imperfections import Imperfections
from legbench.mjcf import BuildOptions
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.servo import PERFECT
from legbench.signals import Command


@final
class EmulatedLeg:
    """Body on the drives' shafts: a `SimPlant` whose motors are where the drives put them.

    It rests in its start posture until the drives move. It knows nothing of time: one call is one
    period of `plant.start.PERIOD`. Imperfections of the leg and of its encoders are its own; how
    motors follow their targets is the drives'.

    Attributes:
        periods: how many have passed.
        motor_noise: errors of the motor encoders' readings in this period [rad].
    """

    def __init__(
        self,
        design: LegDesign,
        options: BuildOptions,
        start: Start,
        imperfections: Imperfections = PERFECT,
        seed: int = 0,
    ) -> None:
        own = imperfections.beyond_motors
        self._plant = SimPlant(design, options, start, None, own, seed)
        self._plant.reset()
        self._errors = EncoderErrors(imperfections, seed)
        self.motor_noise: Sequence[float] = (0.0, 0.0)
        self.periods = 0

    def __call__(
        self, motor_positions: tuple[float, ...]
    ) -> tuple[Sequence[float], Sequence[float]]:
        """Move one period with the motors there [rad]; link angles [rad], spring torques [N m].

        Raises:
            PlantFault: the simulated leg has come apart.
        """
        seen = self._plant.step(Command.holding(np.array(motor_positions)))
        self.periods += 1
        self._errors.advance()
        self.motor_noise = self._errors.motor.tolist()
        return seen.joint_pos.tolist(), self._plant.spring_torque().tolist()
