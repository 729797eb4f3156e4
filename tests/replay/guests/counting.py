"""A control law of one's own that obeys the time to the last bit, and tells what it has seen."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from legbench.control import Command, ControllerDescription, PhaseInfo, Role, SetupKind, Signal


@dataclass(frozen=True, kw_only=True)
class Counting:
    kind: ClassVar[str] = "counting"
    usual_setup: ClassVar[SetupKind] = SetupKind.FFS
    z2: float = 1.0
    every: float = 0.003
    """Time after which the law steps on [s]."""

    def build(self, targets):
        return CountingLaw(self, targets)

    def describe(self) -> ControllerDescription:
        phases = tuple(
            PhaseInfo(code=code, name=f"n{code}", role=Role.ACTING if code else Role.REST)
            for code in range(100)
        )
        seen = Signal("seen", ("1", "2"), "rad", "link angles as the law saw them")
        return ControllerDescription(phases=phases, signals=(seen,))


class CountingLaw:
    def __init__(self, config, targets) -> None:
        self.every, self.start_motor_pos = config.every, targets.motor_at(config.z2, "z2")

    def reset(self, observation) -> None:
        self.since, self.count = observation.time, 0

    def step(self, observation) -> Command:
        if observation.time - self.since >= self.every:
            self.since, self.count = observation.time, min(self.count + 1, 99)
        push = 1e-4 * self.count * np.array([1.0, -1.0])
        return Command(
            motor_pos=self.start_motor_pos + push,
            phase=np.array(self.count),
            signals=observation.joint_pos.copy(),
        )
