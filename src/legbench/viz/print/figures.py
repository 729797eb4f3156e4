"""Print figures: the three planes of Figs. 4 and 6, and the controller's own signals below."""

from collections.abc import Sequence

from legbench.kinematics import ModalConvention
from legbench.metrics.analysis import Analysis, analysed
from legbench.metrics.source import Recorded
from legbench.signals import Floats
from legbench.viz import style
from legbench.viz.colouring import Colouring, colouring_of
from legbench.viz.drafts import require_rows
from legbench.viz.facts import facts_of
from legbench.viz.names import names_of
from legbench.viz.print._matplotlib import Axes, Figure, FigureCanvasAgg, LineCollection, styled
from legbench.viz.print.legend import explain
from legbench.viz.print.overlay import (
    draw_differences,
    draw_other,
    planes_of,
)
from legbench.viz.print.own_signals import draw_own_signals, own_signals_of
from legbench.viz.print.panels import panels_of, size_of
from legbench.viz.print.planes import FAINT, PLANES, draw_modes, widen
from legbench.viz.print.thinning import draw_line, plane_stride

MOST_TICKS = 3
"""Most intervals between ticks across a third of the page: labels such as -0.0025 fit between."""
WIDTH, WIDE = 1.3, 2.4
"""Widths of the coloured lines alone, and under the lines of another run [pt]."""


def phase_figure(recording: Recorded, against: Sequence[Recorded] = ()) -> Figure:
    """Foot tip in polar coordinates, joint space with w1 and w2, modal phase, side by side.

    A jump shows its last three jumps in the colours of stance and flight, earlier rows faintly;
    any other run is coloured by oscillation period. The signals that the controller declared have
    panels of their own below.

    Args:
        recording: the run.
        against: other runs, drawn dashed over it in its modal convention; their differences over
            time make a second row.

    Raises:
        FormatError: a run describes no leg.
        RecordingError: a run has no rows, or none at the time of another.
    """
    run, *others = (analysed(each) for each in (recording, *against))
    for each in (run, *others):
        require_rows(each)
    facts, colouring = facts_of(run.description), colouring_of(run)
    own, convention = len(own_signals_of(run)), facts.run.convention
    faint = planes_of(run, convention, slice(None, None, plane_stride(run.time)))
    bright = _bright(run, colouring, convention)
    with styled():
        figure = Figure(figsize=size_of(bool(against), own), layout="constrained")
        FigureCanvasAgg(figure)
        rows = panels_of(figure, bool(against), own)
        panels = rows.planes
        for place, (panel, letter, (title, x, y)) in enumerate(
            zip(panels, "abc", PLANES, strict=True)
        ):
            panel.set_title(f"({letter}) {title}", loc="left")
            panel.set_xlabel(x.math)
            panel.set_ylabel(y.math)
            panel.locator_params(axis="x", nbins=MOST_TICKS)
            panel.locator_params(axis="y", nbins=5)
            lines = [planes[place] for planes in bright]
            _draw(panel, faint[place], lines, colouring, WIDE if against else WIDTH)
        _draw_others(panels, rows.differences, run, others)
        draw_own_signals(rows.own, len(panels) + len(rows.differences), run, others)
        widen(panels[0], style.POLAR_LEAST)
        draw_modes(panels[1], facts, run["joint_pos"])
        explain(figure, panels, colouring, names_of([run, *others]) if others else [])
        title = " — ".join(filter(None, [facts.headline, colouring.ratings]))
        figure.suptitle(title, fontsize=10.5)
    return figure


def _bright(
    run: Recorded, colouring: Colouring, convention: ModalConvention
) -> list[tuple[Floats, Floats, Floats]]:
    """Points in the three planes of each stretch that is highlighted."""
    stretches = colouring.stretches
    step = 1
    if stretches:
        step = plane_stride(run.time[stretches[0].first : stretches[-1].stop])
    rows = [slice(stretch.first, stretch.stop + 1, step) for stretch in stretches]
    return [planes_of(run, convention, each) for each in rows]


def _draw_others(
    panels: Sequence[Axes], below: Sequence[Axes], run: Analysis, others: Sequence[Analysis]
) -> None:
    """Draw other runs over the planes, and how far apart they are below; of long runs, only one at
    a time has its signals in memory.
    """
    for place, other in enumerate(others):
        draw_other(panels, other, run.description.convention, place)
        other.forget()
    if others:
        run.forget()
        draw_differences(below, run, others)


def _draw(
    panel: Axes, points: Floats, lines: list[Floats], colouring: Colouring, width: float
) -> None:
    """The whole run faintly, the highlighted stretches over it.

    Lines are pixels in vector files, which else would weigh megabytes.
    """
    x, y = points.T
    draw_line(panel, x, y, color=FAINT, linewidth=0.5, zorder=1, rasterized=True)
    bright = LineCollection(
        lines,
        colors=[stretch.colour for stretch in colouring.stretches],
        linewidths=width,
        capstyle="round",
        zorder=3,
        rasterized=True,
    )
    panel.add_collection(bright)
    panel.margins(0.06)
