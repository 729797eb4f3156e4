"""Hopping in place: push along the mode in the second half of stance (section IV-A, VI-C).

The phases come from the springs alone, so nothing needs to know about the ground:

    REST -> PUSH --unloaded--> RELEASE --settled--> FLIGHT --loaded--> COMPRESS --+
             ^ |                                                                  |
             | +--upper apex without lift-off--> COMPRESS                         |
             +-----------------------lower apex-----------------------------------+

Their torque is the load, `-tau_z`; motor position less torque over stiffness is how far the leg
is folded, whose maximum is the lower apex and whose minimum is the upper one.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from legbench.control.abstract import AbstractController
from legbench.control.setpoint import LegTargets
from legbench.errors import ConfigError
from legbench.signals import Command, Floats, Ints, Observation, Phase


@dataclass(frozen=True, slots=True, kw_only=True)
class JumpConfig:
    """The equilibrium is at z2 + dz2 in flight and compression, at z2 - dz2 in the push."""

    kind: ClassVar[str] = "jump"
    z2: float = 0.45
    """Middle of the two set points [rad]."""
    dz2: float = 0.15
    """Amplitude of the push [rad]."""
    delay: float = 0.1
    """Time at rest, to read the load of standing, before the first push [s]."""
    touchdown_load: float = 0.75
    """Load that means ground, as a share of the load of standing [-]."""
    release_load: float = 0.2
    """Load at which a push has lifted the leg, as a share of the load of standing [-]."""
    apex_turn: float = 0.01
    """How far z2 must have come back from its extreme to tell an apex [rad]."""
    release_time: float = 0.03
    """Shortest time from release to the next touchdown [s]."""


@final
class Jump(AbstractController):
    """Pumps the radial mode until the leg hops, and keeps it hopping.

    Raises:
        ConfigError: a set point that the leg cannot reach, or thresholds out of order.
    """

    def __init__(self, config: JumpConfig, targets: LegTargets) -> None:
        if not config.dz2 > 0.0:
            raise ConfigError(f"dz2 is {config.dz2:g} rad; a push needs a positive amplitude")
        if not 0.0 < config.release_load < config.touchdown_load < 1.0:
            raise ConfigError(
                f"release_load {config.release_load:g} and touchdown_load "
                f"{config.touchdown_load:g} must satisfy 0 < release < touchdown < 1 (shares of "
                "the load of standing)"
            )
        self._config, self._targets = config, targets
        self._folded = targets.motor_at(config.z2 + config.dz2, "z2 + dz2")
        self._stretched = targets.motor_at(config.z2 - config.dz2, "z2 - dz2")
        self._stiffness = targets.modal_stiffness()
        shape = self._folded.shape[:-1]
        self._phase: Ints = np.full(shape, Phase.REST, dtype=np.int64)
        self._extreme: Floats = np.zeros(shape)
        self._since: Floats = np.zeros(shape)
        self._standing: Floats = np.ones(shape)

    @property
    def start_motor_pos(self) -> Floats:
        """At z2 + dz2, standing."""
        return self._folded

    def reset(self, observation: Observation) -> None:
        """Take the load of the standing leg as the unit of load."""
        self._standing = -self._targets.radial(observation.spring_torque)
        if not np.all(self._standing > 0.0):
            raise ConfigError(
                "the leg does not load its springs at rest; jumping needs setup 'jump' or 'ffs'"
            )
        self._phase = np.full(self._standing.shape, Phase.REST, dtype=np.int64)
        self._extreme = np.zeros(self._standing.shape)
        self._since = np.zeros(self._standing.shape)

    def step(self, observation: Observation) -> Command:
        """Advance the phases, then command the equilibrium that belongs to them."""
        time = observation.time
        torque = self._targets.radial(observation.spring_torque)
        fold = self._targets.radial(observation.motor_pos) - torque / self._stiffness
        phase = self._next(-torque / self._standing, fold, time)
        entered = phase != self._phase
        self._since = np.where(entered, time, self._since)
        self._extreme = np.where(entered, fold, self._track(phase, fold))
        self._phase = phase
        pushing = (phase == Phase.PUSH)[..., np.newaxis]
        return Command(motor_pos=np.where(pushing, self._stretched, self._folded), phase=phase)

    def _next(self, load: Floats, fold: Floats, time: float) -> Ints:
        """Phase of this cycle from the last one; at most one transition a cycle."""
        config, last = self._config, self._phase
        settled = time - self._since >= config.release_time
        past_lower_apex = fold < self._extreme - config.apex_turn
        past_upper_apex = fold > self._extreme + config.apex_turn
        transitions = (
            (Phase.REST, np.asarray(time >= config.delay), Phase.PUSH),
            (Phase.PUSH, past_upper_apex, Phase.COMPRESS),
            (Phase.PUSH, load < config.release_load, Phase.RELEASE),
            (Phase.RELEASE, settled, Phase.FLIGHT),
            (Phase.FLIGHT, load > config.touchdown_load, Phase.COMPRESS),
            (Phase.COMPRESS, past_lower_apex, Phase.PUSH),
        )
        phase = last
        for origin, condition, target in transitions:
            phase = np.where((last == origin) & condition, target, phase)
        return phase

    def _track(self, phase: Ints, fold: Floats) -> Floats:
        """Largest fold of the compression so far, smallest of the push."""
        tracked = np.where(phase == Phase.COMPRESS, np.maximum(self._extreme, fold), self._extreme)
        return np.where(phase == Phase.PUSH, np.minimum(self._extreme, fold), tracked)
