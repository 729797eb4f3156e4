"""Axes of an XY plot in rerun: frame, grid, ticks, labels and the modal lines.

The data live in their own units under `<path>/data`; the static transform put there stretches
them into a box of `WIDTH` x `HEIGHT` plot units whose lower left corner is the plot's origin.
"""

from dataclasses import dataclass

import numpy as np

from legbench.signals import Floats
from legbench.viz import style
from legbench.viz.live._rerun import rr
from legbench.viz.live.key import log_key
from legbench.viz.ticks import tick_labels, ticks

WIDTH = HEIGHT = 4.0
"""Width and height of the plot's box [plot units]."""
STRONG, FAINT = (*style.GREY, 170), (*style.GREY, 60)
HAIR, LINE, NONE = rr.Radius.ui_points(0.5), rr.Radius.ui_points(0.8), rr.Radius.ui_points(0.0)
"""Radii in screen points: the transform stretches scene units unevenly."""

Span = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlotSpec:
    """Specification of an XY plot: entity path, axis titles, ranges and trail."""

    path: str
    title: str
    x: style.AxisTitle
    y: style.AxisTitle
    equal: bool = False
    """Whether one unit is as long on both axes."""
    through: tuple[float, float] | None = None
    """Point that the modal lines w1 and w2 pass; none draws no lines."""
    margin: float = 0.06
    """Free room around the data, as a share of their range."""
    least: tuple[float, float] = (0.0, 0.0)
    """Shortest ranges of x and y, so that very small motion is not magnified."""
    trail: float = 2.0
    """Time that the coloured trail covers [s]."""
    key: tuple[tuple[str, style.Rgb], ...] = ()
    """Words that explain the colours of the trail, each in its colour."""


def draw_axes(stream: rr.RecordingStream, spec: PlotSpec, x: Span, y: Span) -> None:
    """Stretch the ranges x and y into the box and draw everything that does not move."""
    sx, sy = WIDTH / (x[1] - x[0]), HEIGHT / (y[1] - y[0])
    stretch = rr.Transform3D(
        translation=[-x[0] * sx, y[0] * sy, 0.0], mat3x3=np.diag([sx, -sy, 1.0])
    )
    stream.log(f"{spec.path}/data", stretch, static=True)
    x_ticks, y_ticks = ticks(*x, count=4), ticks(*y)
    columns = [(value - x[0]) * sx for value in x_ticks]
    rows = [-(value - y[0]) * sy for value in y_ticks]
    stream.log(f"{spec.path}/axes/grid", _grid(columns, rows), static=True)
    placed = [((at, 0.14), text) for at, text in zip(columns, tick_labels(x_ticks), strict=True)]
    placed += [
        ((-0.36, at - 0.09), text) for at, text in zip(rows, tick_labels(y_ticks), strict=True)
    ]
    placed += [((0.5 * WIDTH, 0.46), spec.x.text), ((0.0, -HEIGHT - 0.24), spec.y.text)]
    stream.log(f"{spec.path}/axes/labels", _texts(placed), static=True)
    log_key(stream, f"{spec.path}/axes/key", spec.key, WIDTH, -HEIGHT - 0.24)
    if spec.through is not None:
        _draw_modes(stream, spec.path, spec.through, (x, y))


def _grid(columns: list[float], rows: list[float]) -> rr.LineStrips2D:
    frame = [[0.0, 0.0], [WIDTH, 0.0], [WIDTH, -HEIGHT], [0.0, -HEIGHT], [0.0, 0.0]]
    lines = [frame]
    lines += [[[at, 0.0], [at, -HEIGHT]] for at in columns]
    lines += [[[0.0, at], [WIDTH, at]] for at in rows]
    colours = [STRONG] + [FAINT] * (len(lines) - 1)
    return rr.LineStrips2D(lines, colors=colours, radii=HAIR, draw_order=1)


def _texts(placed: list[tuple[tuple[float, float], str]]) -> rr.Points2D:
    return rr.Points2D(
        [point for point, _ in placed],
        labels=[text for _, text in placed],
        colors=[STRONG],
        radii=NONE,
        show_labels=True,
    )


def _draw_modes(
    stream: rr.RecordingStream, path: str, through: tuple[float, float], spans: tuple[Span, Span]
) -> None:
    """The lines w1 and w2 through a point, from edge to edge, named where they leave to the right.

    They run at slopes 1 and -1 in data units, so equal axes show them at right angles.
    """
    x, y = spans
    if not (x[0] < through[0] < x[1] and y[0] < through[1] < y[1]):
        return
    colours = [style.MODE_1, style.MODE_2]
    strips = [_across(through, spans, slope) for slope in (1.0, -1.0)]
    lines = rr.LineStrips2D(strips, colors=colours, radii=LINE, draw_order=10)
    stream.log(f"{path}/data/modes", lines, static=True)
    aside = np.array([0.035 * (x[1] - x[0]), 0.0])
    names = rr.Points2D(
        [strip[1] + aside for strip in strips],
        labels=["w1", "w2"],
        colors=colours,
        radii=NONE,
        show_labels=True,
    )
    stream.log(f"{path}/data/modes/names", names, static=True)


def _across(through: tuple[float, float], spans: tuple[Span, Span], slope: float) -> Floats:
    """Left and right end (2, 2) of the line of that slope within the box."""
    (x_low, x_high), (y_low, y_high) = spans
    down, up = (y_low, y_high) if slope > 0.0 else (y_high, y_low)
    back = max(x_low - through[0], (down - through[1]) / slope)
    ahead = min(x_high - through[0], (up - through[1]) / slope)
    return np.array([[through[0] + s, through[1] + slope * s] for s in (back, ahead)])
