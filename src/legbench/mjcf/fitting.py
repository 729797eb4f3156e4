"""Step and bars that suit a leg: both scale with what is light in it and stiff about it.

The linkage carries foot and bars with a softness of one step, so what a leg loses of its mode grows
with the square of step times the frequency at which its springs would swing them alone. Bars are to
weigh little against the segments that they run along.
"""

import math
from typing import Final

from legbench.design import LegDesign
from legbench.errors import ConfigError

STEP: Final = 0.00025
"""Longest step that is taken by itself [s]: the one of the paper's legs."""
SWING_PER_STEP: Final = 1.0 / 16.0
"""Largest swing of a foot on the springs in one step [rad]. The paper's legs have 0.044 to 0.052.
With 0.25 ms for all, four of twenty random feasible legs leave the mode by 1.1e-6 to 2.9e-6 rad in
a second with the foot fixed, all of them above 0.11; with this bound the worst does by 9e-7."""
BAR_SWING_PER_STEP: Final = 1.5
"""Largest swing in one step of crank and thigh bar on spring 2, if no leg held them [rad]. The
paper's legs have 0.92 to 1.07. What the solver adds to the motion of light bars grows with its
square; at the bound it is some 2e-4 rad in a second, a tenth of what the paper's bars add by their
mass."""
PARTS: Final = (1, 2, 4, 5, 8, 10, 16)
"""Numbers of parts that `STEP` is divided into, up to 64 steps a control period: those whose step
MJCF, which prints six digits, holds exactly."""
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


def bar_omega(design: LegDesign, density: float, crank_length: float) -> float:
    """Frequency at which spring 2 would swing crank and thigh bar without the leg [rad/s].

    Args:
        design: the leg.
        density: mass per length of crank and bar [kg/m].
        crank_length: length of the crank [m].
    """
    inertia = density * crank_length**2 * (crank_length / 3.0 + design.thigh.length)
    return math.sqrt(design.stiffness[1] / inertia)


def parts_of_step(
    design: LegDesign, density: float | None = None, crank_length: float = 0.0
) -> float:
    """Number of parts into which `STEP` is to be divided for a leg; below one it is short enough.

    Args:
        design: the leg.
        density: mass per length of its bars; none: it has no bars [kg/m].
        crank_length: length of the crank of its bars [m].
    """
    parts = foot_omega(design) * STEP / SWING_PER_STEP
    if density is None:
        return parts
    return max(parts, bar_omega(design, density, crank_length) * STEP / BAR_SWING_PER_STEP)


def step_in_parts(parts: float, name: str) -> float:
    """Longest whole part of `STEP` that is not longer than one of `parts` parts of it [s].

    Args:
        parts: number of parts, as `parts_of_step` says.
        name: name of the design, for the message.

    Raises:
        ConfigError: the finest step would be too long.
    """
    enough = next((each for each in PARTS if each >= parts), None)
    if enough is None:
        raise ConfigError(
            f"design '{name}': springs so stiff on a foot or bars so light ask for a step of "
            f"{STEP / parts:.2g} s; down to {STEP / PARTS[-1]:g} s it is chosen by itself: take "
            "softer springs, a heavier foot or heavier bars, or set numerics.timestep and mind the "
            "energy residual"
        )
    return STEP / enough


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
