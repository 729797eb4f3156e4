"""The set point swings about z2: a control law of one's own, in plain floats."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from legbench.control import Command, ControllerDescription, PhaseInfo, Role, SetupKind, Signal


@dataclass(frozen=True, kw_only=True)
class Sine:
    kind: ClassVar[str] = "sine"
    usual_setup: ClassVar[SetupKind] = SetupKind.FFS
    freq: float = 2.0
    """Frequency of the swing [Hz]."""

    def describe(self):
        phases = (PhaseInfo(code=1, name="swing", role=Role.ACTING),)
        return ControllerDescription(phases=phases, signals=(Signal("swing", (), "rad", "of z2"),))

    def build(self, targets):
        return SineLaw(self.freq, targets.motor_at(0.9, "z2"))


class SineLaw:
    def __init__(self, freq, start_motor_pos):
        self.freq, self.start_motor_pos = freq, start_motor_pos

    def reset(self, observation): ...

    def step(self, observation):
        swing = 0.1 * math.sin(2.0 * math.pi * self.freq * observation.time)
        motor_pos = self.start_motor_pos + math.sqrt(0.5) * swing * np.array([-1.0, 1.0])
        return Command(motor_pos=motor_pos, phase=np.array(1), signals=np.array([swing]))
