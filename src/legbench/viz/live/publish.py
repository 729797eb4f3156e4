"""Publishing of a run in rerun: the only code that knows which entity carries what.

A run is published whole, or in slices while it is still going on; both give the same entities
with the same rows.
"""

from collections.abc import Sequence
from typing import final

from legbench.metrics.source import Recorded
from legbench.metrics.summary import Summary
from legbench.viz.facts import Facts, as_markdown
from legbench.viz.live._rerun import rr
from legbench.viz.live.blueprint import blueprint
from legbench.viz.live.leg2d import Leg2D, hip_of, leg_room
from legbench.viz.live.overlay import Other, Overlay
from legbench.viz.live.plots import Plots
from legbench.viz.live.rating_series import RatingSeries
from legbench.viz.live.scene import ModelScene
from legbench.viz.live.series import Series
from legbench.viz.live.states import States
from legbench.viz.playback import WHOLE, Playback
from legbench.viz.trace import Tracer

APPLICATION = "legbench"
"""Application id under which the viewer keeps the layout that a user has arranged."""


@final
class Publisher:
    """Publishes consecutive rows of one run into a recording stream."""

    def __init__(
        self,
        stream: rr.RecordingStream,
        facts: Facts,
        *,
        live: bool = False,
        others: Sequence[Other] = (),
        playback: Playback = WHOLE,
    ) -> None:
        self._stream = stream
        self._facts = facts
        self._live = live
        self._others = tuple(others)
        self._playback = playback
        self._tracer = Tracer(facts)
        self._laid_out = False
        self._plots, self._rating = Plots(stream, facts), RatingSeries(stream, facts)
        self._sections = (
            self._plots,
            Leg2D(stream, facts),
            ModelScene(stream, facts),
            States(stream, facts),
            Series(stream, facts),
            self._rating,
        )
        self.describe(facts)

    def describe(self, facts: Facts, summary: Summary | None = None) -> None:
        """Show a run's facts; called again once the run has ended and is rated."""
        others = [
            f"{other.label}: {other.name}, run `{other.facts.run.id}`" for other in self._others
        ]
        text = as_markdown(facts, summary, others)
        document = rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
        self._stream.log("/run", document, static=True)

    def lay_out(self, rows: Recorded) -> None:
        """Send the layout once, with views that have room for these rows."""
        if self._laid_out:
            return
        hip = hip_of(rows, self._facts)
        room = leg_room(self._facts, hip, live=self._live)
        keys = [other.key for other in self._others]
        layout = blueprint(
            self._facts, room=room, live=self._live, others=keys, playback=self._playback
        )
        self._stream.send_blueprint(layout)
        self._laid_out = True

    def pass_over(self, rows: Recorded) -> None:
        """Leave rows out that come before those that are shown; their periods count."""
        if len(rows.time):
            self._tracer.extend(rows)

    def push(self, rows: Recorded) -> None:
        """Add the rows that follow those pushed before."""
        if len(rows.time) == 0:
            return
        trace = self._tracer.extend(rows)
        self.lay_out(rows)
        for section in self._sections:
            section.push(trace)

    def finish(self) -> None:
        """Add what only a finished run has, and the other runs as a whole."""
        for other in self._others:
            overlay = Overlay(self._stream, other)
            overlay.push()
            self._plots.overlay(other.key, overlay.trace, other.colour)
        self._plots.finish()
        self._rating.finish()
