"""Hopping in place: push along the mode in the second half of stance (section IV-A, VI-C).

`legbench.control.jump_rules` holds the phases and what ends them. One leg is stepped in plain
floats, a batch in arrays; both obey the same table, and their commands are equal to the bit.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from legbench.control.abstract import NO_ERRORS, AbstractController
from legbench.control.jump_rules import JumpPhase, PhaseExit, phase_exits, phase_infos
from legbench.control.per_leg import each_config, setting
from legbench.control.setpoint import LegTargets, check_delay
from legbench.design import LegDesign
from legbench.design.setup import SetupKind
from legbench.design.statics import Support
from legbench.errors import ConfigError
from legbench.phases import ControllerDescription
from legbench.signals import Command, Floats, Ints, Observation


@dataclass(frozen=True, slots=True, kw_only=True)
class JumpConfig:
    """The equilibrium is at z2 + dz2 in flight and compression, at z2 - dz2 in the push."""

    kind: ClassVar[str] = "jump"
    usual_setup: ClassVar[SetupKind] = SetupKind.JUMP
    batched: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("motor_pos", "spring_torque")
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
    """Change of z2 back from its extreme by which an apex is detected [rad]."""
    release_time: float = 0.03
    """Shortest time from release to the next flight [s]."""
    touchdown_time: float = 0.05
    """How long that load must last; more than half a period of the leg's vibration in the air
    [s]."""

    def build(self, targets: LegTargets) -> AbstractController:
        """Make the controller for these legs; raises ConfigError where they refuse the settings."""
        return Jump(self, targets)

    @classmethod
    def build_each(
        cls, settings: "Sequence[JumpConfig]", targets: LegTargets
    ) -> AbstractController:
        """Make the controller of a batch whose legs have settings of their own."""
        return Jump(settings, targets)

    def describe(self) -> ControllerDescription:
        """Return its description: its phases, and that every period counts."""
        return ControllerDescription(phases=phase_infos(self))


STANDING_ONLY = "the leg does not load its springs at rest; jumping needs setup 'jump' or 'ffs'"


@final
class Jump(AbstractController):
    """Controller that pumps the radial mode until the leg hops, and keeps it hopping.

    Raises:
        ConfigError: a set point that the leg cannot reach, thresholds out of order, a time that
            makes no sense, or a leg that does not stand.
    """

    def __init__(self, config: JumpConfig | Sequence[JumpConfig], targets: LegTargets) -> None:
        """Prepare for the legs of `targets`, all with the same settings or each with its own."""
        for each in each_config(config):
            _check(each)
        if targets.support is not Support.FOOT:
            raise ConfigError(STANDING_ONLY)
        z2, dz2 = setting(config, "z2"), setting(config, "dz2")
        folded = targets.motor_at(z2 + dz2, "z2 + dz2")
        stretched = targets.motor_at(z2 - dz2, "z2 - dz2")
        if isinstance(config, JumpConfig) and isinstance(targets.designs, LegDesign):
            self._law = _OneLeg(config, targets, folded, stretched)
        else:
            self._law = _Batch(each_config(config), targets, folded, stretched)
        self._folded = folded

    @property
    def start_motor_pos(self) -> Floats:
        """Motor positions of the leg that stands at z2 + dz2 [rad]."""
        return self._folded

    @property
    def leg_errors(self) -> Mapping[int, Exception]:
        """Legs of a batch that do not stand at rest, by number."""
        return self._law.errors

    def reset(self, observation: Observation) -> None:
        """Begin anew with the load of the standing leg as the unit of load."""
        self._law.reset(observation)

    def step(self, observation: Observation) -> Command:
        """Leave the phase whose end has come, command the equilibrium that belongs to the next."""
        return self._law.step(observation)


def _check(config: JumpConfig) -> None:
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


@final
class _OneLeg:
    """Law of one leg in plain floats."""

    errors: ClassVar[Mapping[int, Exception]] = NO_ERRORS

    def __init__(
        self, config: JumpConfig, targets: LegTargets, folded: Floats, stretched: Floats
    ) -> None:
        self._targets, self._scale = targets, targets.convention.scale
        self._stiffness = float(targets.modal_stiffness())
        self._turn = config.apex_turn
        self._exits = phase_exits(config)
        self._commands = {
            phase: _fixed(stretched if phase is JumpPhase.PUSH else folded, phase)
            for phase in JumpPhase
        }
        self._standing, self._since, self._furthest = 1.0, 0.0, 0.0
        self._enter(JumpPhase.REST)

    def reset(self, observation: Observation) -> None:
        self._standing = -float(self._targets.radial(observation.spring_torque))
        if not self._standing > 0.0:
            raise ConfigError(STANDING_ONLY)
        self._since, self._furthest = 0.0, 0.0
        self._enter(JumpPhase.REST)

    def step(self, observation: Observation) -> Command:
        torque_1, torque_2 = observation.spring_torque.tolist()
        motor_1, motor_2 = observation.motor_pos.tolist()
        torque = self._scale * (torque_2 - torque_1)
        fold = self._scale * (motor_2 - motor_1) - torque / self._stiffness
        towards = self._apex * fold
        if towards > self._furthest:
            self._furthest = towards
        holds = self._sense * (-torque / self._standing - self._load) > 0.0
        if not holds:
            self._since = observation.time
        if self._furthest - towards > self._turn or (
            holds and observation.time - self._since >= self._dwell
        ):
            self._since = observation.time
            self._enter(self._next)
            self._furthest = self._apex * fold
        return self._command

    def _enter(self, phase: JumpPhase) -> None:
        leave = self._exits[phase]
        self._next, self._apex, self._sense = leave.to, leave.apex, leave.sense
        self._load, self._dwell = leave.load, leave.dwell
        self._command = self._commands[phase]


def _fixed(motor_pos: Floats, phase: JumpPhase) -> Command:
    """A command that is given again and again, so that nobody may write into it."""
    held, code = motor_pos.copy(), np.array(phase, dtype=np.int64)
    held.setflags(write=False)
    code.setflags(write=False)
    return Command(motor_pos=held, phase=code)


@final
class _Batch:
    """Law of many legs in arrays, one row for each leg."""

    def __init__(
        self,
        configs: Sequence[JumpConfig],
        targets: LegTargets,
        folded: Floats,
        stretched: Floats,
    ) -> None:
        """Prepare for one set of settings for all legs, or one for each."""
        self._targets = targets
        self._turn = np.array([config.apex_turn for config in configs])
        self._folded, self._stretched = folded, stretched
        self._stiffness = targets.modal_stiffness()
        ends = [phase_exits(config) for config in configs]
        self._rows = np.arange(len(ends)) if len(ends) > 1 else 0
        self._next_of = _by_phase(ends, lambda leave: leave.to).astype(np.int64)
        self._apex_of = _by_phase(ends, lambda leave: leave.apex)
        self._sense_of = _by_phase(ends, lambda leave: leave.sense)
        self._load_of = _by_phase(ends, lambda leave: leave.load)
        self._dwell_of = _by_phase(ends, lambda leave: leave.dwell)
        self._standing: Floats = np.ones(folded.shape[:-1])
        self.errors: dict[int, Exception] = {}
        self._begin()

    def reset(self, observation: Observation) -> None:
        standing = -self._targets.radial(observation.spring_torque)
        stands = standing > 0.0
        lying = np.flatnonzero(~stands).tolist()
        self.errors = {leg: ConfigError(STANDING_ONLY) for leg in lying}
        self._standing = np.where(stands, standing, 1.0)
        self._begin()

    def _begin(self) -> None:
        self._since: Floats = np.zeros(self._standing.shape)
        self._furthest: Floats = np.zeros(self._standing.shape)
        self._enter(np.full(self._standing.shape, JumpPhase.REST, dtype=np.int64))

    def step(self, observation: Observation) -> Command:
        torque = self._targets.radial(observation.spring_torque)
        fold = self._targets.radial(observation.motor_pos) - torque / self._stiffness
        towards = self._apex * fold
        self._furthest = np.maximum(self._furthest, towards)
        at_apex = self._furthest - towards > self._turn
        holds = self._sense * (-torque / self._standing - self._load) > 0.0
        self._since = np.where(holds, self._since, observation.time)
        leaving = at_apex | (holds & (observation.time - self._since >= self._dwell))
        if np.count_nonzero(leaving):
            self._since = np.where(leaving, observation.time, self._since)
            self._enter(np.where(leaving, self._next_of[self._rows, self._phase], self._phase))
            self._furthest = np.where(leaving, self._apex * fold, self._furthest)
        return self._command

    def _enter(self, phase: Ints) -> None:
        """Look up what ends each leg's phase, and make the command that goes with it."""
        self._phase = phase
        place = self._rows, phase
        self._apex, self._dwell = self._apex_of[place], self._dwell_of[place]
        self._sense, self._load = self._sense_of[place], self._load_of[place]
        pushing = (phase == JumpPhase.PUSH)[..., np.newaxis]
        motor_pos = np.where(pushing, self._stretched, self._folded)
        self._command = Command(motor_pos=motor_pos, phase=phase)


def _by_phase(
    ends: Sequence[dict[JumpPhase, PhaseExit]], value: Callable[[PhaseExit], float]
) -> Floats:
    """Value by settings and phase, as an array (settings, phases) to be indexed with both."""
    table = np.zeros((len(ends), max(JumpPhase) + 1))
    for row, exits in enumerate(ends):
        for phase, leave in exits.items():
            table[row, phase] = value(leave)
    return table
