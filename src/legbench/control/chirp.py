"""Chirp of one coordinate about a set point: excites the leg over a band of frequencies."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from functools import partial
from typing import ClassVar, Final, final

import numpy as np

from legbench.choices import choose
from legbench.control.abstract import AbstractController
from legbench.control.per_leg import check_delays, each_config, setting
from legbench.control.setpoint import LegTargets
from legbench.design import LegDesign
from legbench.design.setup import SetupKind
from legbench.errors import ConfigError, DesignError
from legbench.kinematics import ModalConvention, modal_to_joint
from legbench.phases import ControllerDescription, Counting, PhaseInfo, Role
from legbench.signals import Command, Floats, Observation

FASTEST: Final = 250.0
"""Highest frequency of a chirp [Hz]: four commands a period at a control period of 1 ms."""


class ChirpCoordinate(StrEnum):
    """Coordinate in which the motors are moved."""

    Q1 = "q1"
    """Motor of the thigh alone."""
    Q2 = "q2"
    """Motor of the shank alone."""
    Z1 = "z1"
    """Polar coordinate: both motors alike."""
    Z2 = "z2"
    """Radial coordinate: both motors opposed."""


class ChirpWave(StrEnum):
    """Shape of the wave."""

    SINE = "sine"
    """Sine, which concentrates the motion at one frequency at a time."""
    SQUARE = "square"
    """Square wave: steps between both ends of the amplitude."""


class ChirpPhase(IntEnum):
    """Phases of a chirp, as recorded."""

    REST = 0
    """Equilibrium at the set point, before the sweep."""
    SWEEP = 1
    """The motors follow the wave."""
    SETTLE = 2
    """Equilibrium at the set point, after the sweep."""


PHASES = (
    PhaseInfo(code=ChirpPhase.REST, name="rest", role=Role.REST, doc="before the sweep"),
    PhaseInfo(
        code=ChirpPhase.SWEEP, name="sweep", role=Role.ACTING, doc="the motors follow the wave"
    ),
    PhaseInfo(
        code=ChirpPhase.SETTLE,
        name="settle",
        role=Role.ACTING,
        doc="the equilibrium is back at the set point",
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ChirpConfig:
    """Wave of the equilibrium whose frequency rises or falls steadily from f0 to f1."""

    kind: ClassVar[str] = "chirp"
    usual_setup: ClassVar[SetupKind] = SetupKind.FFS
    batched: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("motor_pos",)
    coordinate: ChirpCoordinate = ChirpCoordinate.Q1
    """Coordinate in which the motors are moved: q1, q2, z1 or z2."""
    wave: ChirpWave = ChirpWave.SINE
    """Shape of the wave: sine, or square for steps."""
    z2: float = 1.0
    """Set point about which the motors are moved [rad]."""
    amplitude: float = 0.1
    """Largest deflection of the coordinate from the set point [rad]."""
    f0: float = 1.0
    """Frequency at the beginning of the sweep [Hz]."""
    f1: float = 12.0
    """Frequency at its end [Hz]."""
    sweep: float = 2.9
    """Duration of the sweep, after which the set point is held [s]."""
    delay: float = 0.1
    """Time at rest before the sweep [s]."""

    def __post_init__(self) -> None:
        choose(self, coordinate=ChirpCoordinate, wave=ChirpWave)

    def build(self, targets: LegTargets) -> AbstractController:
        """Make the controller for these legs; raises ConfigError where they refuse the settings."""
        return Chirp(self, targets)

    @classmethod
    def build_each(
        cls, settings: "Sequence[ChirpConfig]", targets: LegTargets
    ) -> AbstractController:
        """Make the controller of a batch whose legs have settings of their own."""
        return Chirp(settings, targets)

    def describe(self) -> ControllerDescription:
        """Return its phases, and that no period of a forced motion counts in a rating."""
        return ControllerDescription(phases=PHASES, counting=Counting(most=0))


@final
class Chirp(AbstractController):
    """Motors moved by `a sin(2 pi (f0 t + (f1 - f0) t^2 / 2 T))` about a set point.

    Raises:
        ConfigError: a set point or an amplitude that the leg cannot reach, or frequencies, a
            sweep or a delay that make no sense.
    """

    def __init__(self, config: ChirpConfig | Sequence[ChirpConfig], targets: LegTargets) -> None:
        """Prepare for the legs of `targets`, all with the same settings or each with its own."""
        for each in each_config(config):
            _check(each)
        check_delays(config)
        of = partial(setting, config)
        self._base = targets.motor_at(of("z2"), "z2")
        self._reach = _reach(config, targets.convention)
        _check_ends(targets, self._base, self._reach)
        self._f0, self._sweep, self._delay = of("f0"), of("sweep"), of("delay")
        self._rise = 0.5 * (of("f1") - self._f0) / self._sweep
        square = [each.wave is ChirpWave.SQUARE for each in each_config(config)]
        self._square = np.array(square) if isinstance(config, Sequence) else square[0]
        self._first, self._last = float(np.min(self._delay)), self._delay + self._sweep
        shape = self._base.shape[:-1]
        self._rest = Command.holding(self._base)
        settled = np.full(shape, ChirpPhase.SETTLE, dtype=np.int64)
        self._settled = Command(motor_pos=self._base, phase=settled)

    @property
    def start_motor_pos(self) -> Floats:
        """Equilibrium at the set point."""
        return self._base

    def reset(self, observation: Observation) -> None:
        """Begin anew, for which there is nothing to forget."""

    def step(self, observation: Observation) -> Command:
        """Command the wave's value at the present time."""
        now = observation.time
        if now < self._first:
            return self._rest
        if now >= float(np.max(self._last)):
            return self._settled
        elapsed = now - self._delay
        turns = (self._f0 + self._rise * elapsed) * elapsed
        wave = np.sin(2.0 * math.pi * turns)
        wave = np.where(self._square, np.where(wave < 0.0, -1.0, 1.0), wave)
        rests, over = np.less(now, self._delay), np.greater_equal(now, self._last)
        wave = np.where(rests | over, 0.0, wave)
        phase = np.where(
            rests, ChirpPhase.REST, np.where(over, ChirpPhase.SETTLE, ChirpPhase.SWEEP)
        )
        return Command(
            motor_pos=self._base + wave[..., np.newaxis] * self._reach,
            phase=np.broadcast_to(phase, self._base.shape[:-1]).astype(np.int64),
        )


