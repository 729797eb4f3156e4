"""Pictures of modes: figures of their own, no window."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from legbench.modes.branches import Branch
from legbench.modes.family import Family
from legbench.modes.scene import Scene
from legbench.viz.print._matplotlib import Axes, Figure, Line2D, styled
from legbench.viz.print.save import save_figure

RADIAL, POLAR, GREY = "#00acc1", "#e69f00", "#808080"
COLOURS = {"radial": RADIAL, "polar": POLAR}
BRANCH = "#8e24aa"
DPI = 150
BELOW = (0.5, -0.18)
"""Place of a legend under its panel, in the panel's own units."""


def plot_modes(
    scene: Scene,
    families: Sequence[Family],
    branches: Mapping[str, Sequence[Branch]],
    path: Path,
) -> None:
    """Generator curves over joint space, backbones with their stability, and phase portraits."""
    with styled():
        figure = Figure(figsize=(11.0, 4.0), layout="constrained")
        joint, backbone, phase = figure.subplots(1, 3)
        _joint_space(joint, scene, families)
        for family in families:
            draw_backbone(backbone, family)
            for branch in branches[family.mode.name]:
                _draw_branch(backbone, branch, 2.0 * max(one.largest for one in families))
        _explain(backbone, families, any(branches.values()))
        backbone.set(xlabel="frequency [Hz]", ylabel="energy above rest [J]", title="backbones")
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


def draw_backbone(axes: Axes, family: Family) -> None:
    """Energy over frequency: dotted where orbits are not stable, a ring where that changes."""
    colour = COLOURS[family.mode.name]
    changes = [passing.orbit for passing in family.passings if passing.changes]
    orbits = sorted([*family.orbits, *changes], key=lambda orbit: orbit.energy)
    for first, last in pairwise(orbits):
        stable = abs(first.monodromy.trace + last.monodromy.trace) < 4.0
        axes.plot(
            [1.0 / first.period, 1.0 / last.period],
            [first.energy, last.energy],
            lw=1.6 if stable else 1.2,
            ls="-" if stable else ":",
            color=colour,
        )
    for passing in family.passings:
        if passing.changes:
            at = 1.0 / passing.orbit.period, passing.orbit.energy
            axes.plot(*at, "o", ms=6, mfc="white", color=colour)
    axes.plot(family.mode.freq, 0.0, "^", ms=6, color=colour, clip_on=False)


def _draw_branch(axes: Axes, branch: Branch, highest: float) -> None:
    """Energy over frequency of a branch, up to an energy [J]."""
    shown = [orbit for orbit in branch.orbits if orbit.energy < highest]
    freq = [1.0 / orbit.period for orbit in shown]
    stable = all(orbit.monodromy.stable for orbit in shown)
    energies = [orbit.energy for orbit in shown]
    axes.plot(freq, energies, lw=1.2, ls="-" if stable else ":", color=BRANCH)


def _explain(axes: Axes, families: Sequence[Family], branched: bool) -> None:
    handles = [
        Line2D([], [], lw=1.6, color=COLOURS[family.mode.name], label=family.mode.name)
        for family in families
    ]
    if branched:
        handles.append(Line2D([], [], lw=1.2, color=BRANCH, label="branches"))
    handles += [
        Line2D([], [], marker="^", ls="", color=GREY, label="linear"),
        Line2D([], [], lw=1.2, ls=":", color=GREY, label="not stable"),
        Line2D([], [], marker="o", ls="", mfc="white", color=GREY, label="stability changes"),
    ]
    axes.legend(
        handles=handles,
        loc="upper center",
        bbox_to_anchor=BELOW,
        ncols=3,
        fontsize=6,
        frameon=False,
    )


def _curves_of_energy(
    axes: Axes, scene: Scene, families: Sequence[Family], reach: float
) -> NDArray[np.float64]:
    """Draw curves of equal energy, and return points of the outermost one's inside (n, 2) [rad].

    All of it is shown, as far as it closes within twice the reach of the orbits around the rest.
    """
    highest = max(found.energy for family in families for found in family.orbits)
    q1, q2 = (middle + np.linspace(-2.0 * reach, 2.0 * reach, 240) for middle in scene.rest)
    grid = np.stack(np.meshgrid(q1, q2), axis=-1)
    potential = scene.potential(grid)
    axes.contour(
        q1,
        q2,
        potential,
        levels=np.linspace(0.0, highest, 6)[1:],
        colors="#cccccc",
        linewidths=0.7,
    )
    return grid[potential <= highest]


def _joint_space(axes: Axes, scene: Scene, families: Sequence[Family]) -> None:
    rest, ends = np.asarray(scene.rest), [np.asarray([scene.rest])]
    for family in families:
        colour = COLOURS[family.mode.name]
        generator = np.array(
            [found.end for found in family.orbits[::-1]] + [found.start for found in family.orbits]
        )
        axes.plot(*generator.T, "o", ms=2.5, color=colour)
        widest = family.orbits[-1]
        times = np.linspace(0.0, 0.5 * widest.period, 120)
        start = np.array([*widest.start, 0.0, 0.0])
        axes.plot(*family.shooting.carrier.path(start, times)[:, :2].T, lw=1.2, color=colour)
        ends.append(generator)
    points = np.vstack(ends)
    reach = float(np.max(np.abs(points - rest)))
    points = np.vstack([points, _curves_of_energy(axes, scene, families, reach)])
    low, high = points.min(axis=0) - 0.05, points.max(axis=0) + 0.05
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
    axes.legend(
        handles=handles,
        loc="upper center",
        bbox_to_anchor=BELOW,
        ncols=4,
        fontsize=6,
        frameon=False,
    )
    axes.set(xlabel="$q_1$ [rad]", ylabel="$q_2$ [rad]", title="generator curves")
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")


def _portrait(axes: Axes, scene: Scene, family: Family) -> None:
    rest = np.asarray(scene.rest)
    axis = np.array([-1.0, 1.0] if family.mode.name == "radial" else [1.0, 1.0]) / np.sqrt(2.0)
    for found in family.orbits[:: max(1, len(family.orbits) // 5)]:
        start, times = np.array([*found.start, 0.0, 0.0]), np.linspace(0.0, found.period, 400)
        path = family.shooting.carrier.path(start, times)
        look = "-" if found.monodromy.stable else ":"
        axes.plot(
            (path[:, :2] - rest) @ axis,
            path[:, 2:] @ axis,
            lw=0.9,
            ls=look,
            color=COLOURS[family.mode.name],
        )
