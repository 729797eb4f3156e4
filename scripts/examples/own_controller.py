"""A controller of one's own: kick the leg once, then push the way it moves, like a swing."""

from dataclasses import dataclass

import numpy as np

from legbench.control import Command, ControllerDescription, PhaseInfo, Role, SetupKind, Signal

KICK = PhaseInfo(code=0, name="kick", role=Role.ACTING)
PUMP = PhaseInfo(code=1, name="pump", role=Role.ACTING)


@dataclass(frozen=True, kw_only=True)
class Pump:
    kind, usual_setup = "pump", SetupKind.FFS
    push: float = 0.05
    """How far the motors lead the leg [rad]."""

    def describe(self):
        rate = Signal("fold_rate", (), "rad/s", "half the rate at which the knee folds")
        return ControllerDescription(phases=(KICK, PUMP), signals=(rate,))

    def build(self, targets):
        return PumpLaw(self.push, targets.motor_at(0.9, "z2"))


class PumpLaw:
    def __init__(self, push, start_motor_pos):
        self.push, self.start_motor_pos = push, start_motor_pos

    def reset(self, observation): ...

    def step(self, observation):
        rate = observation.joint_vel @ [-0.5, 0.5]
        phase, lead = (KICK, 1.0) if observation.time < 0.1 else (PUMP, np.tanh(rate))
        motor_pos = self.start_motor_pos + lead * self.push * np.array([-1.0, 1.0])
        return Command(motor_pos=motor_pos, phase=np.array(phase.code), signals=np.array([rate]))
