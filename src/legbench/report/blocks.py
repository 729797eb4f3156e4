"""Figures of the page: blocks of panels, each panel an SVG of its own so that they stack."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

from legbench.metrics.analysis import Analysis, analysed
from legbench.metrics.source import Recorded
from legbench.viz import style
from legbench.viz.colouring import colouring_of
from legbench.viz.facts import facts_of
from legbench.viz.print._matplotlib import Axes
from legbench.viz.print.inline import INK, panel_svg
from legbench.viz.print.overlay import planes_of
from legbench.viz.print.planes import PLANES, draw_modes, draw_plane, on_both_grounds, widen
from legbench.viz.print.ratings import Dashes, Looks, RatingPanel, draw_ratings, looks_of
from legbench.viz.print.stills import Still, draw_still, stills_of

PLANE_INCH: Final = (3.5, 3.0)
RATING_INCH: Final = (3.5, 2.5)
STILL_INCH: Final = (1.3, 1.9)
"""Widths and heights of single panels [inch]; the page scales them."""
LINE_RATE: Final = 250.0
"""Points of a drawn line per second [Hz]: some 70 in an oscillation of the leg."""
FAINT: Final = (INK, 0.22)
AXES: Final = (("x₁ [rad]", "x₂ [m]"), ("q₁ [rad]", "q₂ [rad]"), ("z₂ [rad]", "dz₂/dt [rad/s]"))
"""Titles of the axes of the three planes, in characters that every font has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Swatch:
    """Entry of a legend: a short line with its meaning."""

    label: str
    colour: str
    """Colour in the words of CSS."""
    dashes: str = ""
    """Dashes in the words of SVG."""
    point: bool = False
    """Whether it is a cross instead of a line."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockPanel:
    """Panel of a figure."""

    title: str
    svg: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FigureBlock:
    """Figure of the page."""

    name: str
    title: str
    caption: str
    panels: tuple[BlockPanel, ...] = ()
    legend: tuple[Swatch, ...] = ()
    scale: tuple[str, ...] = ()
    """Colours of the oscillation periods, first to last."""
    columns: int = 3
    """Number of panels in a row where there is room."""


def planes_block(name: str, title: str, caption: str, recording: Recorded) -> FigureBlock:
    """Three planes of a run as in Figs. 4 and 6."""
    run = analysed(recording)
    facts, colouring = facts_of(run.description), on_both_grounds(colouring_of(run))
    step = _step(run)
    points = planes_of(run, facts.run.convention)

    def draw(place: int, panel: Axes) -> None:
        draw_plane(panel, points[place], colouring, 1.2, faint=FAINT, step=step)
        panel.set_xlabel(AXES[place][0])
        panel.set_ylabel(AXES[place][1])
        panel.locator_params(axis="x", nbins=5)
        panel.locator_params(axis="y", nbins=6)
        if place == 0:
            widen(panel, style.POLAR_LEAST)
        if place == 1:
            draw_modes(panel, facts, run["joint_pos"], ("w₁", "w₂"))

    panels = []
    for place, (title_of_plane, _, _) in enumerate(PLANES):
        heard = f"{title}: {title_of_plane}, {AXES[place][1]} over {AXES[place][0]}"
        svg = panel_svg(f"{name}-{place}", heard, PLANE_INCH, partial(draw, place))
        panels.append(BlockPanel(title=f"({'abc'[place]}) {title_of_plane}", svg=svg))
    modes = (
        Swatch(label="w₁, polar mode", colour=_css(style.unit(style.MODE_1)), dashes="5 2"),
        Swatch(label="w₂, radial mode", colour=_css(style.unit(style.MODE_2)), dashes="5 2"),
    )
    phases = (
        Swatch(label="stance", colour=_css(style.unit(style.STANCE))),
        Swatch(label="flight", colour=_css(style.unit(style.FLIGHT))),
    )
    rest = Swatch(label="the rest of the run", colour="color-mix(in srgb, currentColor 30%, #8880)")
    return FigureBlock(
        name=name,
        title=title,
        caption=caption,
        panels=tuple(panels),
        legend=(*(() if colouring.periods else phases), *modes, rest),
        scale=tuple(_css(each.colour) for each in colouring.stretches) if colouring.periods else (),
    )


def ratings_block(
    name: str, title: str, caption: str, contents: Sequence[RatingPanel]
) -> FigureBlock:
    """Panels of Fig. 5, with the ratings that the paper prints."""
    looks = looks_of(contents)

    def draw(content: RatingPanel, panel: Axes) -> None:
        draw_ratings(panel, content, looks, INK)
        panel.set_xlabel("oscillation period")
        panel.set_ylabel(looks.scales[content.group].label("Pʳ"))

    panels = []
    for place, content in enumerate(contents):
        heard = f"{title}: rating of each oscillation period, {content.title}, "
        heard += f"{len(content.curves)} cells"
        svg = panel_svg(f"{name}-{place}", heard, RATING_INCH, partial(draw, content))
        panels.append(BlockPanel(title=content.title, svg=svg))
    printed = any(content.printed for content in contents)
    legend = _legend(looks, printed)
    return FigureBlock(name=name, title=title, caption=caption, panels=tuple(panels), legend=legend)


def stills_block(name: str, title: str, caption: str, recording: Recorded) -> FigureBlock | None:
    """Stills of one jump as in Fig. 7; none where the run has no complete jump with its height."""
    stills = stills_of(recording)
    if not stills:
        return None

    def draw(still: Still, panel: Axes) -> None:
        draw_still(panel, still, stills)

    panels = []
    for place, still in enumerate(stills):
        state = "stance" if still.stance else "flight"
        heard = f"the leg {1e3 * still.time:.0f} ms after the lower apex, in {state}"
        svg = panel_svg(f"{name}-{place}", heard, STILL_INCH, partial(draw, still))
        panels.append(BlockPanel(title=f"{1e3 * still.time:.0f} ms", svg=svg))
    return FigureBlock(
        name=name,
        title=title,
        caption=caption,
        panels=tuple(panels),
        columns=len(panels),
        legend=(
            Swatch(label="foot on the ground", colour=_css(style.unit(style.STANCE))),
            Swatch(label="foot in the air", colour=_css(style.unit(style.FLIGHT))),
            Swatch(label="bar, trunk to shank", colour=_css(style.unit(style.BAR_GREEN))),
            Swatch(label="bar, thigh to foot", colour=_css(style.unit(style.BAR_BLACK))),
        ),
    )


def without_panels(name: str, title: str, why: str) -> FigureBlock:
    """Figure that cannot be drawn, with the reason as its caption."""
    return FigureBlock(name=name, title=title, caption=f"Not drawn: {why}.")


def relabelled(block: FigureBlock, first: str) -> FigureBlock:
    """Return a block whose panels are lettered from `first` on."""
    shift = ord(first) - ord("a")
    panels = tuple(
        replace(panel, title=f"({chr(ord(panel.title[1]) + shift)}{panel.title[2:]}")
        for panel in block.panels
    )
    return replace(block, panels=panels)


def _step(run: Analysis) -> int:
    """Rows from one point of a drawn line to the next."""
    period = run.description.period or 1e-3
    return max(1, round(1.0 / (LINE_RATE * period)))


def _legend(looks: Looks, printed: bool) -> tuple[Swatch, ...]:
    found = [
        Swatch(label=f"z₂ = {z2:g} rad", colour=_css(colour))
        for z2, colour in looks.colours.items()
    ]
    for group, dashes in looks.dashes.items():
        for size, look in dashes.items():
            label = f"{group}, |Δz₂| = {size:g} rad"
            found.append(Swatch(label=label, colour="currentColor", dashes=_svg_dashes(look)))
    if printed:
        found.append(Swatch(label="printed in the paper", colour="currentColor", point=True))
    return tuple(found)


def _svg_dashes(look: Dashes) -> str:
    return "" if isinstance(look, str) else " ".join(f"{each:g}" for each in look[1])


def _css(colour: tuple[float, float, float]) -> str:
    red, green, blue = (round(255 * each) for each in colour)
    return f"#{red:02x}{green:02x}{blue:02x}"
