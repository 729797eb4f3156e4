"""Print figures: the three planes of Figs. 4 and 6."""

from pathlib import Path

import numpy as np

from legbench.errors import ConfigError
from legbench.metrics.modal import trajectory
from legbench.recording.reader import Recording
from legbench.signals import Floats
from legbench.viz import style
from legbench.viz._matplotlib import (
    Axes,
    BoundaryNorm,
    Figure,
    FigureCanvasAgg,
    Line2D,
    LineCollection,
    ListedColormap,
    ScalarMappable,
    styled,
)
from legbench.viz.colouring import Colouring, colouring_of
from legbench.viz.drafts import draft_of, require_rows
from legbench.viz.facts import Facts, facts_of

SUFFIXES = (".png", ".svg", ".pdf")
SIZE = (10.0, 3.7)
"""[inch]"""
DPI = 200
FAINT_COLOUR = (0.80, 0.80, 0.82)


def phase_figure(recording: Recording) -> Figure:
    """Foot tip in polar coordinates, joint space with w1 and w2, modal phase, side by side.

    A jump shows its last three jumps in the colours of stance and flight, earlier rows faintly;
    any other run is coloured by oscillation period.

    Raises:
        FormatError: the run's manifest cannot be drawn.
        RecordingError: the run has no rows.
    """
    require_rows(recording)
    facts = facts_of(recording.manifest, recording.path)
    moved, colouring = trajectory(recording), colouring_of(recording)
    radial = np.stack([moved.modal[:, 1], moved.modal_rate[:, 1]], axis=-1)
    planes = (
        (style.POLAR, style.X1, style.X2, moved.polar),
        (style.JOINT, style.Q1, style.Q2, recording["joint_pos"]),
        (style.MODAL, style.Z2, style.DZ2, radial),
    )
    with styled():
        figure = Figure(figsize=SIZE, layout="constrained")
        FigureCanvasAgg(figure)
        panels = [figure.add_subplot(1, 3, place) for place in (1, 2, 3)]
        for panel, letter, (title, x, y, points) in zip(panels, "abc", planes, strict=True):
            panel.set_title(f"({letter}) {title}", loc="left")
            panel.set_xlabel(x.math)
            panel.set_ylabel(y.math)
            panel.locator_params(axis="x", nbins=4)
            panel.locator_params(axis="y", nbins=5)
            _draw(panel, points, colouring)
        _at_least(panels[0], style.POLAR_LEAST)
        _draw_modes(panels[1], facts, recording["joint_pos"])
        _explain(figure, panels, colouring)
        title = " — ".join(filter(None, [facts.headline, colouring.ratings]))
        figure.suptitle(title, fontsize=10.5)
    return figure


def save_figure(figure: Figure, path: Path) -> Path:
    """Write a figure as .png, .svg or .pdf, the same bytes every time.

    Raises:
        ConfigError: any other suffix.
        RecordingError: nothing can be written there.
    """
    kind = path.suffix.lower()
    if kind not in SUFFIXES:
        known = ", ".join(SUFFIXES)
        raise ConfigError(f"a figure cannot be written as {path.name!r}; choose from {known}")
    undated = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    with draft_of(path) as draft, styled():
        figure.savefig(draft, format=kind[1:], dpi=DPI, metadata=undated[kind])
    return path


def _draw(panel: Axes, points: Floats, colouring: Colouring) -> None:
    """The whole run faintly, the highlighted stretches over it.

    Lines are pixels in vector files, which else would weigh megabytes.
    """
    panel.plot(*points.T, color=FAINT_COLOUR, linewidth=0.5, zorder=1, rasterized=True)
    lines = LineCollection(
        [points[stretch.first : stretch.stop + 1] for stretch in colouring.stretches],
        colors=[stretch.colour for stretch in colouring.stretches],
        linewidths=1.3,
        capstyle="round",
        zorder=3,
        rasterized=True,
    )
    panel.add_collection(lines)
    panel.margins(0.06)


def _at_least(panel: Axes, span: float) -> None:
    """Show a range of x no shorter than this."""
    low, high = panel.get_xlim()
    if high - low < span:
        centre = 0.5 * (low + high)
        panel.set_xlim(centre - 0.5 * span, centre + 0.5 * span)


def _draw_modes(panel: Axes, facts: Facts, joint: Floats) -> None:
    """w1 and w2 through the rest posture, as long as the motion is wide; equal axes."""
    panel.set_aspect("equal", adjustable="datalim")
    low, high = joint.min(axis=0), joint.max(axis=0)
    centre = 0.5 * (low + high) if facts.rest is None else np.array(facts.rest)
    reach = 0.62 * float((high - low).max())
    for name, colour, arm in (
        ("$w_1$", style.MODE_1, np.array([1.0, 1.0])),
        ("$w_2$", style.MODE_2, np.array([1.0, -1.0])),
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


def _explain(figure: Figure, panels: list[Axes], colouring: Colouring) -> None:
    """A colour bar of the periods, or a legend of stance and flight."""
    if colouring.periods:
        colours = ListedColormap([stretch.colour for stretch in colouring.stretches])
        edges = np.arange(colouring.periods + 1) + 0.5
        scale = ScalarMappable(BoundaryNorm(edges, colours.N), colours)
        step = max(1, -(-colouring.periods // 7))
        ticks = list(range(1, colouring.periods + 1, step))
        bar = figure.colorbar(scale, ax=panels, label="oscillation period", ticks=ticks, pad=0.01)
        bar.minorticks_off()
    elif colouring.stretches:
        known = (("stance", style.STANCE), ("flight", style.FLIGHT))
        lines = [Line2D([], [], color=style.unit(colour), label=name) for name, colour in known]
        lines.append(Line2D([], [], color=FAINT_COLOUR, label="earlier"))
        figure.legend(handles=lines, loc="outside lower center", ncols=3, frameon=False)
