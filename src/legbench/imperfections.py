"""What a leg, its encoders and its motors have that its controller does not know of."""

import math
from dataclasses import dataclass, fields, replace
from typing import Any, Final

from legbench.design import LegDesign, Segment
from legbench.errors import ConfigError, DesignError

MAX_DELAY_CYCLES: Final = 1000
"""Largest delay of a motor, one second: one that reacts later is broken, not slow."""

Pair = tuple[float, float]
Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Imperfections:
    """Imperfections of a leg against the design that its controller believes.

    Pairs belong to q1 and q2, or to the motors on them; triples to thigh, shank and foot. What is
    not given is perfect, and no part of an experiment's name. Noise comes from the experiment's
    seed alone, so that experiments that differ in anything else share it.

    Raises:
        ConfigError: a value that no leg, encoder or motor can have.
    """

    stiffness_error: Pair | None = None
    """Share by which the springs are stiffer than the design says [-]."""
    damping_error: Pair | None = None
    """Share by which the joints are damped more than the design says [-]."""
    trunk_mass_error: float | None = None
    """Share by which the trunk is heavier than the design says [-]."""
    mass_error: Triple | None = None
    """Share by which the segments are heavier than the design says [-]."""
    com_error: Triple | None = None
    """Distance by which the centres of mass lie farther from the proximal joint [m]."""
    inertia_error: Triple | None = None
    """Share by which the segments' inertias are larger than the design says [-]."""
    coulomb_friction: Pair | None = None
    """Coulomb friction on q1 and q2 [N m]."""
    backlash: Pair | None = None
    """Play between each motor and its spring, from flank to flank [rad]."""
    guide_damping: Pair | None = None
    """Viscous damping of the trunk's guide, forward and upward, in ffs [N s/m]."""
    link_zero: Pair | None = None
    """Angle that the link encoders show at zero [rad]."""
    motor_zero: Pair | None = None
    """Angle of the motors where their encoders show zero [rad]."""
    link_noise: Pair | None = None
    """Standard deviation of white noise on the link encoders [rad]."""
    motor_noise: Pair | None = None
    """Standard deviation of white noise on the motor encoders [rad]."""
    motor_slew_rate: Pair | None = None
    """Highest speed of each motor [rad/s]."""
    motor_delay_cycles: tuple[int, int] | None = None
    """Number of cycles that each motor reacts late, beside the servo's own delay."""
    motor_range: tuple[Pair, Pair] | None = None
    """Range of each motor, in positions that its encoder shows [rad]."""

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            for number in _numbers(value):
                if not math.isfinite(number):
                    raise ConfigError(f"{entry.name} is {value}; it must be finite")
        for name, (least, unit) in _LEAST.items():
            value = getattr(self, name)
            if value is not None and min(_numbers(value)) < least:
                raise ConfigError(f"{name} is {value}{unit}; it must be {least:g} or more")
        for name in ("stiffness_error", "trunk_mass_error", "mass_error", "inertia_error"):
            value = getattr(self, name)
            if value is not None and min(_numbers(value)) <= -1.0:
                raise ConfigError(f"{name} is {value}; more than -1 leaves something of it")
        if self.motor_slew_rate is not None and min(self.motor_slew_rate) <= 0.0:
            raise ConfigError(
                f"motor_slew_rate is {self.motor_slew_rate} rad/s; it must be positive"
            )
        if self.motor_delay_cycles is not None and max(self.motor_delay_cycles) > MAX_DELAY_CYCLES:
            raise ConfigError(
                f"motor_delay_cycles is {self.motor_delay_cycles}; it must be 0 to "
                f"{MAX_DELAY_CYCLES}"
            )
        for low, high in self.motor_range or ():
            if not low < high:
                raise ConfigError(f"motor_range is [{low:g}, {high:g}] rad; low must be below high")

    @property
    def perfect(self) -> bool:
        """Whether nothing is given."""
        return all(getattr(self, entry.name) is None for entry in fields(self))

    @property
    def beyond_motors(self) -> "Imperfections":
        """What is left for a leg whose motors, and the encoders on them, are modelled elsewhere."""
        return replace(
            self,
            motor_noise=None,
            motor_slew_rate=None,
            motor_delay_cycles=None,
            motor_range=None,
        )

    def leg_of(self, design: LegDesign) -> LegDesign:
        """Leg as it was built, for the design that its controller believes.

        Raises:
            ConfigError: no such leg can be.
        """
        if not self._builds:
            return design
        mass, com = self.mass_error or _NONE, self.com_error or _NONE
        inertia = self.inertia_error or _NONE
        names = ("thigh", "shank", "foot")
        try:
            segments: dict[str, Any] = {
                name: _segment(segment, mass[place], com[place], inertia[place])
                for place, (name, segment) in enumerate(zip(names, design.segments, strict=True))
            }
            return replace(
                design,
                trunk_mass=design.trunk_mass * (1.0 + (self.trunk_mass_error or 0.0)),
                stiffness=_scaled(design.stiffness, self.stiffness_error),
                damping=_scaled(design.damping, self.damping_error),
                **segments,
            )
        except DesignError as error:
            raise ConfigError(f"imperfections leave no leg of '{design.name}': {error}") from None

    @property
    def _builds(self) -> bool:
        """Whether the leg was built otherwise than designed."""
        return any(getattr(self, name) is not None for name in _BUILT)


_NONE: Final = (0.0, 0.0, 0.0)
_BUILT: Final = (
    "stiffness_error",
    "damping_error",
    "trunk_mass_error",
    "mass_error",
    "com_error",
    "inertia_error",
)
_LEAST: Final = {
    "damping_error": (-1.0, ""),
    "coulomb_friction": (0.0, " N m"),
    "backlash": (0.0, " rad"),
    "guide_damping": (0.0, " N s/m"),
    "link_noise": (0.0, " rad"),
    "motor_noise": (0.0, " rad"),
    "motor_delay_cycles": (0, " cycles"),
}
"""Smallest value of each option that has one, and how its unit is written."""


def _numbers(value: object) -> list[float]:
    """All numbers of a value, however they are nested."""
    if value is None:
        return []
    if isinstance(value, tuple):
        return [number for entry in value for number in _numbers(entry)]
    return [float(value)]  # pyrefly: ignore[bad-argument-type]


def _scaled(values: Pair, error: Pair | None) -> Pair:
    if error is None:
        return values
    return values[0] * (1.0 + error[0]), values[1] * (1.0 + error[1])


def _segment(segment: Segment, mass: float, com: float, inertia: float) -> Segment:
    return Segment(
        mass=segment.mass * (1.0 + mass),
        length=segment.length,
        com=segment.com + com,
        inertia=segment.inertia * (1.0 + inertia),
    )
