"""Pictures of hops: figures of their own, no window."""

from itertools import pairwise
from pathlib import Path

import numpy as np

from legbench.modes.basin import BasinTask, Fate
from legbench.modes.hop_family import HopFamily, Member
from legbench.modes.settings import Setting
from legbench.signals import Floats, Ints
from legbench.viz.print._matplotlib import (
    BoundaryNorm,
    Figure,
    Line2D,
    ListedColormap,
    styled,
)
from legbench.viz.print.modes import DPI, GREY, RADIAL
from legbench.viz.print.off_data import legend_below, legend_beside
from legbench.viz.print.save import save_figure

FATES = {
    Fate.RETURNS: ("#2e7d32", "ends in the periodic hop"),
    Fate.WANDERS: ("#c0ca33", "hops on, otherwise"),
    Fate.STANDS: ("#9e9e9e", "comes to stand"),
    Fate.FELL: ("#c62828", "swings over"),
    Fate.FAULT: ("#6a1b9a", "controller loses step"),
    Fate.BURIED: ("#e0e0e0", "foot under the ground"),
}
LABELS = {
    Setting.Z2: "$z_2$, middle of the set points [rad]",
    Setting.DZ2: r"$\Delta z_2$, amplitude of the push [rad]",
    Setting.DAMPING: "dampers over those of the design [-]",
    Setting.MISMATCH: "$(k_1 - k_2) / k$ [-]",
}
MOST_TICKS = 4
"""Most intervals between ticks of a return map: heights such as 0.26255 m fit between."""


def plot_return(heights: Floats, fixed: Floats, title: str, path: Path) -> None:
    """The return map of the apex height: before and after (n, 2), of the periodic hop, too [m]."""
    with styled():
        figure = Figure(figsize=(4.6, 4.4), layout="constrained")
        axes = figure.subplots()
        span = [float(np.min(heights)), float(np.max(heights))]
        axes.plot(span, span, lw=0.8, color=GREY, label="same height again")
        axes.plot(*heights.T, "o-", ms=3, lw=0.9, color=RADIAL, label="hops in a row")
        axes.plot(*fixed.T, "o", ms=7, mfc="none", color="k", ls="", label="periodic hop")
        legend_below(axes, 3)
        axes.set(
            xlabel="apex of the centre of mass [m]",
            ylabel="next apex of the centre of mass [m]",
            title=title,
        )
        axes.set_aspect("equal")
        axes.locator_params(nbins=MOST_TICKS)
        save_figure(figure, path, DPI)


def plot_basin(task: BasinTask, fates: Ints, path: Path) -> None:
    """The grid of starts, coloured by where they lead."""
    with styled():
        figure = Figure(figsize=(7.4, 4.4), layout="constrained")
        axes = figure.subplots()
        colours = ListedColormap([colour for colour, _ in FATES.values()])
        axes.pcolormesh(
            task.across.values(),
            task.up.values(),
            fates,
            cmap=colours,
            norm=BoundaryNorm(np.arange(-0.5, len(FATES)), len(FATES)),
            rasterized=True,
        )
        centre = task.centre
        at = (getattr(centre, task.across.name), getattr(centre, task.up.name))
        axes.plot(*at, "k+", ms=10)
        handles = [Line2D([], [], marker="+", ls="", color="k", ms=10, label="periodic hop")]
        for value in np.unique(fates).tolist():
            colour, label = FATES[Fate(value)]
            handles.append(Line2D([], [], marker="s", ls="", color=colour, label=label))
        axes.legend(handles=handles, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        units = {"height": "m", "speed": "m/s", "dz1": "rad/s", "dz2": "rad/s"}
        labels = [
            f"{name} at the apex [{units.get(name, 'rad')}]"
            for name in (task.across.name, task.up.name)
        ]
        axes.set(xlabel=labels[0], ylabel=labels[1], title=f"{task.design.name}: where a hop leads")
        save_figure(figure, path, DPI)


def _with_changes(family: HopFamily) -> list[Member]:
    """The hops of a family, those at which stability changes in their places."""
    found, changes = list(family.members[:1]), list(family.changes)
    for before, after in pairwise(family.members):
        if before.cycle.stable != after.cycle.stable and changes:
            found.append(changes.pop(0).member)
        found.append(after)
    return found


def plot_family(family: HopFamily, title: str, path: Path) -> None:
    """Apex heights and the largest multiplier over a setting, dotted where hops are not stable."""
    with styled():
        figure = Figure(figsize=(5.6, 6.0), layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True)
        for first, last in pairwise(_with_changes(family)):
            sizes = [abs(one.cycle.multipliers[0]) for one in (first, last)]
            stable = sum(sizes) < 2.0
            look = {"lw": 1.6 if stable else 1.2, "ls": "-" if stable else ":", "color": RADIAL}
            values = [first.value, last.value]
            for before, after in zip(first.cycle.apexes, last.cycle.apexes, strict=True):
                upper.plot(values, [before.height, after.height], **look)
            lower.plot(values, sizes, **look)
        lower.axhline(1.0, lw=0.8, color=GREY)
        for change in family.changes:
            lower.plot(change.value, 1.0, "o", ms=6, mfc="white", color=RADIAL)
        upper.plot([], [], lw=1.6, color=RADIAL, label="stable")
        upper.plot([], [], lw=1.2, ls=":", color=RADIAL, label="not stable")
        legend_beside(upper)
        upper.set(ylabel="apex of the centre of mass [m]", title=title)
        lower.set(xlabel=LABELS[family.setting], ylabel="size of the largest multiplier")
        save_figure(figure, path, DPI)
