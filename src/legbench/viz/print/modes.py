"""Pictures of modes and hops: figures of their own, no window."""

from pathlib import Path

import numpy as np

from legbench.modes.basin import Fate, Question
from legbench.modes.brake import Family
from legbench.modes.flow import orbit
from legbench.modes.scene import Scene
from legbench.signals import Floats, Ints
from legbench.viz.print._matplotlib import (
    BoundaryNorm,
    Figure,
    Line2D,
    ListedColormap,
    styled,
)
from legbench.viz.print.save import save_figure

RADIAL, POLAR, GREY = "#00acc1", "#e69f00", "#808080"
COLOURS = {"radial": RADIAL, "polar": POLAR}
FATES = {
    Fate.RETURNS: ("#2e7d32", "ends in the periodic hop"),
    Fate.WANDERS: ("#c0ca33", "hops on, otherwise"),
    Fate.STANDS: ("#9e9e9e", "comes to stand"),
    Fate.FELL: ("#c62828", "swings over"),
    Fate.FAULT: ("#6a1b9a", "controller loses step"),
    Fate.BURIED: ("#e0e0e0", "foot under the ground"),
}
DPI = 150


def plot_modes(scene: Scene, families: list[Family], path: Path) -> None:
    """Generator curves over joint space, backbones, and the phase portrait of the radial mode."""
    with styled():
        figure = Figure(figsize=(11.0, 3.8), layout="constrained")
        joint, backbone, phase = figure.subplots(1, 3)
        _joint_space(joint, scene, families)
        for family in families:
            energies = [found.energy for found in family.orbits]
            freq = [1.0 / found.period for found in family.orbits]
            colour = COLOURS[family.mode.name]
            backbone.plot(freq, energies, "o-", ms=3, color=colour, label=family.mode.name)
            backbone.axvline(family.mode.freq, lw=0.8, ls=":", color=colour)
        backbone.plot([], [], lw=0.8, ls=":", color=GREY, label="linear")
        backbone.set(xlabel="frequency [Hz]", ylabel="energy above rest [J]", title="backbones")
        backbone.legend(frameon=False)
        for family in families:
            _portrait(phase, scene, family)
        phase.set(
            xlabel="$z_2$ (radial), $z_1$ (polar), from rest [rad]",
            ylabel=r"$\dot z_2$, $\dot z_1$ [rad/s]",
            title="phase portraits",
        )
        title = f"{scene.design.name}, {scene.kind}, rest at z2 = {np.sqrt(2) * scene.rest[1]:.3g}"
        figure.suptitle(f"{title} rad, undamped")
        save_figure(figure, path, DPI)


def _joint_space(axes, scene: Scene, families: list[Family]) -> None:  # type: ignore[no-untyped-def]
    rest, ends = np.asarray(scene.rest), [np.asarray(scene.rest)]
    for family in families:
        colour = COLOURS[family.mode.name]
        generator = np.array(
            [found.end for found in family.orbits[::-1]] + [found.start for found in family.orbits]
        )
        axes.plot(*generator.T, "o", ms=2.5, color=colour)
        widest = family.orbits[-1]
        axes.plot(*orbit(scene, widest.start, 0.5 * widest.period, 120).T, lw=1.2, color=colour)
        ends.append(generator)
    points = np.vstack(ends)
    low, high = points.min(axis=0) - 0.15, points.max(axis=0) + 0.15
    q1, q2 = (np.linspace(a, b, 120) for a, b in zip(low, high, strict=True))
    grid = np.stack(np.meshgrid(q1, q2), axis=-1)
    energies = [found.energy for family in families for found in family.orbits]
    axes.contour(
        q1,
        q2,
        scene.potential(grid),
        levels=np.linspace(0.0, max(energies), 6)[1:],
        colors="#cccccc",
        linewidths=0.7,
    )
    reach = float(np.max(np.abs(points - rest)))
    for sign in (-1.0, 1.0):
        line = rest + reach * np.array([[sign, -1.0], [-sign, 1.0]])
        axes.plot(*line.T, lw=0.7, ls=":", color=GREY)
    axes.plot(*rest, "k+", ms=8)
    handles = [
        Line2D([], [], marker="o", ms=2.5, ls="", color=GREY, label="ends of the orbits"),
        Line2D([], [], lw=1.2, color=GREY, label="widest orbit"),
        Line2D([], [], lw=0.7, ls=":", color=GREY, label="modal axes"),
        Line2D([], [], lw=0.7, color="#cccccc", label="equal energy"),
    ]
    below = (0.5, -0.18)
    axes.legend(
        handles=handles,
        loc="upper center",
        bbox_to_anchor=below,
        ncols=4,
        fontsize=6,
        frameon=False,
    )
    axes.set(xlabel="$q_1$ [rad]", ylabel="$q_2$ [rad]", title="generator curves")
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")


