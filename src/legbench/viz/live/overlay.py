"""Another run in the viewer: its joints and its leg, in a colour of its own, on the same t.

Everything lies below a run's own entities, so that the views that show those show it, too.
"""

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from legbench.kinematics import leg_points
from legbench.metrics.source import Recorded
from legbench.recording.reader import Recording
from legbench.viz import style
from legbench.viz.facts import Facts, facts_of
from legbench.viz.live._rerun import rr
from legbench.viz.live.leg2d import FREQ as LEG_FREQ
from legbench.viz.live.leg2d import PATH, TRUNK_LINE, hip_of, trunk_lines
from legbench.viz.trace import Thinner, TracedRows, Tracer

COLOURS: tuple[style.Rgb, ...] = ((200, 150, 198), (196, 176, 130), (130, 180, 150))
"""Colours of the other runs in turn, pale on dark and light grounds; the fourth has the first."""
SEGMENT, TIP = 0.0028, 0.0045
"""Radii of segments and foot tip [m]."""
OPACITY = 170
"""Opacity of the other run's leg [of 255]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Other:
    """Another run to show."""

    recording: Recording
    facts: Facts
    place: int
    """Index of this run among the other runs, in the order given, from 0."""

    @property
    def key(self) -> str:
        """Part of the entity paths that belongs to this run alone."""
        return f"other_{self.place + 1}"

    @property
    def name(self) -> str:
        """Title of the run: plant, linkage and design."""
        return self.facts.run.title

    @property
    def label(self) -> str:
        """Short name of the run for legends with little room."""
        return f"other {self.place + 1}"

    @property
    def colour(self) -> style.Rgb:
        """Colour of everything that is drawn of this run."""
        return COLOURS[self.place % len(COLOURS)]


def other_of(recording: Recording, place: int, facts: Facts) -> Other:
    """Another run to show beside the run of `facts`, whose modal convention it is shown in.

    Raises:
        FormatError: it describes no leg.
    """
    own = facts_of(recording.description)
    run = replace(own.run, convention=facts.run.convention)
    return Other(recording=recording, facts=replace(own, run=run), place=place)


@final
class Overlay:
    """Publishes the joints and the leg of another run, in consecutive parts of it."""

    def __init__(self, stream: rr.RecordingStream, other: Other) -> None:
        self._stream, self._other = stream, other
        self._tracer, self._thinner = Tracer(other.facts), Thinner(LEG_FREQ)
        self._joints, self._leg = f"/series/joint/{other.key}", f"{PATH}/{other.key}"
        self._lay_out()

    def push(self, rows: Recorded) -> TracedRows:
        """Add the rows that follow those before, and return them with what was derived."""
        trace = self._tracer.extend(rows)
        self._push_joints(trace)
        self._push_leg(trace)
        return trace

    def _lay_out(self) -> None:
        """Say once how everything looks."""
        other = self._other
        looks = rr.SeriesLines(
            names=[f"q1 {other.label}", f"q2 {other.label}"],
            colors=[other.colour] * 2,
            widths=[0.8] * 2,
            aggregation_policy="MinMax",
        )
        self._stream.log(self._joints, looks, static=True)
        colour = [*other.colour, OPACITY]
        lines = rr.LineStrips2D.from_fields(colors=[colour], radii=[SEGMENT], draw_order=6.0)
        tip = rr.Points2D.from_fields(colors=[colour], radii=[TIP], draw_order=7.0)
        trunk = rr.LineStrips2D(
            trunk_lines(), colors=[colour], radii=[0.6 * TRUNK_LINE], draw_order=5.0
        )
        for name, what in (("segments", lines), ("tip", tip), ("trunk/box", trunk)):
            self._stream.log(f"{self._leg}/{name}", what, static=True)

    def _push_joints(self, trace: TracedRows) -> None:
        index = [rr.TimeColumn("t", duration=trace.time)]
        columns = rr.Scalars.columns(scalars=trace.joint.ravel())
        pairs = columns.partition(np.full(len(trace.time), 2))
        self._stream.send_columns(self._joints, index, pairs)

    def _push_leg(self, trace: TracedRows) -> None:
        kept = self._thinner.pick(trace.time)
        if len(kept) == 0:
            return
        facts = self._other.facts
        hip = hip_of(trace.rows, facts)[kept]
        points = hip[:, None] + leg_points(trace.joint[kept], facts.run.design.lengths)
        index = [rr.TimeColumn("t", duration=trace.time[kept])]
        strips = rr.LineStrips2D.columns(strips=points.astype(np.float32))
        self._stream.send_columns(f"{self._leg}/segments", index, strips)
        tips = rr.Points2D.columns(positions=points[:, 3])
        self._stream.send_columns(f"{self._leg}/tip", index, tips)
        moved = rr.Transform3D.columns(translation=np.pad(hip, ((0, 0), (0, 1))))
        self._stream.send_columns(f"{self._leg}/trunk", index, moved)
