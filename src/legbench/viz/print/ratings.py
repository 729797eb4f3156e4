"""Figure 5: P^r over the oscillation periods, a panel for each setup and controller."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from legbench.campaign.curves import RatingCurve
from legbench.signals import Floats
from legbench.viz import style
from legbench.viz.print._matplotlib import Axes, Figure, FigureCanvasAgg, Line2D, styled

Colour = tuple[float, float, float]
Dashes = tuple[float, tuple[float, ...]] | Literal["solid"]

WIDTH_INCH, ROW_INCH, LEGEND_INCH = 10.0, 2.7, 0.8
"""Width of the figure, heights of a row of panels and of the legend [inch]."""
SHORTEST: Final = 6
"""Fewest periods that an axis shows [-], those of the paper's step."""
COLUMNS: Final = 3
"""Number of panels in a row: one for each setup."""
GRAIN: Final = 0.02
"""Grain of the lower end of the axis of ratings [-]."""
NEAR_ONE: Final = 0.95
"""Ratings that are all above this are drawn as what they lack of one, on a logarithmic axis [-]."""
LEAST: Final = 1e-9
"""Smallest 1 - P^r that is drawn [-]; below it there is the noise of a mean."""
PRINTED_LEAST: Final = 0.005
"""Half a unit of the paper's last digit [-]: a printed 1.00 may be this far from one."""
DASHES: Final[tuple[Dashes, ...]] = ("solid", (0.0, (5.0, 2.0)), (0.0, (1.5, 1.5)))
"""Dashes of the deflections in turn, from the smallest on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedRating:
    """Rating that the paper prints: of one period, or a level from one on."""

    first: int
    """First period that it is about."""
    last: int | None
    """Last period; none: the last of the panel."""
    rating: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RatingPanel:
    """Content of one panel."""

    title: str
    group: str
    """Word for the controller; panels of one group share dashes and the axis of ratings."""
    curves: tuple[RatingCurve, ...]
    printed: tuple[PrintedRating, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Looks:
    """Colours of set points and dashes of deflections, shared by all panels."""

    colours: dict[float, Colour]
    """Colour by set point z2 [rad]."""
    dashes: dict[str, dict[float, Dashes]]
    """Dashes by group, and by size of the deflection dz2 [rad]."""
    scales: dict[str, "RatingScale"]
    """Axis of ratings by group."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RatingScale:
    """Axis of the ratings of one group: of P^r, or of 1 - P^r where all are near one."""

    lost: bool
    """Whether 1 - P^r is drawn, logarithmically and with the best rating on top."""
    ends: tuple[float, float]
    """Values at the lower and the upper end [-]."""

    def of(self, rating: Floats) -> Floats:
        """Values that are drawn for some ratings."""
        return np.maximum(1.0 - rating, LEAST) if self.lost else rating

    def printed(self, rating: float) -> float:
        """Value that is drawn for a rating that the paper prints, to its digits."""
        return max(1.0 - rating, PRINTED_LEAST) if self.lost else rating

    def label(self, symbol: str) -> str:
        """Title of the axis, where `symbol` is that of the rating."""
        return f"1 - {symbol}" if self.lost else symbol


def looks_of(panels: Sequence[RatingPanel]) -> Looks:
    """Choose a colour for each set point, dashes for each deflection, and axes for each group."""
    z2 = sorted({curve.cell.z2 for panel in panels for curve in panel.curves})
    palette = style.COMPONENTS
    colours = {value: style.unit(palette[n % len(palette)]) for n, value in enumerate(z2)}
    dashes: dict[str, dict[float, Dashes]] = {}
    scales: dict[str, RatingScale] = {}
    for group in dict.fromkeys(panel.group for panel in panels):
        shown = [panel for panel in panels if panel.group == group]
        sizes = sorted({abs(curve.cell.dz2) for panel in shown for curve in panel.curves})
        dashes[group] = {size: DASHES[n % len(DASHES)] for n, size in enumerate(sizes)}
        scales[group] = _scale(shown)
    return Looks(colours=colours, dashes=dashes, scales=scales)


