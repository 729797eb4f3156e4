"""One step of the equilibrium in modal space (section IV-B): shows the passive motion."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from legbench.control.abstract import AbstractController
from legbench.control.setpoint import LegTargets, check_delay
from legbench.signals import Command, Floats, Observation, Phase


@dataclass(frozen=True, slots=True, kw_only=True)
class PositionJumpConfig:
    """From z2 + dz2 to z2."""

    kind: ClassVar[str] = "position-jump"
    z2: float = 1.0
    """Set point after the jump [rad]."""
    dz2: float = 0.3
    """Deflection before it; positive: shorter leg [rad]."""
    delay: float = 0.1
    """Time at rest before the jump [s]."""


@final
class PositionJump(AbstractController):
    """Holds z2 + dz2, then z2 for good.

    Raises:
        ConfigError: a set point that the leg cannot reach, or a delay that makes no sense.
    """

    def __init__(self, config: PositionJumpConfig, targets: LegTargets) -> None:
        self._before = targets.motor_at(config.z2 + config.dz2, "z2 + dz2")
        self._after = targets.motor_at(config.z2, "z2")
        check_delay(config.delay)
        self._delay = config.delay
        shape = self._before.shape[:-1]
        self._rest = Command.holding(self._before)
        stepped = np.full(shape, Phase.STEPPED, dtype=np.int64)
        self._stepped = Command(motor_pos=self._after, phase=stepped)

    @property
    def start_motor_pos(self) -> Floats:
        """At z2 + dz2."""
        return self._before

    def reset(self, observation: Observation) -> None:
        """There is nothing to forget."""

    def step(self, observation: Observation) -> Command:
        """The step comes at `delay`."""
        return self._rest if observation.time < self._delay else self._stepped
