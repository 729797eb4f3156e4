"""Laws of the motors during a hop: motors held still, or the jump controller without sampling."""

import math
from abc import ABC, abstractmethod
from typing import final

import numpy as np

from legbench.analytic.equations import Pair
from legbench.analytic.compiled_regime import NEVER
from legbench.analytic.taylor import SILENT, Levels, Watched
from legbench.control import JumpConfig, LegTargets
from legbench.control.jump_rules import JumpPhase, phase_exits
from legbench.design import LegDesign
from legbench.design.statics import Support
from legbench.kinematics import ModalConvention

SCALE = math.sqrt(0.5)
FLIGHT, COMPRESS, PUSH = JumpPhase.FLIGHT, JumpPhase.COMPRESS, JumpPhase.PUSH
RISE, FALL, TURN = Watched.RISE, Watched.FALL, Watched.TURN
"""Members that are asked for at every event; the enumerations themselves take longer."""


class AbstractDrive(ABC):
    """Law of the motor positions, with a state of its own that goes on from hop to hop."""

    motor: Pair
    """Motor positions at present [rad]."""
    probe: Pair
    """Factors p1, p2 of the probe `p1 q1 + p2 q2` that the law watches [-]."""
    alarm: float
    """Time at which `on_alarm` is to be called [s]."""

    @abstractmethod
    def restart(self) -> None:
        """Begin at the apex of a flight."""

    @abstractmethod
    def levels(self) -> Levels:
        """Probe values at which `on_event` is to be called."""

    @abstractmethod
    def on_event(self, what: Watched, value: float, time: float) -> None:
        """Handle an event of the probe."""

    @abstractmethod
    def on_alarm(self, value: float, time: float) -> None:
        """Handle the alarm."""

    @property
    @abstractmethod
    def settled(self) -> bool:
        """Whether the law keeps no state from the stance, so that the leg's state is complete."""


@final
class Passive(AbstractDrive):
    """Motors that are held in place."""

    probe = (-SCALE, SCALE)
    alarm = math.inf

    def __init__(self, motor: Pair) -> None:
        self.motor = motor

    @property
    def settled(self) -> bool:
        """Whether the law is without state, which is always so."""
        return True

    def restart(self) -> None:
        """Do nothing, as there is no state."""

    def levels(self) -> Levels:
        """No levels, as there is nothing to watch."""
        return SILENT

    def on_event(self, what: Watched, value: float, time: float) -> None:
        """Do nothing, as no event is watched."""

    def on_alarm(self, value: float, time: float) -> None:
        """Do nothing, as no alarm is set."""


@final
class JumpLaw(AbstractDrive):
    """`legbench.control.Jump` in continuous time: the limit of a fast control cycle.

    Fold and load are both `y = s (k2 q2 - k1 q1) / k`, shifted by the motor position, so every
    threshold of the controller is a level of y, and every extreme one of its turning points.

    Raises:
        ConfigError: settings that the controller itself refuses for this leg.
    """

    def __init__(self, config: JumpConfig, design: LegDesign) -> None:
        targets = LegTargets(
            designs=design, support=Support.FOOT, convention=ModalConvention.ORTHONORMAL
        )
        config.build(targets)
        self._exits, self._turn = phase_exits(config), config.apex_turn
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
        standing = -float(targets.radial(torque))
        self._at_load = {
            phase: self._load_level(end.load * standing, self._motor_in(phase))
            for phase, end in self._exits.items()
        }
        self._in_flight = Levels(upper=self._at_load[FLIGHT])
        self._in_doubt = Levels(lower=self._at_load[FLIGHT])
        self._extreme, self._loaded = 0.0, False
        self._levels: Levels | None = None
        self._enter(FLIGHT)

    def restart(self) -> None:
        """Begin in flight, unloaded and settled."""
        self._enter(FLIGHT)

    def levels(self) -> Levels:
        """Levels that end the phase; the same object as long as they do not change."""
        if self._levels is None:
            self._levels = self._new_levels()
        return self._levels

    def _new_levels(self) -> Levels:
        if self.phase is FLIGHT:
            return self._in_doubt if self._loaded else self._in_flight
        if self.phase is COMPRESS:
            return Levels(NEVER, self._extreme - self._turn, True)
        if self.phase is PUSH:
            return Levels(self._extreme + self._turn, self._at_load[PUSH], True)
        return SILENT

    def on_event(self, what: Watched, value: float, time: float) -> None:
        """Advance the phase after an event of the probe."""
        self._levels = None
        if self.phase is FLIGHT:
            if what is RISE:
                self._load(time)
            elif what is FALL:
                self._enter(FLIGHT)
        elif self.phase is COMPRESS:
            if what is TURN:
                self._extreme = max(self._extreme, value)
            elif what is FALL:
                self._leave(value)
                if value < self._at_load[PUSH]:
                    self._release(time)
        elif self.phase is PUSH:
            if what is TURN:
                self._extreme = min(self._extreme, value)
            else:
                self._release(time)

    def on_alarm(self, value: float, time: float) -> None:
        """Advance the phase after the alarm: the release is over, or a load has lasted."""
        self._levels = None
        if self._loaded:
            self._leave(value)
            return
        self._enter(FLIGHT)
        if value > self._at_load[FLIGHT]:
            self._load(time)

    @property
    def settled(self) -> bool:
        """Whether the leg is in flight, or about to be."""
        return self.phase in (JumpPhase.FLIGHT, JumpPhase.RELEASE)

    def _load(self, time: float) -> None:
        self._loaded, self.alarm = True, time + self._exit.dwell

    def _release(self, time: float) -> None:
        self._enter(self._exit.to)
        self.alarm = time + self._exit.dwell

    def _leave(self, value: float) -> None:
        """Go on to the next phase, whose extreme is searched from `value` on."""
        self._enter(self._exit.to)
        self._extreme = value

    def _enter(self, phase: JumpPhase) -> None:
        self.phase, self._exit = phase, self._exits[phase]
        self.motor = self._motor_in(phase)
        self.alarm, self._loaded, self._levels = math.inf, False, None

    def _motor_in(self, phase: JumpPhase) -> Pair:
        return self._stretched if phase is PUSH else self._folded

    def _load_level(self, load: float, motor: Pair) -> float:
        """The y of a load [N m] at a motor position."""
        k1, k2 = self._stiffness
        return (load + SCALE * (k2 * motor[1] - k1 * motor[0])) / self._k
