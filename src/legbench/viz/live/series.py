"""Signals over time, at the recording's full rate."""

from dataclasses import dataclass
from typing import final

import numpy as np

from legbench.signals import Floats, Signal
from legbench.viz import style
from legbench.viz.facts import Facts
from legbench.viz.live._rerun import rr
from legbench.viz.trace import TracedRows

COMPONENTS = (style.FIRST, style.SECOND)
TARGETS = (style.FIRST_FAINT, style.SECOND_FAINT)
PEAKS = "MinMax"
"""Aggregation of a zoomed-out series; the viewer's default, the average, hides every peak."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A signal as one or two lines of a time series view."""

    signal: str
    path: str
    names: tuple[str, ...]
    colours: tuple[style.Rgb, ...]
    width: float = 1.2


LINES = (
    Line(
        signal="command_pos",
        path="/series/joint/target",
        names=("motor 1 target", "motor 2 target"),
        colours=TARGETS,
        width=0.8,
    ),
    Line(signal="joint_pos", path="/series/joint/link", names=("q1", "q2"), colours=COMPONENTS),
    Line(
        signal="spring_torque",
        path="/series/torque",
        names=("spring 1", "spring 2"),
        colours=COMPONENTS,
    ),
    Line(
        signal="contact_force",
        path="/series/force",
        names=("forward", "up"),
        colours=(style.SECOND, style.ACCENT),
    ),
    Line(
        signal="energy",
        path="/series/energy",
        names=("potential", "kinetic"),
        colours=COMPONENTS,
    ),
    Line(
        signal="cycle_us",
        path="/series/cycle/cycle",
        names=("cycle",),
        colours=(style.GREY,),
        width=0.8,
    ),
    Line(
        signal="late_us",
        path="/series/cycle/late",
        names=("late",),
        colours=(style.STANCE,),
        width=0.8,
    ),
)

HEIGHTS = Line(
    signal="",
    path="/series/height",
    names=("hip", "foot"),
    colours=(style.TRUNK, style.ACCENT),
)


OWN = "/series/own"
"""Parent of the signals that the controller declared."""


def own_line(signal: Signal) -> Line:
    """A signal that a controller declared, one line a component."""
    count = len(signal.columns)
    return Line(
        signal=signal.name,
        path=f"{OWN}/{signal.name}",
        names=signal.components or (signal.name,),
        colours=tuple(style.COMPONENTS[place % len(style.COMPONENTS)] for place in range(count)),
    )


@final
class Series:
    """Publishes the signals over time."""

    def __init__(self, stream: rr.RecordingStream, facts: Facts) -> None:
        self._stream = stream
        self._lines = (*LINES, *map(own_line, facts.run.layout.own))
        for line in (*self._lines, HEIGHTS):
            looks = rr.SeriesLines(
                names=list(line.names),
                colors=list(line.colours),
                widths=[line.width] * len(line.names),
                aggregation_policy=PEAKS,
            )
            stream.log(line.path, looks, static=True)

    def push(self, trace: TracedRows) -> None:
        """Add every row; a signal that the run does not have is left out."""
        for line in self._lines:
            self._send(line, trace.time, trace.rows[line.signal])
        hip, foot = trace.rows["trunk_pos"][:, 1], trace.rows["foot_pos"][:, 1]
        self._send(HEIGHTS, trace.time, np.stack([hip, foot], axis=-1))

    def _send(self, line: Line, time: Floats, values: Floats) -> None:
        known = np.isfinite(values.reshape(len(time), -1)).all(axis=1)
        if not known.any():
            return
        rows = values[known]
        columns = rr.Scalars.columns(scalars=rows.ravel())
        if len(line.names) > 1:
            columns = columns.partition(np.full(len(rows), len(line.names)))
        index = [rr.TimeColumn("t", duration=time[known])]
        self._stream.send_columns(line.path, index, columns)