def _reach(config: ChirpConfig | Sequence[ChirpConfig], convention: ModalConvention) -> Floats:
    """Deflection of the motors at the top of the wave, (2,) or one a leg (n, 2) [rad]."""
    ways = np.array([_way(each, convention) for each in each_config(config)])
    return ways if isinstance(config, Sequence) else ways[0]


def _way(config: ChirpConfig, convention: ModalConvention) -> Floats:
    unit = np.array([1.0, 0.0] if config.coordinate in ("q1", "z1") else [0.0, 1.0])
    modal = config.coordinate in (ChirpCoordinate.Z1, ChirpCoordinate.Z2)
    return config.amplitude * (modal_to_joint(unit, convention) if modal else unit)


def _check(config: ChirpConfig) -> None:
    """Refuse settings that make no sense on any leg."""
    if not 0.0 < config.amplitude < math.pi:
        raise ConfigError(
            f"amplitude is {config.amplitude:g} rad; it must be positive and below pi"
        )
    for name, value in (("f0", config.f0), ("f1", config.f1)):
        if not 0.0 < value <= FASTEST:
            raise ConfigError(
                f"{name} is {value:g} Hz; it must be positive and at most {FASTEST:g} Hz"
            )
    if not 0.0 < config.sweep < math.inf:
        raise ConfigError(f"sweep is {config.sweep:g} s; it must be positive and finite")


def _check_ends(targets: LegTargets, base: Floats, reach: Floats) -> None:
    """Refuse an amplitude at whose ends a leg cannot rest within its joint limits."""
    designs = [targets.designs] if isinstance(targets.designs, LegDesign) else targets.designs
    bases, ways = (np.broadcast_to(each, (len(designs), 2)) for each in (base, reach))
    for one, design, middle, way in zip(targets.each(), designs, bases, ways, strict=True):
        for end in (middle - way, middle + way):
            try:
                link = one.link_at_rest(end)
            except DesignError as error:
                raise ConfigError(f"amplitude: {error}; lower it") from None
            for joint, angle, (low, high) in (
                ("knee", float(link[1] - link[0]), design.limits.knee),
                ("hip", float(link[0]), design.limits.hip),
            ):
                if not low <= angle <= high:
                    raise ConfigError(
                        f"amplitude puts the {joint} at {angle:.3f} rad; design '{design.name}' "
                        f"allows {low:g} to {high:g} rad: lower it"
                    )
