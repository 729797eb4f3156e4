"""Publishing of a run in rerun: the only code that knows which entity carries what.

A run is published whole, or in slices while it is still going on; both give the same entities
with the same rows.
"""

from collections.abc import Sequence
from typing import final

from legbench.metrics.source import Recorded
from legbench.metrics.summary import Summary
from legbench.viz.facts import Facts, as_markdown
from legbench.viz.force_axis import ForceAxis, force_axis, live_force_axis
from legbench.viz.live._rerun import rr
from legbench.viz.live.blueprint import blueprint
from legbench.viz.live.key import log_state_key
from legbench.viz.live.leg2d import Leg2D, hip_of, leg_room
from legbench.viz.live.overlay import Other, Overlay
from legbench.viz.live.plots import Plots
from legbench.viz.live.rating_series import RatingSeries
from legbench.viz.live.scene import ModelScene
from legbench.viz.live.series import Series
from legbench.viz.live.states import States
from legbench.viz.playback import WHOLE, Playback
from legbench.viz.trace import Tracer, stance_of

WINDOW_ROWS = 1 << 18
"""Rows that are published at once: four minutes at 1 kHz, 200 MB while they are on their way."""
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
        rows: int = WINDOW_ROWS,
    ) -> None:
        """Prepare the entities of a run.

        Args:
            stream: stream to publish into.
            facts: what the run says of itself.
            live: whether the run goes on.
            others: runs that are laid over it.
            playback: how the viewer plays it.
            rows: rows of the other runs that are published at once.
        """
        self._stream = stream
        self._facts = facts
        self._live = live
        self._others = tuple(others)
        self._playback, self._rows = playback, rows
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
        log_state_key(stream, facts)
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
            self._facts,
            room=room,
            span=(float(rows.time[0]), float(rows.time[-1])),
            force=self._force_axis(rows),
            live=self._live,
            others=keys,
            playback=self._playback,
        )
        self._stream.send_blueprint(layout)
        self._laid_out = True

    def _force_axis(self, rows: Recorded) -> ForceAxis | None:
        """Axis of the contact force, for these rows or for those of a run that goes on."""
        run = self._facts.run
        if self._live:
            return live_force_axis(run.design.total_mass)
        return force_axis(rows["contact_force"], stance_of(rows, run.setup.kind))

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
        """Add what only a finished run has, and all rows of the other runs."""
        for other in self._others:
            overlay = Overlay(self._stream, other)
            for part in other.recording.windows(self._rows):
                self._plots.overlay(other.key, overlay.push(part), other.colour)
        self._plots.finish()
        self._rating.finish()
