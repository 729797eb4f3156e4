"""Whether the numerics of a simulated run kept its physics: energy and loops within bounds."""

import math
from dataclasses import dataclass
from enum import StrEnum

LARGEST_RESIDUAL = 0.01
"""Largest energy that may come from or go to nowhere, over the peak kinetic energy [-]. Runs of the
paper's legs stay below 3e-4; a rating to two digits, as the paper prints them, asks for 1 %."""
LARGEST_GAP = 2e-5
"""Widest opening of a bar loop [m]: 1 mrad of a crank of 20 mm. Runs of the paper's legs stay below
1.1e-6 m."""


class Soundness(StrEnum):
    """Verdict on the numerics of a run."""

    SOUND = "sound"
    """Energy residual and loop gap are within bounds."""
    UNSOUND = "unsound"
    """One of them is not: the motion is not that of the leg."""
    UNKNOWN = "unknown"
    """The run shows neither: it has no truth, or too little motion."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """Verdict on the numerics of a run, with its reasons."""

    soundness: Soundness
    reasons: tuple[str, ...] = ()
    """Sentences that say which value exceeds which bound, and what to do."""


def judge_numerics(energy_residual: float, loop_gap_max: float) -> Verdict:
    """Judge a run by its energy residual [-] and its widest loop gap [m]; NaN is unknown."""
    reasons = []
    if energy_residual > LARGEST_RESIDUAL:
        reasons.append(
            f"the numerics made or lost {energy_residual:.3g} of the peak kinetic energy; up to "
            f"{LARGEST_RESIDUAL:g} the motion is taken for the leg's: shorten numerics.timestep"
        )
    if loop_gap_max > LARGEST_GAP:
        reasons.append(
            f"the bar loops open by {1e6 * loop_gap_max:.3g} um; up to {1e6 * LARGEST_GAP:g} um "
            "they count as closed: shorten numerics.timestep, or take heavier bars "
            "(linkage.bar_density)"
        )
    if reasons:
        return Verdict(soundness=Soundness.UNSOUND, reasons=tuple(reasons))
    known = not (math.isnan(energy_residual) and math.isnan(loop_gap_max))
    return Verdict(soundness=Soundness.SOUND if known else Soundness.UNKNOWN)
