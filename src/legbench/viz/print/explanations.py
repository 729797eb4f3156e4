"""Picture of an explanation: the shape that was measured, and what comes close to it."""

from pathlib import Path
from typing import Any

import numpy as np

from legbench.explain.explanation import Explanation
from legbench.explain.fitting import CauseFit
from legbench.viz.print._matplotlib import Figure, styled
from legbench.viz.print.modes import DPI, GREY
from legbench.viz.print.save import save_figure

COLOURS = ("#1565c0", "#c62828", "#2e7d32", "#ef6c00", "#6a1b9a", "#00838f", "#795548", "#ad1457")
"""Colours of the fits, in order."""
MARKS = ("o", "s", "^", "v", "D", "P", "X", "*")
"""Marks of the fits, for those who cannot tell the colours apart."""
SHOWN = 6
"""Number of fits that are drawn [-]: more lines cannot be followed."""


def plot_explanation(found: Explanation, path: Path) -> Path:
    """Draw the ratings of the target and of the fits, and what the fits predict next."""
    fits = [judged.fit for judged in found.judged[:SHOWN]]
    with styled():
        proposed = found.proposals[0] if found.proposals else None
        figure = Figure(figsize=(9.6 if proposed else 5.4, 5.6), layout="constrained")
        axes = np.atleast_1d(figure.subplots(1, 2 if proposed else 1))
        _shapes(axes[0], found, fits)
        if proposed is not None:
            for fit in fits:
                if fit.name in proposed.names:
                    ratings = proposed.ratings[proposed.names.index(fit.name)]
                    _line(axes[1], ratings, fits.index(fit), None)
            axes[1].set(
                title=f"the experiment that tells them apart:\n{proposed.setup}, step from z2 = "
                f"{proposed.z2 + proposed.dz2:g} to {proposed.z2:g} rad",
                xlabel="oscillation period",
                ylabel="$P^r$ about the equilibrium [-]",
                xticks=range(1, proposed.ratings.shape[1] + 1),
            )
        figure.legend(
            *axes[0].get_legend_handles_labels(),
            loc="outside lower center",
            ncols=2 if proposed else 1,
            frameon=False,
            fontsize=8,
        )
        return save_figure(figure, path, DPI)


def _shapes(axes: Any, found: Explanation, fits: list[CauseFit]) -> None:
    """Draw target, perfect leg and fits."""
    target = found.target
    periods = np.arange(1, len(target.shape) + 1)
    shape = np.asarray(target.shape)
    axes.fill_between(
        periods,
        shape - target.tolerance,
        shape + target.tolerance,
        color=GREY,
        alpha=0.35,
        lw=0.0,
        label="measured, as it can be read",
    )
    axes.plot(periods, found.perfect.fit.ratings, color="k", lw=0.9, ls=":", label="perfect leg")
    for place, fit in enumerate(fits):
        _line(axes, np.asarray(fit.ratings), place, _label(fit))
    axes.set(
        title=f"step from z2 = {target.z2 + target.dz2:g} to {target.z2:g} rad, {target.setup}",
        xlabel="oscillation period",
        ylabel="$P^r$ about the equilibrium [-]",
        xticks=periods,
    )


def _line(axes: Any, ratings: Any, place: int, label: str | None) -> None:
    periods = np.arange(1, len(ratings) + 1)
    colour, mark = COLOURS[place % len(COLOURS)], MARKS[place % len(MARKS)]
    axes.plot(periods, ratings, color=colour, marker=mark, ms=4, lw=1.1, label=label)


def _label(fit: CauseFit) -> str:
    return ", ".join(
        f"{cause.name} {cause.shown(size)}"
        for cause, size in zip(fit.causes, fit.sizes, strict=True)
    )
