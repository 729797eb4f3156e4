"""Figure 5: P^r over the oscillation periods, a panel for each setup and controller."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from legbench.campaign.curves import RatingCurve
from legbench.design.setup import SetupKind
from legbench.viz import style
from legbench.viz.print._matplotlib import Axes, Figure, FigureCanvasAgg, Line2D, styled

Colour = tuple[float, float, float]
Dashes = tuple[float, tuple[float, ...]] | str

SIZE_INCH: Final = (10.0, 6.2)
"""Width and height of the figure [inch]."""
GRAIN: Final = 0.02
"""Grain of the lower end of the axis of ratings [-]."""
DASHES: Final[tuple[Dashes, ...]] = ("solid", (0.0, (5.0, 2.0)), (0.0, (1.5, 1.5)))
"""Dashes of the deflections in turn, from the smallest on."""
PANELS: Final = tuple(
    (controller, kind)
    for controller in ("position-jump", "bang-bang")
    for kind in (SetupKind.HFTS, SetupKind.VFTS, SetupKind.FFS)
)
"""Controller and setup of the panels (a) to (f)."""
TITLES: Final = {SetupKind.HFTS: "hFTS", SetupKind.VFTS: "vFTS", SetupKind.FFS: "FFS"}
WORDS: Final = {"position-jump": "step", "bang-bang": "bang-bang"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """Rating that the paper prints, drawn in a panel: a point, or a level from `first` on."""

    controller: str
    setup: SetupKind
    first: int
    last: int | None
    """Last period of a level; none: to the end of the panel."""
    rating: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Looks:
    """Colours of set points and dashes of deflections, shared by all panels."""

    colours: dict[float, Colour]
    """Colour by set point z2 [rad]."""
    dashes: dict[str, dict[float, Dashes]]
    """Dashes by controller, and by deflection dz2 [rad]."""


def looks_of(curves: Sequence[RatingCurve]) -> Looks:
    """Choose a colour for each set point, and dashes for each deflection of a controller."""
    z2 = sorted({curve.cell.z2 for curve in curves})
    palette = style.COMPONENTS
    colours = {value: style.unit(palette[n % len(palette)]) for n, value in enumerate(z2)}
    dashes: dict[str, dict[float, Dashes]] = {}
    for controller in WORDS:
        sizes = sorted({abs(c.cell.dz2) for c in curves if c.cell.controller == controller})
        dashes[controller] = {size: DASHES[n % len(DASHES)] for n, size in enumerate(sizes)}
    return Looks(colours=colours, dashes=dashes)


def draw_ratings(
    panel: Axes,
    curves: Sequence[RatingCurve],
    looks: Looks,
    marks: Sequence[Mark],
    colour: str | Colour,
) -> None:
    """Draw the curves of one panel, with bands of their spread, and what the paper prints there.

    Args:
        panel: where to draw.
        curves: curves of one controller and setup.
        looks: colours and dashes.
        marks: ratings of the paper that belong there.
        colour: colour of the marks.
    """
    longest = max((len(curve.mean) for curve in curves), default=1)
    for curve in curves:
        periods = np.arange(1, len(curve.mean) + 1)
        ink = looks.colours[curve.cell.z2]
        dashes = looks.dashes[curve.cell.controller][abs(curve.cell.dz2)]
        panel.plot(periods, curve.mean, color=ink, linestyle=dashes, linewidth=1.2, zorder=3)
        panel.plot(periods, curve.mean, ".", color=ink, markersize=3.5, zorder=3)
        if curve.spread.any():
            low, high = curve.mean - curve.spread, np.minimum(curve.mean + curve.spread, 1.0)
            panel.fill_between(periods, low, high, color=ink, alpha=0.16, linewidth=0, zorder=1)
    for mark in marks:
        ends = [mark.first, max(longest, mark.first) if mark.last is None else mark.last]
        look = "x" if mark.first == mark.last else "-"
        panel.plot(
            ends, [mark.rating] * 2, look, color=colour, markersize=6, linewidth=1.4, zorder=4
        )
    panel.set_xlim(0.5, max(longest, *(mark.first for mark in marks), 6) + 0.5)
    panel.locator_params(axis="x", nbins=8, integer=True)
    panel.locator_params(axis="y", nbins=6)


def lowest_of(curves: Sequence[RatingCurve], marks: Sequence[Mark], controller: str) -> float:
    """Lower end of an axis that shows all curves and marks of a controller [-]."""
    shown = [curve for curve in curves if curve.cell.controller == controller]
    lows = [float((curve.mean - curve.spread).min()) for curve in shown if len(curve.mean)]
    printed = [mark.rating for mark in marks if mark.controller == controller]
    lowest = min([*lows, *printed, 0.95])
    return max(0.0, GRAIN * np.floor(lowest / GRAIN - 0.5))


def in_panel(curves: Sequence[RatingCurve], controller: str, setup: SetupKind) -> list[RatingCurve]:
    """Curves that belong to one panel."""
    return [c for c in curves if c.cell.controller == controller and c.cell.setup == setup]


def marks_in(marks: Sequence[Mark], controller: str, setup: SetupKind) -> list[Mark]:
    """Marks that belong to one panel."""
    return [each for each in marks if each.controller == controller and each.setup is setup]


def ratings_figure(curves: Sequence[RatingCurve], marks: Sequence[Mark], title: str) -> Figure:
    """Six panels, steps above and bang-bang below, one column for each setup.

    Args:
        curves: curves of all cells.
        marks: ratings of the paper, drawn in black.
        title: title of the figure, which says what the rating is about.
    """
    looks = looks_of(curves)
    with styled():
        figure = Figure(figsize=SIZE_INCH, layout="constrained")
        FigureCanvasAgg(figure)
        for place, (controller, kind) in enumerate(PANELS):
            panel = figure.add_subplot(2, 3, place + 1)
            panel.set_title(f"({'abcdef'[place]}) {TITLES[kind]}, {WORDS[controller]}", loc="left")
            shown = in_panel(curves, controller, kind), marks_in(marks, controller, kind)
            draw_ratings(panel, shown[0], looks, shown[1], "black")
            panel.set_ylim(lowest_of(curves, marks, controller), 1.004)
            panel.set_xlabel("oscillation period")
            panel.set_ylabel("$P^r$")
        figure.legend(handles=_handles(looks), loc="outside lower center", ncols=5, frameon=False)
        figure.suptitle(title, fontsize=10.5)
    return figure


def _handles(looks: Looks) -> list[Line2D]:
    found = [
        Line2D([], [], color=colour, label=f"$z_2$ = {z2:g} rad")
        for z2, colour in looks.colours.items()
    ]
    for controller, dashes in looks.dashes.items():
        found += [
            Line2D([], [], color="black", linestyle=look, label=_of_deflection(controller, size))
            for size, look in dashes.items()
        ]
    return [*found, Line2D([], [], color="black", marker="x", label="paper")]


def _of_deflection(controller: str, size: float) -> str:
    return rf"{WORDS[controller]}, $|\Delta z_2|$ = {size:g} rad"
