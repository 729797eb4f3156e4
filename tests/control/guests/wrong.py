"""Laws that do what they must not; `way` says what."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from legbench.control import (
    Command,
    ControllerDescription,
    LegTargets,
    Observation,
    PhaseInfo,
    Role,
    SetupKind,
)

TURN = 20
"""Cycle in which they do it."""


@dataclass(frozen=True, kw_only=True)
class Wrong:
    kind: ClassVar[str] = "wrong"
    usual_setup: ClassVar[SetupKind] = SetupKind.FFS
    way: str = "raise"
    """What the law does wrong."""
    duration: float = 0.25
    """Setting whose name is a flag already [s]."""

    def build(self, targets: LegTargets) -> Any:
        return WrongLaw(self.way, targets)

    def describe(self) -> ControllerDescription:
        return ControllerDescription(phases=(PhaseInfo(code=0, name="hold", role=Role.REST),))


class WrongLaw:
    def __init__(self, way: str, targets: LegTargets) -> None:
        self.start_motor_pos = targets.motor_at(0.9, "z2")
        self.way, self.cycle = way, 0

    def reset(self, observation: Observation) -> None:
        self.cycle = 0

    def step(self, observation: Observation) -> Any:
        self.cycle += 1
        good = Command.holding(self.start_motor_pos)
        if self.cycle < TURN:
            return good
        if self.way == "raise":
            raise ZeroDivisionError("a law that divides by zero")
        if self.way == "write":
            observation.joint_pos[0] = 9.0
        return {
            "nothing": None,
            "nan": Command(motor_pos=np.full(2, np.nan), phase=good.phase),
            "shape": Command(motor_pos=np.zeros(3), phase=good.phase),
            # pyrefly: ignore[bad-argument-type]
            "text": Command(motor_pos="north", phase=good.phase),
            # pyrefly: ignore[bad-argument-type]
            "list": Command(motor_pos=self.start_motor_pos.tolist(), phase=0),
            "phase": Command(motor_pos=good.motor_pos, phase=np.array(300)),
            "float phase": Command(motor_pos=good.motor_pos, phase=np.array(0.5)),
            "signals": Command(motor_pos=good.motor_pos, phase=good.phase, signals=np.zeros(1)),
        }.get(self.way, good)
