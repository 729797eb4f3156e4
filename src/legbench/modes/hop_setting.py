"""Compiled leg and control law at one value of a setting."""

from dataclasses import replace

from legbench.analytic import LegModel
from legbench.analytic.taylor import TaylorLeg
from legbench.control import JumpConfig
from legbench.design import LegDesign
from legbench.errors import ConfigError
from legbench.modes.drive import JumpLaw
from legbench.modes.settings import Setting


def tools_at(
    design: LegDesign,
    jump: JumpConfig,
    setting: Setting,
    value: float,
    same: TaylorLeg | None = None,
) -> tuple[TaylorLeg, JumpLaw]:
    """Compiled leg and its control law with a setting at some value.

    A setting of the controller does not change the leg, so that `same` is used again.

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
