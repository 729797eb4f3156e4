"""An explanation in words: ranked tables, then sentences."""

import math
from collections.abc import Sequence

from legbench.design.setup import SetupKind
from legbench.explain.apart import ProposedExperiment
from legbench.explain.explanation import Explanation, JudgedFit
from legbench.explain.fitting import CauseFit
from legbench.explain.motor_end import MotorEnd
from legbench.explain.screening import Screened
from legbench.explain.sensitivity import Sensitivity
from legbench.signals import Floats

EFFECTS = 12
"""Number of effects in the table [-]."""
FITS = 16
"""Number of fits in each table [-]."""


def explanation_lines(found: Explanation) -> list[str]:
    """Everything that was found, as lines of text."""
    target = found.target
    lines = [
        f"target    step from z2 = {target.z2 + target.dz2:g} to {target.z2:g} rad, "
        f"{target.setup}: P^r {_shape(target.shape)}, each +- {target.tolerance:g}",
        f"perfect   P^r {_shape(found.perfect.fit.ratings)}",
        "",
        *_effects(found.sensitivities),
        *_screened(found.screened),
        "",
        *_fits("one cause", found.singles),
    ]
    if found.pairs:
        lines += ["", *_fits("two causes", found.pairs)]
    if found.perfect.checks:
        lines += ["", *_statements([found.perfect, *found.judged])]
    return [*lines, "", *sentences(found)]


def sentences(found: Explanation) -> list[str]:
    """Findings in plain sentences."""
    lines = [_verdict(found)]
    alike = found.alike
    if len(alike) > 1:
        names = "; ".join(fit.name for fit in alike)
        some = f", {len(alike)} of which are" if found.reaching > len(alike) else ":"
        lines.append(
            f"The target alone cannot tell {found.reaching} explanations apart, each within "
            f"{found.target.tolerance:g} in every period{some} {names}."
        )
    if found.proposals:
        lines.append(_proposal(found.proposals[0]))
    lines += _ends(found.ends)
    if not found.pairs and found.complete:
        lines.append("Pairs of causes were not tried; --pairs tries them.")
    if not found.complete:
        lines.append("Stopped before the end: what is here is what had been found by then.")
    return lines


def _verdict(found: Explanation) -> str:
    best = found.best
    if best is None:
        return "Nothing was found."
    fit = best.fit
    off = f"off by up to {fit.worst * found.target.tolerance:.3f}"
    reach = f"reaches the target ({off})" if fit.within else f"comes nearest to the target ({off})"
    rest = " and agrees best with the rest" if best.checks else ""
    fall = "falling from period to period" if fit.monotone else "not falling throughout"
    held = f" {best.held} of {len(best.checks)} other statements hold." if best.checks else ""
    return (
        f"{_alone(found)}What {reach}{rest}: {fit.words}; P^r {_shape(fit.ratings)}, {fall}.{held}"
    )


def _alone(found: Explanation) -> str:
    """Sentence on single causes, where none reaches the target."""
    if not found.singles or found.singles[0].within:
        return ""
    nearest = found.singles[0]
    return (
        f"No single cause reaches the target: the nearest, {nearest.words}, is off by up to "
        f"{nearest.worst * found.target.tolerance:.3f}. "
    )


def _proposal(best: ProposedExperiment) -> str:
    posture = 1e3 * best.posture
    return (
        f"The experiment to do next: in {best.setup}, a step from z2 = {best.z2 + best.dz2:g} to "
        f"{best.z2:g} rad tells {best.told} of {best.pairs} pairs of them apart; the two nearest, "
        f"{' and '.join(best.nearest_names)}, differ by {best.nearest:.1f} times what can be read. "
        f"Their postures at rest lie at z1 = {posture.min():.0f} to {posture.max():.0f} mrad."
    )