def _scale(panels: Sequence[RatingPanel]) -> RatingScale:
    """Axis that shows all curves and printed ratings of some panels."""
    curves = [curve for panel in panels for curve in panel.curves if len(curve.mean)]
    printed = [each.rating for panel in panels for each in panel.printed]
    lowest = min([*(float((each.mean - each.spread).min()) for each in curves), *printed, 1.0])
    if lowest < NEAR_ONE or not curves:
        low = max(0.0, GRAIN * float(np.floor(min(lowest, NEAR_ONE) / GRAIN - 0.5)))
        return RatingScale(lost=False, ends=(low, 1.004))
    lost = [max(1.0 - float(each.mean.max()), LEAST) for each in curves]
    least = min([*lost, PRINTED_LEAST]) if printed else min(lost)
    most = 2.0 * max(1.0 - lowest, PRINTED_LEAST if printed else LEAST)
    return RatingScale(lost=True, ends=(most, 0.5 * least))


def draw_ratings(panel: Axes, content: RatingPanel, looks: Looks, colour: str) -> None:
    """Draw the curves of one panel, with bands of their spread, and what the paper prints there.

    Args:
        panel: where to draw.
        content: curves and printed ratings.
        looks: colours, dashes and axes.
        colour: colour of the printed ratings.
    """
    scale = looks.scales[content.group]
    longest = max((len(curve.mean) for curve in content.curves), default=1)
    for curve in content.curves:
        periods = np.arange(1, len(curve.mean) + 1)
        ink = looks.colours[curve.cell.z2]
        dashes = looks.dashes[content.group][abs(curve.cell.dz2)]
        mean = scale.of(curve.mean)
        panel.plot(periods, mean, color=ink, linestyle=dashes, linewidth=1.2, zorder=3)
        panel.plot(periods, mean, ".", color=ink, markersize=3.5, zorder=3)
        if curve.spread.any():
            low, high = curve.mean - curve.spread, np.minimum(curve.mean + curve.spread, 1.0)
            band = scale.of(low), scale.of(high)
            panel.fill_between(periods, *band, color=ink, alpha=0.16, linewidth=0, zorder=1)
    last = max(longest, *(each.first for each in content.printed), SHORTEST)
    for each in content.printed:
        ends = [each.first, last if each.last is None else each.last]
        look = "x" if each.first == each.last else "-"
        at = [scale.printed(each.rating)] * 2
        panel.plot(ends, at, look, color=colour, markersize=6, linewidth=1.4, zorder=4)
    if not content.curves:
        panel.text(0.5, 0.5, "no run", transform=panel.transAxes, ha="center", color=colour)
    panel.set_xlim(0.5, last + 0.5)
    if scale.lost:
        panel.set_yscale("log")
    else:
        panel.locator_params(axis="y", nbins=6)
    panel.set_ylim(*scale.ends)
    panel.locator_params(axis="x", nbins=8, integer=True)


def ratings_figure(panels: Sequence[RatingPanel], title: str) -> Figure:
    """All panels in rows of three, with one legend.

    Args:
        panels: panels in order; printed ratings are drawn in black.
        title: title of the figure, which says what the rating is about.
    """
    looks, rows = looks_of(panels), -(-len(panels) // COLUMNS)
    with styled():
        size = (WIDTH_INCH, ROW_INCH * rows + LEGEND_INCH)
        figure = Figure(figsize=size, layout="constrained")
        FigureCanvasAgg(figure)
        for place, content in enumerate(panels):
            panel = figure.add_subplot(rows, COLUMNS, place + 1)
            panel.set_title(content.title, loc="left")
            draw_ratings(panel, content, looks, "black")
            panel.set_xlabel("oscillation period")
            panel.set_ylabel(looks.scales[content.group].label("$P^r$"))
        printed = any(panel.printed for panel in panels)
        handles = _handles(looks, printed)
        figure.legend(handles=handles, loc="outside lower center", ncols=5, frameon=False)
        figure.suptitle(title, fontsize=10.5)
    return figure


def _handles(looks: Looks, printed: bool) -> list[Line2D]:
    found = [
        Line2D([], [], color=colour, label=f"$z_2$ = {z2:g} rad")
        for z2, colour in looks.colours.items()
    ]
    for group, dashes in looks.dashes.items():
        for size, look in dashes.items():
            label = rf"{group}, $|\Delta z_2|$ = {size:g} rad"
            found.append(Line2D([], [], color="black", linestyle=look, label=label))
    paper = Line2D([], [], color="black", marker="x", label="paper")
    return [*found, paper] if printed else found
