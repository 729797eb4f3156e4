"""Reports of design and check, as lines of text."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from legbench.design import LegDesign
from legbench.design.matching import Condition
from legbench.design.mending import Mend, mends
from legbench.design.realisable import reaches
from legbench.design.requirements import VARIABLES
from legbench.synthesis.manufacture import Adjusted, ManufactureRow, beyond, shown
from legbench.synthesis.model_check import AGREES, TILT_AGREES, ModelCheck
from legbench.synthesis.release import KEPT

if TYPE_CHECKING:  # To say what a check found, no search is needed, and none of its libraries.
    from legbench.synthesis.solve import Solution
    from legbench.synthesis.yields import Yield

EXACT = 1e-9
"""Ratio below which nothing is left to mend [-]."""
MENDS = 3
"""Number of changes that are shown for each condition."""


def condition_lines(
    design: LegDesign, conditions: Sequence[Condition], half_angle: float, tolerance: float
) -> list[str]:
    """Return a verdict for each condition, and below it the changes that would mend it."""
    lines = []
    for condition in conditions:
        verdict = "met" if condition.is_met(tolerance) else "VIOLATED"
        size = f"{condition.residual:+.3e} {condition.unit}"
        lines.append(
            f"{condition.name:<10} {verdict:<9} {size:<22} {condition.ratio:+.2e}  "
            f"{condition.equation}"
        )
        broken = not condition.is_met(tolerance)
        if broken or (not condition.one_sided and abs(condition.ratio) > EXACT):
            ways = mends(design, condition, half_angle)
            lines += [f"           {mend_words(mend)}" for mend in ways[:MENDS]]
    return lines


def mend_words(mend: Mend) -> str:
    """Return one change in words."""
    moves = f"; moves {', '.join(mend.moves)}" if mend.moves else ""
    topples = "; the leg then stands no longer, condition (10)" if mend.topples else ""
    return (
        f"{mend.parameter}: {mend.change:+.4g} {mend.unit} ({100.0 * mend.share:+.2g} %) "
        f"mends it{moves}{topples}"
    )


def model_lines(check: ModelCheck) -> list[str]:
    """The generated model's couplings, the largest of every condition, and the verdict on it."""
    lines = [
        f"generated model, x2 from {1e3 * check.shortest:.0f} to {1e3 * check.longest:.0f} mm, "
        "largest coupling by setup"
    ]
    for name in dict.fromkeys(row.condition for row in check.rows):
        rows = [row for row in check.rows if row.condition == name]
        if name == "stability":
            continue
        shown = "  ".join(f"{row.setup.value} {row.coupling:.1e}" for row in rows)
        lines.append(f"{name:<10} {shown}")
    apart = max(row.disagreement or 0.0 for row in check.rows if row.condition != "stability")
    tilted = max(row.disagreement or 0.0 for row in check.rows if row.condition == "stability")
    verdict = "agree" if check.agrees else "DISAGREE"
    lines.append(
        f"model and algebra {verdict}: to {apart:.1e} (allowed {AGREES:g}), stability to "
        f"{tilted:.1e} (allowed {TILT_AGREES:g})"
    )
    return lines


def reach_lines(design: LegDesign) -> list[str]:
    """A line for every segment whose inertia mass between its joints cannot have."""
    return [
        f"{reach.segment:<10} inertia {shown(reach.inertia, 'kg m^2')}: {beyond(reach)}"
        for reach in reaches(design)
        if not reach.realisable
    ]


def solution_lines(solution: "Solution") -> list[str]:
    """Lines on the end of a search: objective, ratios, bounds and their prices, the cross-check."""
    state = "converged" if solution.complete else "stopped early, best so far"
    lines = [
        f"objective (11)    {solution.objective:.6f}",
        f"search            {solution.evaluations} evaluations, seed {solution.seed}, {state}",
    ]
    if solution.cost != solution.objective:
        lines.append(f"with scatter      {solution.cost:.6f}")
    if solution.check is not None:
        other = solution.check
        lines.append(
            f"cross-check       differential evolution {other.cost:.6f} "
            f"({other.cost - solution.objective:+.1e}) in {other.evaluations} evaluations"
        )
    lines.append("")
    held = {(bound.variable, bound.side): bound for bound in solution.active}
    lines.append(
        "ratio             value     lower     upper    objective gained per 0.01 of relief"
    )
    for name, value in zip(VARIABLES, solution.free, strict=True):
        bound = getattr(solution.requirements.bounds, name)
        price = ""
        for side in ("lower", "upper"):
            active = held.pop((name, side), None)
            if active is not None:
                price = f"    {0.01 * active.gain:.5f} ({side} bound is active)"
        lines.append(
            f"{name.replace('_', ' '):<17} {value:<8.5g}  {bound.lower:<8.4g}  {bound.upper:<8.4g}"
            f"{price}".rstrip()
        )
    for active in held.values():
        lines.append(f"{active.variable} is at its limit: {0.01 * active.gain:.5f} per 0.01")
    return lines


def table_lines(rows: Sequence[ManufactureRow]) -> list[str]:
    """The manufacture table, and what a workshop has to mind."""
    lines = []
    for row in rows:
        note = f"  ({row.note})" if row.note else ""
        lines.append(f"{row.part:<9} {row.quantity:<15} {row.symbol:<4} {row.shown}{note}")
    return lines


def adjustment_lines(adjusted: Adjusted) -> list[str]:
    """Weights for measured segments, and the conditions before and after."""
    lines = ["weights that move the measured segments to their targets"]
    for weight in adjusted.adjustments:
        if math.isnan(weight.position):
            what = "nothing to add"
        else:
            what = " and ".join(
                f"{1e3 * lump.mass:+.2f} g at {1e3 * lump.position:.1f} mm" for lump in weight.lumps
            )
        missing = f"inertia off by {-1e6 * weight.inertia_missing:+.1f} kg mm^2"
        note = f" ({weight.note})" if weight.note else ""
        lines.append(f"{weight.segment:<9} {what}; {missing}{note}")
    lines.append("ratios of the conditions before and after")
    for before, after in zip(adjusted.before, adjusted.after, strict=True):
        lines.append(f"{before.name:<10} {before.ratio:+.2e}  {after.ratio:+.2e}")
    return lines


def yield_lines(result: "Yield") -> list[str]:
    """How many legs keep their mode, and which tolerance takes it from the others."""
    lines = [
        f"{result.kept} of {result.legs} legs keep P^r above {KEPT:g} "
        f"(design {result.nominal:.4f}, mean {result.mean:.4f}, nine of ten {result.tenth:.4f})",
        "each tolerance alone, the worst first",
    ]
    for name, (share, mean) in result.causes.items():
        size = getattr(result.tolerances, name)
        width = f"{1e3 * size:.2g} mm" if name in ("com", "length") else f"{100 * size:.2g} %"
        lines.append(
            f"{name:<10} {width:<8} mean P^r {mean:.4f}, lost {1.0 - mean:.1e}; "
            f"{100.0 * share:.1f} % keep {KEPT:g}"
        )
    return lines
