"""Settings of controller and leg over which a periodic hop is followed."""

from dataclasses import replace
from enum import StrEnum

from legbench.analytic import LegModel
from legbench.analytic.taylor import TaylorLeg
from legbench.control import JumpConfig
from legbench.design import LegDesign
from legbench.errors import ConfigError
from legbench.modes.drive import JumpLaw


class Setting(StrEnum):
    """Setting over which a hop is followed."""

    Z2 = "z2"
    """Middle of the set points [rad]."""
    DZ2 = "dz2"
    """Amplitude of the push [rad]."""
    DAMPING = "damping"
    """Factor on both dampers [-]; 1 is the design."""
    MISMATCH = "mismatch"
    """Difference of the springs over their mean, `(k1 - k2) / k` [-]."""


SPANS = {Setting.Z2: 0.1, Setting.DZ2: 0.1, Setting.DAMPING: 1.0, Setting.MISMATCH: 0.1}
"""Changes of a setting that count as large."""


def tools_at(
    design: LegDesign,
    jump: JumpConfig,
    setting: Setting,
    value: float,
    same: TaylorLeg | None = None,
) -> tuple[TaylorLeg, JumpLaw]:
    """The leg and its law with a setting at some value; the law knows the leg.

    Settings of the controller leave the leg as it is: `same` is then used again.

    Raises:
        ConfigError: a value that the controller refuses, or no leg can have.
        DesignError: springs that do not carry the leg.
    """
    match setting:
        case Setting.Z2:
            jump = replace(jump, z2=value)
        case Setting.DZ2:
            jump = replace(jump, dz2=value)
        case Setting.DAMPING:
            if not value >= 0.0:
                raise ConfigError(f"damping is {value:g} times the design's; it cannot be negative")
            design = replace(design, damping=(value * design.damping[0], value * design.damping[1]))
        case Setting.MISMATCH:
            if not -2.0 < value < 2.0:
                raise ConfigError(f"mismatch is {value:g}; a spring has no stiffness beyond +-2")
            mean = 0.5 * sum(design.stiffness)
            stiffness = (mean * (1.0 + 0.5 * value), mean * (1.0 - 0.5 * value))
            design = replace(design, stiffness=stiffness)
    law = JumpLaw(jump, design)
    if same is None or setting in (Setting.DAMPING, Setting.MISMATCH):
        same = TaylorLeg(LegModel.of(design), probe=law.probe)
    return same, law


def value_of(design: LegDesign, jump: JumpConfig, setting: Setting) -> float:
    """Present value of a setting."""
    match setting:
        case Setting.Z2:
            return jump.z2
        case Setting.DZ2:
            return jump.dz2
        case Setting.DAMPING:
            return 1.0
        case Setting.MISMATCH:
            first, second = design.stiffness
            return 2.0 * (first - second) / (first + second)
