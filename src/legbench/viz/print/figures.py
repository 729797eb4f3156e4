"""Print figures: the three planes of Figs. 4 and 6, and the controller's own signals below."""

from collections.abc import Sequence

from legbench.metrics.analysis import analysed
from legbench.metrics.source import Recorded
from legbench.viz import style
from legbench.viz.colouring import colouring_of
from legbench.viz.drafts import require_rows
from legbench.viz.facts import facts_of
from legbench.viz.names import names_of
from legbench.viz.print._matplotlib import Figure, FigureCanvasAgg, styled
from legbench.viz.print.legend import explain
from legbench.viz.print.overlay import (
    draw_differences,
    draw_other,
    planes_of,
)
from legbench.viz.print.own_signals import draw_own_signals, own_signals_of
from legbench.viz.print.panels import panels_of, size_of
from legbench.viz.print.planes import PLANES, draw_modes, draw_plane, widen

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
    points, own = planes_of(run, facts.run.convention), len(own_signals_of(run))
    with styled():
        figure = Figure(figsize=size_of(bool(against), own), layout="constrained")
        FigureCanvasAgg(figure)
        rows = panels_of(figure, bool(against), own)
        panels = rows.planes
        for panel, letter, (title, x, y), plane in zip(panels, "abc", PLANES, points, strict=True):
            panel.set_title(f"({letter}) {title}", loc="left")
            panel.set_xlabel(x.math)
            panel.set_ylabel(y.math)
            panel.locator_params(axis="x", nbins=4)
            panel.locator_params(axis="y", nbins=5)
            draw_plane(panel, plane, colouring, WIDE if against else WIDTH)
        for place, other in enumerate(others):
            draw_other(panels, other, facts.run.convention, place)
        if others:
            draw_differences(rows.differences, run, others)
        draw_own_signals(rows.own, len(panels) + len(rows.differences), run, others)
        widen(panels[0], style.POLAR_LEAST)
        draw_modes(panels[1], facts, run["joint_pos"])
        explain(figure, panels, colouring, names_of([run, *others]) if others else [])
        title = " — ".join(filter(None, [facts.headline, colouring.ratings]))
        figure.suptitle(title, fontsize=10.5)
    return figure
