"""Laws of the motors during a hop: motors held still, or the jump controller without sampling."""

import math
from abc import ABC, abstractmethod
from typing import final

import numpy as np

from legbench.analytic.compiled_regime import NEVER, SILENT, Levels
from legbench.analytic.equations import Pair
from legbench.analytic.parameters import Watched
from legbench.control import JumpConfig, LegTargets
from legbench.control.jump_rules import JumpPhase, phase_exits
from legbench.design import LegDesign
from legbench.design.statics import Support
from legbench.kinematics import ModalConvention

SCALE, INF = math.sqrt(0.5), math.inf
CROSSED = 1e-9
"""Largest reading beyond a level that has been crossed and not jumped over [rad]."""
FLIGHT, COMPRESS = JumpPhase.FLIGHT, JumpPhase.COMPRESS
PUSH, RELEASE = JumpPhase.PUSH, JumpPhase.RELEASE
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
    levels: Levels
    """Probe values at which `on_event` is to be called; the same object as long as they stay."""
    stands: bool = False
    """Whether the foot is on the ground: a hint at what comes next, the law is the same."""

    @abstractmethod
    def restart(self) -> None:
        """Begin at the apex of a flight."""

    @abstractmethod
    def on_event(self, what: Watched, value: float, time: float) -> None:
        """Handle an event of the probe."""

    @abstractmethod
    def on_alarm(self, value: float, time: float) -> None:
        """Handle the alarm."""

    @abstractmethod
    def settled(self, time: float) -> bool:
        """Whether the law keeps no state from the stance, so that the leg's state is complete."""


@final
class Passive(AbstractDrive):
    """Motors that are held in place."""

    probe = (-SCALE, SCALE)
    alarm = INF
    levels = SILENT

    def __init__(self, motor: Pair) -> None:
        self.motor = motor

    def settled(self, time: float) -> bool:
        """Whether the law is without state, which is always so."""
        return True

    def restart(self) -> None:
        """Do nothing, as there is no state."""

    def on_event(self, what: Watched, value: float, time: float) -> None:
        """Do nothing, as no event is watched."""

    def on_alarm(self, value: float, time: float) -> None:
        """Do nothing, as no alarm is set."""


@final
class JumpLaw(AbstractDrive):
    """`legbench.control.Jump` in continuous time: the limit of a fast control cycle.

    Fold and load are both `y = s (k2 q2 - k1 q1) / k`, shifted by the motor position, so every
    threshold of the controller is a level of y, and every extreme one of its turning points.

    A time that only has to pass is no alarm as long as nothing can depend on it: the law passes
    over it in silence, and an event before it sets the alarm.

    Attributes:
        phase: phase of the controller, which may have changed at `lapse` without notice.
        lapse: time that is passed over in silence [s]: a release is over, or a rising load has
            lasted. Infinity if there is none.

    Raises:
        ConfigError: settings that the controller itself refuses for this leg.
    """

    def __init__(self, config: JumpConfig, design: LegDesign) -> None:
        targets = LegTargets(
            designs=design, support=Support.FOOT, convention=ModalConvention.ORTHONORMAL
        )
        config.build(targets)
        exits, self._turn = phase_exits(config), config.apex_turn
        self._dwell = {phase: exits[phase].dwell for phase in (FLIGHT, RELEASE)}
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
        self._loaded, self._unloaded = (
            self._load_level(exits[phase].load * standing, motor)
            for phase, motor in ((FLIGHT, self._folded), (PUSH, self._stretched))
        )
        self._in_flight, self._in_doubt = Levels(upper=self._loaded), Levels(lower=self._loaded)
        self._rising = Levels(lower=self._loaded, turns=True)
        self._extreme = 0.0
        self._enter(FLIGHT)

    def restart(self) -> None:
        """Begin in flight, unloaded and settled."""
        self.stands = False
        self._enter(FLIGHT)

    def on_event(self, what: Watched, value: float, time: float) -> None:
        """Advance the phase after an event of the probe."""
        if what is TURN:
            self._turned(value, time)
        elif self.phase is PUSH:
            self._release(time)
        elif self.phase is COMPRESS:
            self._leave(value)
            if value < self._unloaded:
                self._release(time)
        elif what is FALL:
            self._enter(FLIGHT)
        elif self.phase is RELEASE and time < self.lapse:
            self.levels, self.alarm, self.lapse = SILENT, self.lapse, INF
        else:
            self.phase = FLIGHT
            self._load(time, rises=self.stands and value - self._loaded < CROSSED)

    def on_alarm(self, value: float, time: float) -> None:
        """Advance the phase after the alarm: the release is over, or a load has lasted."""
        if self.phase is FLIGHT:
            self._leave(value)
            return
        self._enter(FLIGHT)
        if value > self._loaded:
            self._load(time, rises=False)

    def settled(self, time: float) -> bool:
        """Whether the leg is in flight, or about to be."""
        return self.phase is RELEASE or (self.phase is FLIGHT and time < self.lapse)

    def _turned(self, value: float, time: float) -> None:
        """Note an extreme of the probe."""
        if self.phase is COMPRESS:
            if value > self._extreme:
                self._search(value)
        elif self.phase is PUSH:
            if value < self._extreme:
                self._search(value)
        elif time >= self.lapse:
            self._leave(value)
        else:
            self.levels, self.alarm, self.lapse = self._in_doubt, self.lapse, INF

    def _load(self, time: float, *, rises: bool) -> None:
        """Wait for a load to last; one that rises can only fall after a turn."""
        lasted = time + self._dwell[FLIGHT]
        if rises:
            self.levels, self.alarm, self.lapse = self._rising, INF, lasted
        else:
            self.levels, self.alarm, self.lapse = self._in_doubt, lasted, INF

    def _release(self, time: float) -> None:
        """Let the motors go back, and watch for a load, which counts after some time only."""
        self._enter(RELEASE)
        self.lapse = time + self._dwell[RELEASE]

    def _leave(self, value: float) -> None:
        """Go on to the next phase, whose extreme is searched from `value` on."""
        self.alarm = self.lapse = INF
        if self.phase is FLIGHT:
            self.phase = COMPRESS
        else:
            self.phase, self.motor = PUSH, self._stretched
        self._search(value)

    def _search(self, extreme: float) -> None:
        """Watch for the turn that ends the phase, after the extreme so far."""
        self._extreme = extreme
        if self.phase is COMPRESS:
            self.levels = Levels(NEVER, extreme - self._turn, True)
        else:
            self.levels = Levels(extreme + self._turn, self._unloaded, True)

    def _enter(self, phase: JumpPhase) -> None:
        """Enter a phase in which the leg is in the air, or about to be."""
        self.phase, self.motor, self.levels = phase, self._folded, self._in_flight
        self.alarm = self.lapse = INF

    def _load_level(self, load: float, motor: Pair) -> float:
        """The y of a load [N m] at a motor position."""
        k1, k2 = self._stiffness
        return (load + SCALE * (k2 * motor[1] - k1 * motor[0])) / self._k
