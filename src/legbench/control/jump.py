"""Hopping in place: push along the mode in the second half of stance (section IV-A, VI-C).

The phases come from the springs alone, so nothing needs to know about the ground. They form a
ring, each with one way out:

    REST      after a while                               -> PUSH
    PUSH      unloaded, or at an upper apex on the ground -> RELEASE
    RELEASE   after a while                               -> FLIGHT
    FLIGHT    loaded for a while: touchdown               -> COMPRESS
    COMPRESS  at the lower apex                           -> PUSH

The springs' torque is the load, `-tau_z`; motor position less torque over stiffness is how far
the leg is folded, whose maximum is the lower apex and whose minimum is the upper one.

A leg in the air vibrates, and each swing may load the springs more than standing does. But it
changes sign twice a period: only the ground loads them for longer than half of one.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from legbench.control.abstract import AbstractController
from legbench.control.setpoint import LegTargets, check_delay
from legbench.design.statics import Support
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
    """Shortest time from release to the next flight [s]."""
    touchdown_time: float = 0.05
    """How long that load must last; more than half a period of the leg's vibration in the air
    [s]."""


STANDING_ONLY = "the leg does not load its springs at rest; jumping needs setup 'jump' or 'ffs'"

NEXT = np.zeros(len(Phase), dtype=np.int64)
NEXT[Phase.REST] = NEXT[Phase.COMPRESS] = Phase.PUSH
NEXT[Phase.PUSH], NEXT[Phase.RELEASE] = Phase.RELEASE, Phase.FLIGHT
NEXT[Phase.FLIGHT] = Phase.COMPRESS
"""Phase -> the phase after it."""


def _by_phase(otherwise: float, entries: dict[Phase, float]) -> Floats:
    table = np.full(len(Phase), otherwise)
    for phase, value in entries.items():
        table[phase] = value
    return table


@final
class Jump(AbstractController):
    """Pumps the radial mode until the leg hops, and keeps it hopping.

    Raises:
        ConfigError: a set point that the leg cannot reach, thresholds out of order, a time that
            makes no sense, or a leg that does not stand.
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
        if not 0.0 < config.apex_turn < math.inf:
            raise ConfigError(f"apex_turn is {config.apex_turn:g} rad; it must be positive")
        for name in ("release_time", "touchdown_time"):
            if not 0.0 <= getattr(config, name) < math.inf:
                raise ConfigError(f"{name} is {getattr(config, name):g} s; it must be 0 or more")
        check_delay(config.delay)
        if targets.support is not Support.FOOT:
            raise ConfigError(STANDING_ONLY)
        self._targets, self._apex_turn = targets, config.apex_turn
        self._folded = targets.motor_at(config.z2 + config.dz2, "z2 + dz2")
        self._stretched = targets.motor_at(config.z2 - config.dz2, "z2 - dz2")
        self._stiffness = targets.modal_stiffness()
        self._apex_of = _by_phase(0.0, {Phase.COMPRESS: 1.0, Phase.PUSH: -1.0})
        self._sense_of = _by_phase(1.0, {Phase.COMPRESS: 0.0, Phase.PUSH: -1.0})
        self._load_of = _by_phase(
            -np.inf,
            {
                Phase.FLIGHT: config.touchdown_load,
                Phase.COMPRESS: 0.0,
                Phase.PUSH: config.release_load,
            },
        )
        self._dwell_of = _by_phase(
            0.0,
            {
                Phase.REST: config.delay,
                Phase.RELEASE: config.release_time,
                Phase.FLIGHT: config.touchdown_time,
            },
        )
        self._standing: Floats = np.ones(self._folded.shape[:-1])
        self._since: Floats = np.zeros(self._folded.shape[:-1])
        self._furthest: Floats = np.zeros(self._folded.shape[:-1])
        self._enter(np.full(self._folded.shape[:-1], Phase.REST, dtype=np.int64))

    @property
    def start_motor_pos(self) -> Floats:
        """At z2 + dz2, standing."""
        return self._folded

    def reset(self, observation: Observation) -> None:
        """Take the load of the standing leg as the unit of load."""
        self._standing = -self._targets.radial(observation.spring_torque)
        if not np.all(self._standing > 0.0):
            raise ConfigError(STANDING_ONLY)
        self._since = np.zeros(self._standing.shape)
        self._furthest = np.zeros(self._standing.shape)
        self._enter(np.full(self._standing.shape, Phase.REST, dtype=np.int64))

    def step(self, observation: Observation) -> Command:
        """Leave the phase whose end has come, command the equilibrium that belongs to the next."""
        torque = self._targets.radial(observation.spring_torque)
        fold = self._targets.radial(observation.motor_pos) - torque / self._stiffness
        towards = self._apex * fold
        self._furthest = np.maximum(self._furthest, towards)
        at_apex = self._furthest - towards > self._apex_turn
        holds = self._sense * (-torque / self._standing - self._load) > 0.0
        self._since = np.where(holds, self._since, observation.time)
        leaving = at_apex | (holds & (observation.time - self._since >= self._dwell))
        if np.count_nonzero(leaving):
            self._since = np.where(leaving, observation.time, self._since)
            self._enter(np.where(leaving, NEXT[self._phase], self._phase))
            self._furthest = np.where(leaving, self._apex * fold, self._furthest)
        return self._command

    def _enter(self, phase: Ints) -> None:
        """Look up what ends each leg's phase, and make the command that goes with it.

        An apex, or a load on one side of a level for a while; any load passes -inf, none passes a
        sense of 0.
        """
        self._phase = phase
        self._apex, self._dwell = self._apex_of[phase], self._dwell_of[phase]
        self._sense, self._load = self._sense_of[phase], self._load_of[phase]
        pushing = (phase == Phase.PUSH)[..., np.newaxis]
        motor_pos = np.where(pushing, self._stretched, self._folded)
        self._command = Command(motor_pos=motor_pos, phase=phase)