def _portrait(axes, scene: Scene, family: Family) -> None:  # type: ignore[no-untyped-def]
    rest = np.asarray(scene.rest)
    axis = np.array([-1.0, 1.0] if family.mode.name == "radial" else [1.0, 1.0]) / np.sqrt(2.0)
    for found in family.orbits[:: max(1, len(family.orbits) // 5)]:
        path = (orbit(scene, found.start, found.period, 400) - rest) @ axis
        rate = np.gradient(path, found.period / 399)
        axes.plot(path, rate, lw=0.9, color=COLOURS[family.mode.name])


def plot_return(heights: Floats, fixed: float | None, title: str, path: Path) -> None:
    """The return map of the apex height: (n, 2) of before and after [m]."""
    with styled():
        figure = Figure(figsize=(4.6, 4.4), layout="constrained")
        axes = figure.subplots()
        span = [float(np.min(heights)), float(np.max(heights))]
        axes.plot(span, span, lw=0.8, color=GREY, label="same height again")
        axes.plot(*heights.T, "o-", ms=3, lw=0.9, color=RADIAL, label="hops in a row")
        if fixed is not None:
            axes.plot(fixed, fixed, "o", ms=7, mfc="none", color="k", ls="", label="periodic hop")
        axes.legend(frameon=False)
        axes.set(
            xlabel="apex of the centre of mass [m]",
            ylabel="next apex of the centre of mass [m]",
            title=title,
        )
        axes.set_aspect("equal")
        save_figure(figure, path, DPI)


def plot_basin(question: Question, fates: Ints, path: Path) -> None:
    """The grid of starts, coloured by where they lead."""
    with styled():
        figure = Figure(figsize=(5.6, 4.4), layout="constrained")
        axes = figure.subplots()
        colours = ListedColormap([colour for colour, _ in FATES.values()])
        axes.pcolormesh(
            question.across.values(),
            question.up.values(),
            fates,
            cmap=colours,
            norm=BoundaryNorm(np.arange(-0.5, len(FATES)), len(FATES)),
            rasterized=True,
        )
        centre = question.centre
        at = (getattr(centre, question.across.name), getattr(centre, question.up.name))
        axes.plot(*at, "k+", ms=10)
        handles = [Line2D([], [], marker="+", ls="", color="k", ms=10, label="periodic hop")]
        for value in np.unique(fates).tolist():
            colour, label = FATES[Fate(value)]
            handles.append(Line2D([], [], marker="s", ls="", color=colour, label=label))
        axes.legend(handles=handles, frameon=True, loc="upper right")
        units = {"height": "m", "speed": "m/s", "dz1": "rad/s", "dz2": "rad/s"}
        labels = [
            f"{name} at the apex [{units.get(name, 'rad')}]"
            for name in (question.across.name, question.up.name)
        ]
        axes.set(
            xlabel=labels[0], ylabel=labels[1], title=f"{question.design.name}: where a hop leads"
        )
        save_figure(figure, path, DPI)
