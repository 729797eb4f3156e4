"""What moves the motors during a hop: nothing, or the jump controller without its clock."""

import math
from abc import ABC, abstractmethod
from typing import final

import numpy as np

from legbench.analytic.equations import Pair
from legbench.analytic.taylor import SILENT, Levels, Watched
from legbench.control import JumpConfig, LegTargets
from legbench.design import LegDesign
from legbench.design.statics import Support
from legbench.kinematics import ModalConvention
from legbench.signals import Phase

SCALE = math.sqrt(0.5)


class AbstractDrive(ABC):
    """Motor positions that follow the leg; one object is one hop after the other."""

    motor: Pair
    """[rad]"""
    probe: Pair
    """What to watch: `p1 q1 + p2 q2`."""
    alarm: float
    """Time at which `ring` is to be called [s]."""

    @abstractmethod
    def restart(self) -> None:
        """Begin at the apex of a flight."""

    @abstractmethod
    def levels(self) -> Levels:
        """Probe values at which `happen` is to be called."""

    @abstractmethod
    def happen(self, what: Watched, value: float, time: float) -> None:
        """The probe did what was watched for."""

    @abstractmethod
    def ring(self, value: float, time: float) -> None:
        """The alarm."""

    @property
    @abstractmethod
    def settled(self) -> bool:
        """Whether the drive has forgotten the stance: the state of the leg says it all."""


@final
class Passive(AbstractDrive):
    """Motors held for good."""

    probe = (-SCALE, SCALE)
    alarm = math.inf

    def __init__(self, motor: Pair) -> None:
        self.motor = motor

    @property
    def settled(self) -> bool:
        """Always."""
        return True

    def restart(self) -> None:
        """Nothing to forget."""

    def levels(self) -> Levels:
        """Nothing to watch."""
        return SILENT

    def happen(self, what: Watched, value: float, time: float) -> None:
        """Never called."""

    def ring(self, value: float, time: float) -> None:
        """Never called."""


@final
class JumpLaw(AbstractDrive):
    """`legbench.control.Jump` in continuous time: the limit of a fast control cycle.

    Fold and load are both `y = s (k2 q2 - k1 q1) / k`, shifted by the motor position, so every
    threshold of the controller is a level of y, and every extreme one of its turns.

    Raises:
        ConfigError: a set point that the leg cannot reach.
    """

    def __init__(self, config: JumpConfig, design: LegDesign) -> None:
        targets = LegTargets(
            designs=design, support=Support.FOOT, convention=ModalConvention.ORTHONORMAL
        )
        self._config = config
        k1, k2 = design.stiffness
        self._k = min(k1, k2)
        self._stiffness = (k1, k2)
        self.probe = (-SCALE * k1 / self._k, SCALE * k2 / self._k)
        folded = targets.motor_at(config.z2 + config.dz2, "z2 + dz2")
        stretched = targets.motor_at(config.z2 - config.dz2, "z2 - dz2")
        self._folded = (float(folded[0]), float(folded[1]))
        self._stretched = (float(stretched[0]), float(stretched[1]))
        rest = targets.link_at_rest(folded)
        torque = np.asarray(design.stiffness) * (folded - rest)
        self._standing = -float(targets.radial(torque))
        self.phase, self.alarm, self.motor = Phase.FLIGHT, math.inf, self._folded
        self._extreme, self._loaded = 0.0, False

    def restart(self) -> None:
        """Begin in flight, unloaded and settled."""
        self._enter(Phase.FLIGHT, self._folded)

    def levels(self) -> Levels:
        """The transitions out of the phase."""
        turn = self._config.apex_turn
        match self.phase:
            case Phase.FLIGHT if self._loaded:
                return Levels(lower=self._at_load(self._config.touchdown_load))
            case Phase.FLIGHT:
                return Levels(upper=self._at_load(self._config.touchdown_load))
            case Phase.COMPRESS:
                return Levels(lower=self._extreme - turn, turns=True)
            case Phase.PUSH:
                lower = self._at_load(self._config.release_load)
                return Levels(lower=lower, upper=self._extreme + turn, turns=True)
            case _:
                return SILENT

    def happen(self, what: Watched, value: float, time: float) -> None:
        """Advance the phases."""
        match (self.phase, what):
            case (Phase.FLIGHT, Watched.RISE):
                self._load(time)
            case (Phase.FLIGHT, Watched.FALL):
                self._enter(Phase.FLIGHT, self._folded)
            case (Phase.COMPRESS, Watched.TURN):
                self._extreme = max(self._extreme, value)
            case (Phase.COMPRESS, Watched.FALL):
                self._enter(Phase.PUSH, self._stretched)
                self._extreme = value
                if value < self._at_load(self._config.release_load):
                    self._release(time)
            case (Phase.PUSH, Watched.TURN):
                self._extreme = min(self._extreme, value)
            case (Phase.PUSH, Watched.FALL | Watched.RISE):
                self._release(time)
            case _:
                pass

    def ring(self, value: float, time: float) -> None:
        """The release is over, or a load has lasted."""
        if self._loaded:
            self._compress(value)
            return
        self._enter(Phase.FLIGHT, self._folded)
        if value > self._at_load(self._config.touchdown_load):
            self._load(time)

    @property
    def settled(self) -> bool:
        """Whether the leg is in flight, or about to be."""
        return self.phase in (Phase.FLIGHT, Phase.RELEASE)

    def _load(self, time: float) -> None:
        self._loaded, self.alarm = True, time + self._config.touchdown_time

    def _compress(self, value: float) -> None:
        self._enter(Phase.COMPRESS, self._folded)
        self._extreme = value

    def _release(self, time: float) -> None:
        self._enter(Phase.RELEASE, self._folded)
        self.alarm = time + self._config.release_time

    def _enter(self, phase: Phase, motor: Pair) -> None:
        self.phase, self.motor, self.alarm, self._loaded = phase, motor, math.inf, False

    def _at_load(self, load: float) -> float:
        """The y of a load, at the present motor position."""
        k1, k2 = self._stiffness
        offset = SCALE * (k2 * self.motor[1] - k1 * self.motor[0])
        return (load * self._standing + offset) / self._k
