"""The rating P^r while a run goes on: one value at the end of each period or phase."""

from dataclasses import dataclass
from typing import final

import numpy as np

from legbench.design.setup import SUPPORTS
from legbench.design.statics import Support
from legbench.metrics.rating import alignment, deflection
from legbench.metrics.roles import STANCE
from legbench.metrics.rows import runs_of
from legbench.signals import Floats
from legbench.viz import style
from legbench.viz.facts import Facts
from legbench.viz.live._rerun import rr
from legbench.viz.trace import TracedRows

SHORTEST = 15
"""Stretches of fewer rows are contact chatter and belong to the stretch around them."""
ORIGIN = "/series/rating"
LANES = {"period": style.ACCENT, "stance": style.STANCE, "flight": style.FLIGHT}


@dataclass(slots=True)
class RatedRows:
    """Rows of one period or phase that have been seen so far."""

    key: int
    time: float
    """Time of the first row [s]."""
    rows: int
    rated: int
    """Number of rows with a direction of motion, which alone are rated."""
    total: float
    """Sum of the alignments of the rated rows [-]."""

    def add(self, more: "RatedRows | None") -> None:
        """Add rows that have turned out to belong to the same period or phase."""
        if more is not None:
            self.rows += more.rows
            self.rated += more.rated
            self.total += more.total


@final
class RatingSeries:
    """Publisher of P^r of every finished period, or of every stance and flight of a jump."""

    def __init__(self, stream: rr.RecordingStream, facts: Facts) -> None:
        self._stream = stream
        self._run = facts.run
        self._jumps = facts.run.jumps
        self._now: RatedRows | None = None
        self._next: RatedRows | None = None
        """Rows after `_now`: the next stretch, or contact chatter."""
        self._gap: RatedRows | None = None
        """Flight rows after a contact that may still turn out to be chatter."""
        self._whole = False
        for name in ("flight", "stance") if facts.run.jumps else ("period",):
            looks = rr.SeriesLines(
                names=[name],
                colors=[LANES[name]],
                widths=[1.5],
                interpolation_mode="StepBefore",
            )
            stream.log(f"{ORIGIN}/{name}", looks, static=True)

    def push(self, trace: TracedRows) -> None:
        """Rate the stretches that end within these rows."""
        motor = trace.rows["motor_pos"]
        runs = runs_of(trace.stance.astype(np.int64) if self._jumps else trace.period)
        for first, stop, key in zip(runs.first, runs.stop, runs.value.tolist(), strict=True):
            values = self._alignment(trace.joint[first:stop], motor[first:stop], key)
            rated, total = int(np.isfinite(values).sum()), float(np.nansum(values))
            time = float(trace.time[first])
            self._take(RatedRows(key, time, int(stop - first), rated, total))

    def finish(self) -> None:
        """Rate the last stretch whose end was seen; the one under way is left out."""
        if self._now is not None and self._next is not None:
            self._close(self._now, self._next.time)

    def _take(self, rows: RatedRows) -> None:
        """Take rows of one kind; as in `metrics.stance`, gaps are filled first, then contacts."""
        if self._now is None:
            self._now = rows
        elif self._next is None and rows.key == self._now.key:
            self._now.add(rows)
        elif self._next is None:
            self._next = rows
        elif rows.key == self._next.key:
            self._next.add(self._gap)
            self._next.add(rows)
            self._gap = None
        elif self._jumps and self._next.key == STANCE:
            if self._gap is None:
                self._gap = rows
            else:
                self._gap.add(rows)
        else:
            self._now.add(self._next)
            self._now.add(rows)
            self._next = None
        if self._next is not None and self._next.rows >= SHORTEST:
            self._close(self._now, self._next.time)
            self._now, self._next, self._gap, self._whole = self._next, self._gap, None, True
        elif self._gap is not None and self._gap.rows >= SHORTEST:
            self._now.add(self._next)
            self._now.add(self._gap)
            self._next = self._gap = None

    def _alignment(self, joint: Floats, motor: Floats, key: int) -> Floats:
        run = self._run
        flies = self._jumps and key == 0
        support = Support.NONE if flies else SUPPORTS[run.setup.kind]
        return alignment(deflection(run.design, joint, motor, support, run.reference))

    def _close(self, stretch: RatedRows, time: float) -> None:
        if not self._whole or stretch.rated < SHORTEST:
            return
        name = ("flight", "stance")[stretch.key] if self._jumps else "period"
        index = [rr.TimeColumn("t", duration=[time])]
        value = rr.Scalars.columns(scalars=[stretch.total / stretch.rated])
        self._stream.send_columns(f"{ORIGIN}/{name}", index, value)
