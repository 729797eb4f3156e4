"""Panels of Figs. 4 and 6: a run's polar, joint and modal plane, drawn on axes that are given."""

from dataclasses import replace
from typing import Final

import numpy as np

from legbench.signals import Floats
from legbench.viz import style
from legbench.viz.colouring import Colouring
from legbench.viz.facts import Facts
from legbench.viz.print._matplotlib import Axes, LineCollection

PLANES: Final = (
    (style.POLAR, style.X1, style.X2),
    (style.JOINT, style.Q1, style.Q2),
    (style.MODAL, style.Z2, style.DZ2),
)
"""Title and axes of the three panels."""
FAINT: Final = (0.80, 0.80, 0.82)
"""Colour of the rows that no stretch highlights."""
ON_BOTH: Final = (0.22, 0.88)
"""Ends of the colour map that a light and a dark ground both carry [-]."""


def draw_plane(
    panel: Axes,
    points: Floats,
    colouring: Colouring,
    width: float,
    *,
    faint: tuple[float, ...] | tuple[str, float] = FAINT,
    step: int | None = None,
) -> None:
    """Draw the whole run faintly, the highlighted stretches over it.

    Args:
        panel: where to draw.
        points: coordinates of every row (n, 2).
        colouring: which rows have which colour.
        width: width of the coloured lines [pt].
        faint: colour of the whole run.
        step: number of rows from one point of a line to the next; none: every row, as pixels in
            vector files, which else weigh megabytes.
    """
    rasterized, every = step is None, step or 1
    panel.plot(*points[::every].T, color=faint, linewidth=0.5, zorder=1, rasterized=rasterized)
    lines = LineCollection(
        [_thinned(points[each.first : each.stop + 1], every) for each in colouring.stretches],
        colors=[stretch.colour for stretch in colouring.stretches],
        linewidths=width,
        capstyle="round",
        zorder=3,
        rasterized=rasterized,
    )
    panel.add_collection(lines)
    panel.margins(0.06)


def _thinned(points: Floats, every: int) -> Floats:
    """Every so-manieth of some points, and the last one, so that lines meet."""
    return points if every == 1 else np.concatenate([points[:-1:every], points[-1:]])


def widen(panel: Axes, span: float) -> None:
    """Show a range of x no shorter than this."""
    low, high = panel.get_xlim()
    if high - low < span:
        centre = 0.5 * (low + high)
        panel.set_xlim(centre - 0.5 * span, centre + 0.5 * span)


def draw_modes(
    panel: Axes, facts: Facts, joint: Floats, names: tuple[str, str] = ("$w_1$", "$w_2$")
) -> None:
    """Draw w1 and w2 through the rest posture, as long as the motion is wide; equal axes.

    Args:
        panel: joint space.
        facts: facts of the run, which tell its rest posture.
        joint: link angles of every row (n, 2) [rad].
        names: names of the two modes.
    """
    panel.set_aspect("equal", adjustable="datalim")
    low, high = joint.min(axis=0), joint.max(axis=0)
    centre = 0.5 * (low + high) if facts.rest is None else np.array(facts.rest)
    reach = 0.62 * float((high - low).max())
    for name, colour, arm in (
        (names[0], style.MODE_1, np.array([1.0, 1.0])),
        (names[1], style.MODE_2, np.array([1.0, -1.0])),
    ):
        ends = np.stack([centre - reach * arm, centre + reach * arm])
        panel.plot(
            *ends.T, color=style.unit(colour), linewidth=1.1, linestyle=(0, (5, 2)), zorder=2
        )
        panel.annotate(
            name,
            (float(ends[1, 0]), float(ends[1, 1])),
            xytext=(2, 0),
            textcoords="offset points",
            color=style.unit(colour),
            va="center",
        )


def on_both_grounds(colouring: Colouring) -> Colouring:
    """Return a colouring whose periods are readable on a light and on a dark ground."""
    count = len(colouring.stretches)
    if not colouring.periods:
        return colouring
    colours = style.viridis(np.linspace(*ON_BOTH, max(count, 2)))[:count] / 255.0
    return replace(
        colouring,
        stretches=tuple(
            replace(stretch, colour=(r, g, b))
            for stretch, (r, g, b) in zip(colouring.stretches, colours.tolist(), strict=True)
        ),
    )
