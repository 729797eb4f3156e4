"""Step and bars that suit a leg: both scale with what is light in it and stiff about it.

The joint equality of the linkage carries the foot with a softness of one step, so what a leg loses
of its mode grows with the square of step times the frequency at which its springs would swing the
foot alone. Bars are to weigh little against the segments that they run along.
"""

import math
from collections.abc import Sequence
from typing import Final

from legbench.design import LegDesign
from legbench.errors import ConfigError

STEP: Final = 0.00025
"""Longest step that is taken by itself [s]: the one of the paper's legs."""
SWING_PER_STEP: Final = 1.0 / 16.0
"""Largest swing of a foot on the springs in one step [rad]. The paper's legs have 0.044 to 0.052; of
random feasible legs with a fixed foot those above 0.08 leave the mode by more than 1e-6 rad a
second, those at 1/16 by less than 9e-7."""
FINEST: Final = 16
"""Largest number of parts that `STEP` is divided into: 64 steps a control period."""
BAR_SHARE: Final = 1.0 / 60.0
"""Largest mass per length of a bar, as a share of the lightest segment's [-]; the bars of the
paper's legs have 1/72."""
HEAVIEST_BAR: Final = 0.006
"""Mass per length of the paper's bars [kg/m]: a square PA6 rod of 2.3 mm."""
LIGHTEST_BAR: Final = 5e-4
"""Lighter bars make the loop's equations too stiff for the time step [kg/m]."""


def foot_omega(design: LegDesign) -> float:
    """Frequency at which the stiffer spring would swing the foot alone about its ankle [rad/s]."""
    foot = design.foot
    return math.sqrt(max(design.stiffness) / (foot.inertia + foot.mass * foot.com**2))


def fitted_step(designs: Sequence[LegDesign]) -> float:
    """Longest step at which all of some legs keep their mode, a whole part of `STEP` [s].

    Raises:
        ConfigError: a leg whose foot is so light, or whose springs are so stiff, that the finest
            step would be too long.
    """
    worst = max(designs, key=foot_omega)
    parts = foot_omega(worst) * STEP / SWING_PER_STEP
    if parts > FINEST:
        raise ConfigError(
            f"design '{worst.name}': springs of {max(worst.stiffness):g} N m/rad would swing its "
            f"foot of {worst.foot.mass:g} kg at {foot_omega(worst):.4g} rad/s; up to "
            f"{FINEST * SWING_PER_STEP / STEP:g} rad/s a step of {STEP / FINEST:g} s follows: take "
            "softer springs or a heavier foot, or set numerics.timestep and mind the energy residual"
        )
    return STEP / max(1, math.ceil(parts))


def fitted_bar_density(design: LegDesign) -> float:
    """Mass per length of bars that suit a leg, at most the paper's [kg/m].

    Raises:
        ConfigError: a segment so light that bars of a fitting mass cannot be simulated.
    """
    name, lightest = min(
        (
            (name, segment.mass / segment.length)
            for name, segment in zip(("thigh", "shank", "foot"), design.segments, strict=True)
        ),
        key=lambda each: each[1],
    )
    density = min(HEAVIEST_BAR, BAR_SHARE * lightest)
    if density < LIGHTEST_BAR:
        raise ConfigError(
            f"design '{design.name}': its {name} weighs {lightest:g} kg/m and would take bars of "
            f"{density:.2g} kg/m; from {LIGHTEST_BAR:g} kg/m on the loops can be integrated: set "
            "linkage.bar_density to what the bars weigh, or take linkage 'reduced'"
        )
    return density
