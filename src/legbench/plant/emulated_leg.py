"""The simulated leg as the body of emulated drives."""

from collections.abc import Sequence
from typing import final

import numpy as np

from legbench.design import LegDesign
from legbench.mjcf import BuildOptions
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.signals import Command


@final
class EmulatedLeg:
    """Body on the drives' shafts: a `SimPlant` whose motors are where the drives put them.

    It rests in its start posture until the drives move. It knows nothing of time: one call is one
    period of `plant.start.PERIOD`.

    Attributes:
        periods: how many have passed.
    """

    def __init__(self, design: LegDesign, options: BuildOptions, start: Start) -> None:
        self._plant = SimPlant(design, options, start)
        self._plant.reset()
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
        return seen.joint_pos.tolist(), seen.spring_torque.tolist()
