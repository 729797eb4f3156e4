"""Causes: imperfections that one number grows, by name, with sizes that are plausible and possible.

The sizes that are plausible are those of a leg that was built and set up with care: Table III was
"only roughly verified" for centres of mass, inertias come from CAD, and springs and dampers of the
two joints were identified one by one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Final

from legbench.errors import ConfigError
from legbench.imperfections import Imperfections

Pattern = tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Cause:
    """One imperfection, or several of a leg that grow together, with a size.

    Raises:
        ConfigError: bounds that do not hold zero, or a plausible size beyond them.
    """

    name: str
    """Name in flags and files."""
    words: str
    """Noun phrase for sentences, in which a positive size makes sense."""
    field: str
    """Field of `Imperfections` that it changes."""
    pattern: Pattern
    """Change of each component of that field per unit of size."""
    unit: str
    """Unit of the size; empty for a share."""
    plausible: float
    """Size that a leg built with care may have, either sign if negative sizes make sense."""
    low: float
    """Smallest size that is tried."""
    high: float
    """Largest size that is tried."""
    mirrored: Pattern | None = None
    """Pattern per unit of -size below zero, where the sign chooses the joint."""
    sampled: bool = False
    """Whether it acts on the motors cycle by cycle, which takes ten times as long to compute."""

    def __post_init__(self) -> None:
        if not self.low <= 0.0 < self.high or not 0.0 < self.plausible <= self.high:
            raise ConfigError(
                f"cause {self.name} has sizes {self.low:g} to {self.high:g}, {self.plausible:g} "
                "being plausible; they must hold zero and the plausible one"
            )

    @property
    def signed(self) -> bool:
        """Whether negative sizes make sense."""
        return self.low < 0.0

    @property
    def whole(self) -> bool:
        """Whether sizes are whole numbers."""
        return self.field in WHOLE

    def change(self, size: float) -> Pattern:
        """Change of each component of the field at a size."""
        if size < 0.0 and self.mirrored is not None:
            return tuple(-size * each for each in self.mirrored)
        return tuple(size * each for each in self.pattern)

    def shown(self, size: float) -> str:
        """Size in the unit of a workshop."""
        factor, unit = SHOWN[self.unit]
        return f"{factor * size:+.3g} {unit}" if self.signed else f"{factor * size:.3g} {unit}"


SHOWN: Final = {
    "": (100.0, "%"),
    "rad": (1e3, "mrad"),
    "m": (1e3, "mm"),
    "N m": (1e3, "mN m"),
    "N s/m": (1.0, "N s/m"),
    "cycles": (1.0, "ms"),
    "s/rad": (1e3, "ms/rad"),
}
"""Unit of a size -> factor and unit in which it is told."""
WHOLE: Final = ("motor_delay_cycles",)
"""Fields that hold whole numbers."""
SLOWNESS: Final = "motor_slew_rate"
"""Field that holds the inverse of a size: a motor that is no slower has no limit."""
SCALARS: Final = ("trunk_mass_error",)
"""Fields that hold one number."""


def _share(
    name: str, words: str, field: str, pattern: Pattern, plausible: float, low: float, high: float
) -> Cause:
    return Cause(
        name=name,
        words=words,
        field=field,
        pattern=pattern,
        unit="",
        plausible=plausible,
        low=low,
        high=high,
    )


def _zero(name: str, words: str, field: str, pattern: Pattern) -> Cause:
    return Cause(
        name=name,
        words=words,
        field=field,
        pattern=pattern,
        unit="rad",
        plausible=0.02,
        low=-0.08,
        high=0.08,
    )


def _com(segment: str, place: int, reach: float) -> Cause:
    return Cause(
        name=f"{segment}-com",
        words=f"a centre of mass farther down the {segment}",
        field="com_error",
        pattern=_unit(place),
        unit="m",
        plausible=0.003,
        low=-reach,
        high=reach,
    )


def _inertia(segment: str, place: int) -> Cause:
    return _share(
        f"{segment}-inertia",
        f"more inertia of the {segment}",
        "inertia_error",
        _unit(place),
        0.2,
        -0.6,
        0.6,
    )


def _unit(place: int) -> Pattern:
    return tuple(1.0 if each == place else 0.0 for each in range(3))


CAUSES: Final = {
    cause.name: cause
    for cause in (
        _share("stiffness-apart", "a spring 2 that is stiffer than spring 1", "stiffness_error",
               (-0.5, 0.5), 0.04, -0.3, 0.3),
        _share("stiffness", "stiffer springs", "stiffness_error", (1.0, 1.0), 0.05, -0.2, 0.3),
        _share("damping-apart", "more damping of q2 than of q1", "damping_error",
               (-0.5, 0.5), 0.3, -1.8, 1.8),
        _share("damping", "more damping of both joints", "damping_error", (1.0, 1.0), 0.3,
               -0.9, 3.0),
        _share("trunk-mass", "a heavier trunk", "trunk_mass_error", (1.0,), 0.03, -0.3, 0.3),
        _share("leg-mass", "heavier segments", "mass_error", (1.0, 1.0, 1.0), 0.03, -0.2, 0.2),
        _com("thigh", 0, 0.009),
        _com("shank", 1, 0.03),
        _com("foot", 2, 0.009),
        _inertia("thigh", 0),
        _inertia("shank", 1),
        _inertia("foot", 2),
        _zero("link-zero-polar", "a zero error of the link encoders along z1", "link_zero",
              (1.0, 1.0)),
        _zero("link-zero-radial", "a zero error of the link encoders along z2", "link_zero",
              (-1.0, 1.0)),
        _zero("motor-zero-polar", "a zero error of the motors along z1", "motor_zero",
              (1.0, 1.0)),
        _zero("motor-zero-radial", "a zero error of the motors along z2", "motor_zero",
              (-1.0, 1.0)),
        Cause(name="friction", words="dry friction in both joints", field="coulomb_friction",
              pattern=(1.0, 1.0), unit="N m", plausible=0.003, low=0.0, high=0.03),
        Cause(name="friction-apart", words="dry friction in one joint, q2", unit="N m",
              field="coulomb_friction", pattern=(0.0, 1.0), mirrored=(1.0, 0.0),
              plausible=0.005, low=-0.04, high=0.04),
        Cause(name="guide-forward", words="a guide that brakes the trunk forward", unit="N s/m",
              field="guide_damping", pattern=(1.0, 0.0), plausible=0.2, low=0.0, high=3.0),
        Cause(name="guide-upward", words="a guide that brakes the trunk upward", unit="N s/m",
              field="guide_damping", pattern=(0.0, 1.0), plausible=0.2, low=0.0, high=2.0),
        Cause(name="backlash", words="play in both gears", unit="rad", field="backlash",
              pattern=(1.0, 1.0), plausible=0.01, low=0.0, high=0.06, sampled=True),
        Cause(name="backlash-apart", words="play in one gear, of motor 2", unit="rad",
              field="backlash", pattern=(0.0, 1.0), mirrored=(1.0, 0.0), plausible=0.01,
              low=-0.06, high=0.06, sampled=True),
        Cause(name="delay-apart", words="a motor 2 that reacts later than motor 1", unit="cycles",
              field="motor_delay_cycles", pattern=(0.0, 1.0), mirrored=(1.0, 0.0),
              plausible=3.0, low=-20.0, high=20.0, sampled=True),
        Cause(name="slew-apart", words="a motor 2 that turns more slowly than motor 1",
              unit="s/rad", field="motor_slew_rate", pattern=(0.0, 1.0), mirrored=(1.0, 0.0),
              plausible=0.05, low=-0.3, high=0.3, sampled=True),
    )
}  # fmt: skip
"""Name -> cause."""


def causes_named(names: Sequence[str] | None) -> tuple[Cause, ...]:
    """Causes by name, all of them if none is named.

    Raises:
        ConfigError: there is no such cause; the nearest are told.
    """
    for name in names or ():
        if name not in CAUSES:
            near = get_close_matches(name, CAUSES, n=1, cutoff=0.4)
            hint = f"did you mean {near[0]}? " if near else ""
            raise ConfigError(f"no cause '{name}'; {hint}there are {', '.join(CAUSES)}")
    return tuple(CAUSES[name] for name in dict.fromkeys(names or CAUSES))


def combined(causes: Sequence[Cause], sizes: Sequence[float]) -> Imperfections:
    """Imperfections of a leg that has all of some causes, each with its size.

    Causes that change the same field add up.

    Raises:
        ConfigError: no leg can have them together.
    """
    changes: dict[str, Pattern] = {}
    for cause, size in zip(causes, sizes, strict=True):
        change = cause.change(float(size))
        before = changes.get(cause.field, (0.0,) * len(change))
        changes[cause.field] = tuple(a + b for a, b in zip(before, change, strict=True))
    return Imperfections(
        **{name: _value(name, change) for name, change in changes.items() if any(change)}
    )


def _value(name: str, change: Pattern) -> Any:
    """Value of a field of `Imperfections` with these changes of its components."""
    if name in SCALARS:
        return change[0]
    if name in WHOLE:
        return tuple(round(each) for each in change)
    if name == SLOWNESS:
        return tuple(1.0 / each if each > 0.0 else UNLIMITED for each in change)
    return change


UNLIMITED: Final = 1e6
"""Speed of a motor that has no limit [rad/s]; the field has one for each motor or none at all."""
