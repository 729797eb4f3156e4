"""Print figure of runs laid over each other at an event: motion over time, phase plane, ratings."""

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from legbench.kinematics import joint_to_modal, polar_angle
from legbench.metrics.analysis import Analysis
from legbench.metrics.events import CommonEvent
from legbench.metrics.side_by_side import BEFORE, SideBySide
from legbench.viz import style
from legbench.viz.drafts import require_rows
from legbench.viz.names import names_of
from legbench.viz.print._matplotlib import Axes, Figure, FigureCanvasAgg, styled
from legbench.viz.print.overlay import LOOKS

SIZE: Final = (10.0, 6.0)
"""Width and height of the figure [inch]."""
FIRST: Final = style.unit(style.STANCE)
LEAST: Final = 1e-9
"""Smallest 1 - P^r that is drawn [-]: beyond nine digits there is noise."""
MARKERS: Final = {"stance": "o", "flight": "^", "periods": "s"}


def aligned_figure(runs: Sequence[Analysis], found: SideBySide, span: float) -> Figure:
    """Draw z2 and x1 over the time since the event, the modal plane, and what ratings lack of one.

    Args:
        runs: the runs, the first in colour, the others dashed.
        found: the event, its times and the figures of the runs.
        span: time after the event that is drawn [s].

    Raises:
        RecordingError: a run has no rows, or knows no link angles.
    """
    for run in runs:
        require_rows(run)
    with styled():
        figure = Figure(figsize=SIZE, layout="constrained")
        FigureCanvasAgg(figure)
        grid = figure.add_gridspec(2, 3)
        radial, polar = figure.add_subplot(grid[0, :2]), figure.add_subplot(grid[1, :2])
        plane, ratings = figure.add_subplot(grid[0, 2]), figure.add_subplot(grid[1, 2])
        since = "time" if found.event is CommonEvent.CLOCK else f"time since {_named(found)}"
        for panel, title, x, y in (
            (radial, "(a) radial mode", f"{since} [s]", style.Z2.math),
            (plane, f"(b) {style.MODAL}", style.Z2.math, style.DZ2.math),
            (polar, "(c) polar angle of the foot", f"{since} [s]", style.X1.math),
            (ratings, "(d) ratings", "period or phase of the run", "$1 - P^r$ [-]"),
        ):
            panel.set_title(title, loc="left")
            panel.set_xlabel(x)
            panel.set_ylabel(y)
            panel.grid(alpha=0.25, linewidth=0.5)
        for place, (run, name) in enumerate(zip(runs, names_of(runs), strict=True)):
            _draw_motion((radial, plane, polar), run, found.times[place], span, place, name)
            _draw_ratings(ratings, found, place)
        for panel in (radial, polar):
            panel.axvline(0.0, color="0.3", linewidth=0.8, linestyle=(0, (1, 2)))
            panel.margins(x=0.0)
        ratings.set_yscale("log")
        ratings.locator_params(axis="x", integer=True)
        if math.isfinite(last := ratings.dataLim.x1):
            ratings.set_xlim(0.5, last + 0.5)
        marks, labels = ratings.get_legend_handles_labels()
        kinds = dict(zip(labels, marks, strict=True))  # One mark for each kind.
        if kinds:
            ratings.legend(kinds.values(), kinds.keys(), fontsize=7.5, framealpha=0.8)
        handles, labels = radial.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    return figure


def _named(found: SideBySide) -> str:
    """Name of the event with its number, where there can be several."""
    if found.event is CommonEvent.ACTION:
        return "the first control action"
    if found.number > 0:
        return f"{found.event.value} {found.number}"
    return f"{found.event.value} {-found.number} from the end"


def _look(place: int) -> dict[str, Any]:
    """Look of a run: the first drawn through, the others dashed over it."""
    if place == 0:
        return {"color": FIRST, "linewidth": 1.8, "zorder": 2}
    look = LOOKS[(place - 1) % len(LOOKS)]
    return {"color": look.colour, "linestyle": look.dashes, "linewidth": 0.9, "zorder": 3}


def _draw_motion(
    panels: tuple[Axes, Axes, Axes],
    run: Analysis,
    event: float,
    span: float,
    place: int,
    name: str,
) -> None:
    """Draw the rows around the event over the time since it, and in the modal plane."""
    first, stop = np.searchsorted(run.time, [event - BEFORE, event + span])
    rows = slice(int(first), int(stop))
    time, joint = run.time[rows] - event, run["joint_pos"][rows]
    convention = run.description.convention
    z2 = joint_to_modal(joint, convention)[:, 1]
    rate = joint_to_modal(run["joint_vel"][rows], convention)[:, 1]
    look = _look(place)
    panels[0].plot(time, z2, label=name.replace("$", r"\$"), **look)
    panels[1].plot(z2, rate, **look)
    panels[2].plot(time, polar_angle(joint), **look)


def _draw_ratings(panel: Axes, found: SideBySide, place: int) -> None:
    """Draw what each rating lacks of one, about the reference that the run is judged by."""
    summary = found.summaries[place]
    for kind, marker in MARKERS.items():
        values = np.array(getattr(summary, f"rating_{kind}"), dtype=np.float64)
        if not len(values):
            continue
        colour = _look(place)["color"]
        panel.plot(
            np.arange(1, len(values) + 1),
            np.maximum(1.0 - values, LEAST),
            color=colour,
            marker=marker,
            markersize=3.5,
            linestyle="none",
            fillstyle="full" if place == 0 else "none",
            label=kind,
        )
