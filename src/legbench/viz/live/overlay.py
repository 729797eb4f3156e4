"""Another run in the viewer: its joints and its leg, in a colour of its own, on the same t.

Everything lies below a run's own entities, so that the views that show those show it, too.
"""

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from legbench.kinematics import leg_points
from legbench.recording.reader import Recording
from legbench.signals import Floats
from legbench.viz import style
from legbench.viz.facts import Facts, facts_of
from legbench.viz.live._rerun import rr
from legbench.viz.live.leg2d import FREQ as LEG_FREQ
from legbench.viz.live.leg2d import PATH, hip_of
from legbench.viz.trace import Thinner, Tracer

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
    """Publishes the joints and the leg of another run."""

    def __init__(self, stream: rr.RecordingStream, other: Other) -> None:
        self._stream = stream
        self._other = other
        self.trace = Tracer(other.facts).extend(other.recording)

    def push(self) -> None:
        """Add all rows of the run."""
        self._push_joints()
        self._push_leg()

    def _push_joints(self) -> None:
        other, path = self._other, f"/series/joint/{self._other.key}"
        looks = rr.SeriesLines(
            names=[f"q1 {other.label}", f"q2 {other.label}"],
            colors=[other.colour] * 2,
            widths=[0.8] * 2,
            aggregation_policy="MinMax",
        )
        self._stream.log(path, looks, static=True)
        index = [rr.TimeColumn("t", duration=self.trace.time)]
        columns = rr.Scalars.columns(scalars=self.trace.joint.ravel())
        pairs = columns.partition(np.full(len(self.trace.time), 2))
        self._stream.send_columns(path, index, pairs)

    def _push_leg(self) -> None:
        other, path = self._other, f"{PATH}/{self._other.key}"
        kept = Thinner(LEG_FREQ).pick(self.trace.time)
        points = self._leg()[kept]
        colour = [*other.colour, OPACITY]
        lines = rr.LineStrips2D.from_fields(colors=[colour], radii=[SEGMENT], draw_order=6.0)
        tip = rr.Points2D.from_fields(colors=[colour], radii=[TIP], draw_order=7.0)
        self._stream.log(f"{path}/segments", lines, static=True)
        self._stream.log(f"{path}/tip", tip, static=True)
        index = [rr.TimeColumn("t", duration=self.trace.time[kept])]
        strips = rr.LineStrips2D.columns(strips=points.astype(np.float32))
        self._stream.send_columns(f"{path}/segments", index, strips)
        tips = rr.Points2D.columns(positions=points[:, 3])
        self._stream.send_columns(f"{path}/tip", index, tips)

    def _leg(self) -> Floats:
        """Positions of hip, knees and foot tip in the world (n, 4, 2) [m]."""
        hip = hip_of(self._other.recording, self._other.facts)
        return hip[:, None] + leg_points(self.trace.joint, self._other.facts.run.design.lengths)
