"""Parameters of a leg that its recordings can show, and how a fit sees them.

Only nine combinations of inertia, stiffness and gravity appear in the equations of motion; masses,
centres of mass and inertias of single segments do not. The inertial ones are those about the hip:
a pinned foot changes them by the mass of the whole leg, which is known from weighing.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from legbench.errors import ConfigError


@dataclass(frozen=True, slots=True, kw_only=True)
class FitParameter:
    """One parameter: its name, unit, and the scale on which a fit moves it."""

    name: str
    unit: str
    doc: str
    scale: float = 0.0
    """Typical change [unit]; zero: the parameter is positive and is fitted as its logarithm."""

    @property
    def positive(self) -> bool:
        """Whether its logarithm is fitted, so that it stays positive."""
        return self.scale == 0.0


NINE: Final = (
    FitParameter(name="J1", unit="kg m^2", doc="inertia of all that turns with q1 about the hip"),
    FitParameter(name="J2", unit="kg m^2", doc="inertia of all that turns with q2 about the hip"),
    FitParameter(name="B", unit="kg m^2", doc="coupling of the two inertias"),
    FitParameter(name="s1", unit="kg m", doc="first moment about the hip along q1"),
    FitParameter(name="s2", unit="kg m", doc="first moment about the hip along q2"),
    FitParameter(name="k1", unit="N m/rad", doc="stiffness of the spring on q1"),
    FitParameter(name="k2", unit="N m/rad", doc="stiffness of the spring on q2"),
    FitParameter(name="d1", unit="N m s/rad", doc="viscous damping of q1"),
    FitParameter(name="d2", unit="N m s/rad", doc="viscous damping of q2"),
)
"""Combinations of inertia, stiffness and damping in the equations of motion."""
OTHERS: Final = (
    FitParameter(name="mass", unit="kg", doc="mass of the whole leg with its trunk"),
    FitParameter(name="f1", unit="N m", doc="Coulomb friction of q1", scale=1e-2),
    FitParameter(name="f2", unit="N m", doc="Coulomb friction of q2", scale=1e-2),
    FitParameter(name="link_zero1", unit="rad", doc="zero error of link encoder 1", scale=1e-2),
    FitParameter(name="link_zero2", unit="rad", doc="zero error of link encoder 2", scale=1e-2),
    FitParameter(name="motor_zero1", unit="rad", doc="zero error of motor encoder 1", scale=1e-2),
    FitParameter(name="motor_zero2", unit="rad", doc="zero error of motor encoder 2", scale=1e-2),
    FitParameter(name="delay", unit="s", doc="lateness of the link encoders", scale=1e-3),
    FitParameter(name="time_base", unit="-", doc="true time over recorded time"),
)
"""What else a recording can show."""
PARAMETERS: Final = {each.name: each for each in (*NINE, *OTHERS)}
"""Every parameter of a leg by its name."""
INDEX: Final = {name: place for place, name in enumerate(PARAMETERS)}
"""Place of a parameter in an array of all of them."""
GROUPS: Final[dict[str, tuple[str, ...]]] = {
    "springs": ("k1", "k2"),
    "dampers": ("d1", "d2"),
    "inertia": ("J1", "J2", "B", "s1", "s2"),
    "nine": tuple(each.name for each in NINE),
    "friction": ("f1", "f2"),
    "link_zero": ("link_zero1", "link_zero2"),
    "motor_zero": ("motor_zero1", "motor_zero2"),
}
"""Words for several parameters."""
USUAL: Final[tuple[str, ...]] = ("k1", "k2", "d1", "d2")
"""Parameters that are free unless others are named."""
SEGMENTS: Final[tuple[str, ...]] = ("m1", "m2", "m3", "c1", "c2", "c3", "I1", "I2", "I3", "mt")
"""Names of quantities of single segments, which no recording of the joints shows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Freedom:
    """What a fit may change."""

    names: tuple[str, ...] = USUAL
    """Free parameters of the leg, in the order of `PARAMETERS`."""
    start: bool = True
    """Whether the posture of each run's first row is free, too; if not, it is the rest posture.
    Rates are free in runs that begin in motion alone."""


def parse_free(words: Sequence[str], *, start: bool = True) -> Freedom:
    """Read names of parameters and of groups of them.

    Args:
        words: the names.
        start: whether the posture of each run's first row is free, too.

    Raises:
        ConfigError: a name that no parameter has, or one of a single segment.
    """
    chosen: set[str] = set()
    for word in words:
        if word in SEGMENTS:
            raise ConfigError(
                f"{word} cannot be identified: joint angles show nine combinations of the "
                f"segments alone; free {', '.join(GROUPS['inertia'])} instead, and masses and "
                "centres of mass are written back as the smallest change of the design"
            )
        if word not in PARAMETERS and word not in GROUPS:
            known = ", ".join([*PARAMETERS, *GROUPS])
            raise ConfigError(f"no parameter is called '{word}'; there are {known}")
        chosen |= set(GROUPS.get(word, (word,)))
    names = tuple(name for name in PARAMETERS if name in chosen)
    if not names:
        raise ConfigError("no parameter is free; name some, such as --free k1 k2 d1 d2")
    return Freedom(names=names, start=start)


def steps_of(name: str, value: float) -> float:
    """Derivative of a parameter by the number that a fit moves, at a value."""
    parameter = PARAMETERS[name]
    return value if parameter.positive else parameter.scale


def moved(name: str, value: float, step: float) -> float:
    """Value of a parameter after a fit's step: a factor for a positive one."""
    parameter = PARAMETERS[name]
    return value * math.exp(step) if parameter.positive else value + step * parameter.scale
