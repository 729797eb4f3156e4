"""A plant of one's own: a leg that follows its motors without springs or mass."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from legbench.plant.abstract import AbstractPlant
from legbench.plants import Leg
from legbench.signals import Command, Floats, Observation


@dataclass(frozen=True, kw_only=True)
class Still:
    kind: ClassVar[str] = "still"
    lag: float = 0.5
    """Share of the way to the motors that is left after a cycle [-]."""

    def open(self, leg: Leg) -> AbstractPlant:
        return StillPlant(self.lag, leg)


class StillPlant(AbstractPlant):
    period = 0.001

    def __init__(self, lag: float, leg: Leg) -> None:
        self.lag, self.start, self.stiffness = lag, leg.start, np.asarray(leg.design.stiffness)

    def reset(self) -> Observation:
        self.cycle, self.joint_pos = 0, self.start.joint_pos.copy()
        return self.look(self.start.motor_pos)

    def step(self, command: Command) -> Observation:
        self.cycle += 1
        self.joint_pos = command.motor_pos + self.lag * (self.joint_pos - command.motor_pos)
        return self.look(command.motor_pos)

    def look(self, motor_pos: Floats) -> Observation:
        return Observation(
            time=self.cycle * self.period,
            motor_pos=motor_pos.copy(),
            joint_pos=self.joint_pos.copy(),
            joint_vel=np.zeros(2),
            spring_torque=self.stiffness * (motor_pos - self.joint_pos),
            applied_pos=motor_pos.copy(),
        )

    def close(self) -> None:
        """Nothing to release."""