def _ends(ends: Sequence[MotorEnd]) -> list[str]:
    """Sentences on a motor that ends at its range, with a fixed trunk and with the foot fixed."""
    lines, nearest = [], math.inf
    for end in ends:
        lowest = min((level for level in end.levels if math.isfinite(level)), default=math.nan)
        head = f"Bang-bang at z2 = {end.z2:g} rad in {end.setup} takes motor 2 to"
        if end.setup is SetupKind.FFS and end.farthest < nearest < math.inf:
            lines.append(
                f"{head} {end.farthest:.2f} rad only: an end that lowers the others does not touch "
                "it."
            )
        elif end.lowers is None:
            lines.append(f"{head} {end.farthest:.2f} rad; no end that was tried lowers the rating.")
        else:
            nearest = min(nearest, end.lowers)
            lines.append(
                f"{head} {end.farthest:.2f} rad; a range that ends at {end.lowers:.2f} rad or "
                f"earlier lowers the rating from {end.levels[0]:.3f} to as little as {lowest:.3f}."
            )
    return lines


def _effects(rows: Sequence[Sensitivity]) -> list[str]:
    lines = ["effects of plausible sizes, one at a time, the largest first"]
    for row in rows[:EFFECTS]:
        size = row.cause.shown(row.size)
        lines.append(
            f"  {row.cause.name:<18} {size:>12}  {_shape(row.ratings)}  by {row.change:.3f}"
        )
    rest = rows[EFFECTS:]
    if rest:
        names = ", ".join(dict.fromkeys(row.cause.name for row in rest))
        lines.append(f"  {rest[0].change:.3f} or less: {names}")
    return lines


def _screened(rows: Sequence[Screened]) -> list[str]:
    if not rows:
        return []
    lines = ["", "weights with everything at plausible sizes at once: whole, other"]
    return lines + [f"  {row.cause.name:<18} {row.whole:8.4f} {row.other:8.4f}" for row in rows]


def _fits(title: str, fits: Sequence[CauseFit]) -> list[str]:
    lines = [
        f"fits of {title}: misfit in tolerances (rms, worst), size over what is plausible, P^r"
    ]
    for fit in fits[:FITS]:
        sizes = ", ".join(
            cause.shown(size) for cause, size in zip(fit.causes, fit.sizes, strict=True)
        )
        mark = "*" if fit.within else " "
        lines.append(
            f"{mark} {fit.misfit:5.2f} {fit.worst:5.2f} {fit.stretch:5.1f}  {fit.name:<38} "
            f"{sizes:<26} {_shape(fit.ratings)}"
        )
    if any(fit.within for fit in fits[:FITS]):
        lines.append("* every period within the tolerance")
    return lines


def _statements(judged: Sequence[JudgedFit]) -> list[str]:
    """Table of the statements of the paper, one row each, and a column for each leg."""
    letters = "0ABCDEFGHIJKLMNOPQRSTUVWXYZ"[: len(judged)]
    lines = ["what else the paper says; + it holds"]
    lines += [
        f"  {letter}  {one.fit.name or 'perfect leg'}: {one.held} of {len(one.checks)} hold"
        for letter, one in zip(letters, judged, strict=True)
    ]
    lines.append(" " * WIDE + "".join(f"{letter:>7} " for letter in letters))
    for place, check in enumerate(judged[0].checks):
        cells = [one.checks[place] for one in judged]
        lines.append(
            f"  {check.words:<{WIDE - 2}}"
            + "".join(f"{cell.value:7.3f}{'+' if cell.held else ' '}" for cell in cells)
        )
    for words, name in (
        ("jump, height of the foot [mm]", "foot_clearance"),
        ("jump, travel of the trunk [mm]", "trunk_excursion"),
        ("jump, drift [mm]", "drift"),
    ):
        hops = [one.hop for one in judged if one.hop is not None]
        if len(hops) == len(judged):
            lines.append(
                f"  {words:<{WIDE - 2}}"
                + "".join(f"{1e3 * getattr(hop, name):7.0f} " for hop in hops)
            )
    return lines


WIDE = 42
"""Width of the column of statements."""


def _shape(ratings: Sequence[float] | Floats) -> str:
    return " ".join("  -  " if math.isnan(value) else f"{value:.3f}" for value in ratings)
