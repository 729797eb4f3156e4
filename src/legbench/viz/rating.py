"""The rating P^r while a run goes on: one value at the end of each period or phase."""

from typing import final

import numpy as np

from legbench.design.setup import SUPPORTS
from legbench.design.statics import Support
from legbench.metrics.rating import alignment, deflection
from legbench.metrics.rows import runs_of
from legbench.signals import Floats
from legbench.viz import style
from legbench.viz._rerun import rr
from legbench.viz.facts import Facts
from legbench.viz.trace import Trace

SHORTEST = 15
"""Stretches of fewer rows are contact chatter and have no rating."""
ORIGIN = "/series/rating"
LANES = {"period": style.ACCENT, "stance": style.STANCE, "flight": style.FLIGHT}


@final
class Rating:
    """Publishes P^r of every finished period; of stance and flight apart for jumps."""

    def __init__(self, stream: rr.RecordingStream, facts: Facts) -> None:
        self._stream = stream
        self._terms = facts.terms
        self._jumps = facts.jumps
        self._key: int | None = None
        self._sum, self._rows = 0.0, 0
        self._whole = False
        for name in ("flight", "stance") if facts.jumps else ("period",):
            looks = rr.SeriesLines(
                names=[name],
                colors=[LANES[name]],
                widths=[1.5],
                interpolation_mode="StepBefore",
            )
            stream.log(f"{ORIGIN}/{name}", looks, static=True)

    def push(self, trace: Trace) -> None:
        """Rate the stretches that end within these rows."""
        motor = trace.rows["motor_pos"]
        runs = runs_of(trace.stance.astype(np.int64) if self._jumps else trace.period)
        for first, stop, key in zip(runs.first, runs.stop, runs.value.tolist(), strict=True):
            if key != self._key:
                self._close(float(trace.time[first]))
                self._whole = self._key is not None
                self._key, self._sum, self._rows = key, 0.0, 0
            values = self._alignment(trace.joint[first:stop], motor[first:stop], key)
            self._sum += float(np.nansum(values))
            self._rows += int(np.isfinite(values).sum())

    def _alignment(self, joint: Floats, motor: Floats, key: int) -> Floats:
        terms = self._terms
        flies = self._jumps and key == 0
        support = Support.NONE if flies else SUPPORTS[terms.setup]
        return alignment(deflection(terms.design, joint, motor, support, terms.reference))

    def _close(self, time: float) -> None:
        if not self._whole or self._rows < SHORTEST or self._key is None:
            return
        name = ("flight", "stance")[self._key] if self._jumps else "period"
        index = [rr.TimeColumn("t", duration=[time])]
        value = rr.Scalars.columns(scalars=[self._sum / self._rows])
        self._stream.send_columns(f"{ORIGIN}/{name}", index, value)
