"""One step of the equilibrium in modal space (section IV-B): shows the passive motion."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import partial
from typing import ClassVar, final

import numpy as np

from legbench.control.abstract import AbstractController
from legbench.control.per_leg import check_delays, setting
from legbench.control.setpoint import LegTargets
from legbench.design.setup import SetupKind
from legbench.phases import ControllerDescription, Counting, PhaseInfo, Role
from legbench.signals import Command, Floats, Observation

RATED_SHARE = 0.1
"""Share of the deflection that the amplitude of a period must exceed to count (Fig. 5) [-]."""


class PositionJumpPhase(IntEnum):
    """Phases of the position jump, as recorded: whether the equilibrium has been moved."""

    REST = 0
    """Equilibrium at z2 + dz2."""
    STEPPED = 1
    """Equilibrium at z2."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PositionJumpConfig:
    """Step of the equilibrium from z2 + dz2 to z2."""

    kind: ClassVar[str] = "position-jump"
    usual_setup: ClassVar[SetupKind] = SetupKind.FFS
    batched: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("motor_pos",)
    z2: float = 1.0
    """Set point after the jump [rad]."""
    dz2: float = 0.3
    """Deflection before it; positive: shorter leg [rad]."""
    delay: float = 0.1
    """Time at rest before the jump [s]."""

    def build(self, targets: LegTargets) -> AbstractController:
        """Make the controller for these legs; raises ConfigError where they refuse the settings."""
        return PositionJump(self, targets)

    @classmethod
    def build_each(
        cls, settings: "Sequence[PositionJumpConfig]", targets: LegTargets
    ) -> AbstractController:
        """Make the controller of a batch whose legs have settings of their own."""
        return PositionJump(settings, targets)

    def describe(self) -> ControllerDescription:
        """Return its phases, and that periods count above a tenth of the deflection."""
        return ControllerDescription(
            phases=(
                PhaseInfo(
                    code=PositionJumpPhase.REST, name="rest", role=Role.REST, doc="at z2 + dz2"
                ),
                PhaseInfo(
                    code=PositionJumpPhase.STEPPED,
                    name="stepped",
                    role=Role.ACTING,
                    doc="the equilibrium has been moved to z2",
                ),
            ),
            counting=Counting(smallest=RATED_SHARE * abs(self.dz2)),
        )


@final
class PositionJump(AbstractController):
    """Controller that holds z2 + dz2, then z2 until the end.

    Raises:
        ConfigError: a set point that the leg cannot reach, or a delay that makes no sense.
    """

    def __init__(
        self, config: PositionJumpConfig | Sequence[PositionJumpConfig], targets: LegTargets
    ) -> None:
        """Prepare for the legs of `targets`, all with the same settings or each with its own."""
        of = partial(setting, config)
        self._before = targets.motor_at(of("z2") + of("dz2"), "z2 + dz2")
        self._after = targets.motor_at(of("z2"), "z2")
        check_delays(config)
        self._delay = of("delay")
        self._last = float(np.max(self._delay))
        shape = self._before.shape[:-1]
        self._rest = Command.holding(self._before)
        stepped = np.full(shape, PositionJumpPhase.STEPPED, dtype=np.int64)
        self._stepped = Command(motor_pos=self._after, phase=stepped)

    @property
    def start_motor_pos(self) -> Floats:
        """Equilibrium at z2 + dz2."""
        return self._before

    def reset(self, observation: Observation) -> None:
        """Begin anew, for which there is nothing to forget."""

    def step(self, observation: Observation) -> Command:
        """Command z2 + dz2 until `delay`, z2 afterwards."""
        if observation.time >= self._last:
            return self._stepped
        waits = np.asarray(observation.time < self._delay)
        if waits.all():
            return self._rest
        return Command(
            motor_pos=np.where(waits[..., np.newaxis], self._before, self._after),
            phase=np.where(waits, self._rest.phase, self._stepped.phase),
        )
