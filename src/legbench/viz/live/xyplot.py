"""An XY plot for rerun, which has none: axes drawn, y up, raw values on hover."""

from collections.abc import Sequence
from typing import final

import numpy as np
from numpy.typing import NDArray

from legbench.signals import Floats
from legbench.viz import style
from legbench.viz.live._rerun import rr, rrb
from legbench.viz.live.axes import FAINT, HAIR, HEIGHT, WIDTH, PlotSpec, Span, draw_axes

GROWTH = 0.25
"""Room added when data leave the axes, so that live axes are not redrawn at every slice."""


@final
class XYPlot:
    """One XY plot in a recording stream; its axes grow with the data."""

    def __init__(self, stream: rr.RecordingStream, spec: PlotSpec) -> None:
        self._stream = stream
        self._spec = spec
        self._limits: tuple[Span, Span] | None = None
        self._ends: dict[str, NDArray[np.float32]] = {}
        trail = rr.LineStrips2D.from_fields(radii=rr.Radius.ui_points(1.3), draw_order=20)
        stream.log(f"{spec.path}/data/trail", trail, static=True)
        head = rr.Points2D.from_fields(radii=rr.Radius.ui_points(5.0), draw_order=30)
        stream.log(f"{spec.path}/data/head", head, static=True)

    def cover(self, points: Floats) -> None:
        """Make room on the axes for points (n, 2); draws the axes when they change.

        Points that are not known, not numbers, need none.
        """
        points = points[np.isfinite(points).all(axis=1)]
        if not len(points):
            return
        low, high = points.min(axis=0).tolist(), points.max(axis=0).tolist()
        if self._limits is None:
            least, margin = self._spec.least, self._spec.margin
            x, y = (_widened(low[i], high[i], least[i], margin) for i in range(2))
            self._set(x, y)
        else:
            x, y = self._limits
            self._set(_grown(x, low[0], high[0]), _grown(y, low[1], high[1]))

    def _set(self, x: Span, y: Span) -> None:
        if self._spec.equal:
            half = 0.5 * max(x[1] - x[0], y[1] - y[0])
            centres = 0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])
            x, y = ((centre - half, centre + half) for centre in centres)
        if (x, y) != self._limits:
            self._limits = (x, y)
            draw_axes(self._stream, self._spec, x, y)

    def push(self, time: Floats, path: Floats, colours: style.Colours) -> None:
        """Add the trajectory: `path` (n + 1, 2) starts at the last point of the push before."""
        index = [rr.TimeColumn("t", duration=time)]
        data = f"{self._spec.path}/data"
        segments = np.stack([path[:-1], path[1:]], axis=1).astype(np.float32)
        trail = rr.LineStrips2D.columns(strips=segments, colors=colours)
        self._stream.send_columns(f"{data}/trail", index, trail)
        head = rr.Points2D.columns(positions=path[1:].astype(np.float32), colors=colours)
        self._stream.send_columns(f"{data}/head", index, head)

    def overlay(self, key: str, time: Floats, points: Floats, colour: style.Rgb) -> None:
        """Draw more of another run's trajectory (n, 2) thinly over the trail, in one colour."""
        index = [rr.TimeColumn("t", duration=time)]
        path: NDArray[np.float32] = points.astype(np.float32)
        trail, head = (f"{self._spec.path}/data/{key}/{name}" for name in ("trail", "head"))
        if key not in self._ends:
            radius = rr.Radius.ui_points(0.7)
            looks = rr.LineStrips2D.from_fields(colors=[colour], radii=radius, draw_order=25)
            self._stream.log(trail, looks, static=True)
            radius = rr.Radius.ui_points(3.5)
            dot = rr.Points2D.from_fields(colors=[colour], radii=radius, draw_order=31)
            self._stream.log(head, dot, static=True)
        before = self._ends.get(key, path[:1])
        segments = np.stack([np.concatenate([before, path[:-1]]), path], axis=1)
        self._stream.send_columns(trail, index, rr.LineStrips2D.columns(strips=segments))
        self._stream.send_columns(head, index, rr.Points2D.columns(positions=path))
        self._ends[key] = path[-1:].copy()

    def backdrop(self, points: Floats, others: Floats | None = None) -> None:
        """Draw the whole run (n, 2) faintly behind everything, with axes that fit it.

        Points (m, 2) that other runs reach have room, too.
        """
        self._limits = None
        self.cover(points if others is None else np.concatenate([points, others]))
        strip = points.astype(np.float32)[None]
        whole = rr.LineStrips2D(strip, colors=[FAINT], radii=HAIR, draw_order=5)
        self._stream.log(f"{self._spec.path}/data/backdrop", whole, static=True)


def _widened(low: float, high: float, least: float, margin: float) -> Span:
    """The range with a margin on both sides, never empty."""
    centre, half = 0.5 * (low + high), 0.5 * max(high - low, least)
    half = max(half * (1.0 + 2.0 * margin), 1e-6 * max(1.0, abs(centre)))
    return (centre - half, centre + half)


def _grown(old: Span, low: float, high: float) -> Span:
    """The range with room beyond the sides that the data have left."""
    room = GROWTH * (max(high, old[1]) - min(low, old[0]))
    return (old[0] if old[0] <= low else low - room, old[1] if high <= old[1] else high + room)


def plot_view(spec: PlotSpec, others: Sequence[str] = ()) -> rrb.Spatial2DView:
    """The view of an XY plot: axes and head at the cursor's time, the trail before it.

    Other runs, by the keys of their overlays, have a trail as long.
    """
    trail = rrb.VisibleTimeRange(
        "t",
        start=rrb.TimeRangeBoundary.cursor_relative(seconds=-spec.trail),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )
    trails = [f"{spec.path}/data/{name}" for name in ("trail", *(f"{o}/trail" for o in others))]
    return rrb.Spatial2DView(
        origin=spec.path,
        name=spec.title,
        overrides={path: rrb.VisibleTimeRanges([trail]) for path in trails},
        visual_bounds=rrb.VisualBounds2D(
            x_range=(-0.75, WIDTH + 0.25), y_range=(-HEIGHT - 0.4, 0.95)
        ),
    )
