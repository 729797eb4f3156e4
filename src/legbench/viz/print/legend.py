"""Legends of a print figure, for its colours and dashes."""

from collections.abc import Sequence

import numpy as np

from legbench.viz import style
from legbench.viz.colouring import Colouring
from legbench.viz.print._matplotlib import (
    Axes,
    BoundaryNorm,
    Figure,
    Line2D,
    ListedColormap,
    ScalarMappable,
)
from legbench.viz.print.overlay import look_of
from legbench.viz.print.planes import FAINT

UNRATED = "not rated: at rest, before the first or after the last period that counts"
"""Words for the rows of a run that belong to no period."""
HANDLE, ROW = 8, 150
"""Widths of a legend's line and of its widest row [characters]."""


def explain(
    figure: Figure, panels: list[Axes], colouring: Colouring, names: Sequence[str] = ()
) -> None:
    """Explain the colours of periods or of stance and flight, faint rows, and several runs."""
    lines: list[Line2D] = []
    if colouring.periods:
        _draw_bar(figure, panels, colouring)
    elif colouring.stretches:
        known = (("stance", style.STANCE), ("flight", style.FLIGHT))
        lines = [Line2D([], [], color=style.unit(colour), label=name) for name, colour in known]
        lines.append(Line2D([], [], color=FAINT, label="earlier"))
    if names:
        own = Line2D([], [], linestyle="none", label=f"{names[0]}:")
        if not lines:
            shown = colouring.stretches
            colour = shown[len(shown) // 2].colour if shown else FAINT
            own = Line2D([], [], color=colour, label=names[0])
        lines = [own, *lines, *_others(names[1:])]
    if colouring.periods:
        lines.append(Line2D([], [], color=FAINT, label=UNRATED))
    if lines:
        wide = sum(len(str(line.get_label())) + HANDLE for line in lines) > ROW
        columns = 2 if wide else len(lines)
        figure.legend(handles=lines, loc="outside lower center", ncols=columns, frameon=False)


def _draw_bar(figure: Figure, panels: list[Axes], colouring: Colouring) -> None:
    colours = ListedColormap([stretch.colour for stretch in colouring.stretches])
    edges = np.arange(colouring.periods + 1) + 0.5
    scale = ScalarMappable(BoundaryNorm(edges, colours.N), colours)
    step = max(1, -(-colouring.periods // 7))
    ticks = list(range(1, colouring.periods + 1, step))
    bar = figure.colorbar(scale, ax=panels, label="oscillation period", ticks=ticks, pad=0.01)
    bar.minorticks_off()


def _others(names: Sequence[str]) -> list[Line2D]:
    looks = [(name, look_of(place)) for place, name in enumerate(names)]
    return [
        Line2D([], [], color=look.colour, linestyle=look.dashes, linewidth=0.9, label=name)
        for name, look in looks
    ]
