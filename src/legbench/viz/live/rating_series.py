"""The rating P^r while a run goes on: one value at the end of each period or phase."""

from dataclasses import dataclass
from typing import final

import numpy as np

from legbench.design.setup import SUPPORTS
from legbench.metrics.rating import alignment, deflection
from legbench.metrics.roles import STANCE
from legbench.metrics.rows import runs_of
from legbench.metrics.source import Reference
from legbench.signals import Floats, Ints
from legbench.viz import style
from legbench.viz.facts import Facts
from legbench.viz.live._rerun import rr
from legbench.viz.trace import TracedRows

SHORTEST = 15
"""Stretches of fewer rows are contact chatter and belong to the stretch around them."""
ORIGIN, LOST = "/series/rating", "/series/lost"
"""Entities of P^r, and of log10(1 - P^r)."""
LEAST = 1e-12
"""Smallest 1 - P^r that is told from none [-]: a mean of some hundred roundings."""
REFERENCES = tuple(Reference)
LANES = {"period": style.ACCENT, "stance": style.STANCE, "flight": style.FLIGHT}


@dataclass(slots=True, kw_only=True)
class RatedRows:
    """Rows of one period or phase that have been seen so far."""

    key: int
    time: float
    """Time of the first row [s]."""
    rows: int
    rated: Ints
    """Number of rows with a direction of motion, which alone are rated, by reference (2,)."""
    total: Floats
    """Sum of the alignments of the rated rows, by reference (2,) [-]."""
    fell: bool
    """Whether the hip is lower in the first row than in the one before."""
    falls: bool
    """Whether the hip falls from row to row after that."""

    @property
    def fell_on(self) -> bool:
        """Whether the hip went on falling in all of the rows."""
        return self.fell and self.falls

    def add(self, more: "RatedRows | None") -> None:
        """Add rows that have turned out to belong to the same period or phase."""
        if more is not None:
            self.rows += more.rows
            self.rated = self.rated + more.rated
            self.total = self.total + more.total
            self.falls = self.falls and more.fell_on


@final
class RatingSeries:
    """Publisher of P^r of every finished period, or of every stance and flight of a jump.

    Each is rated about the motor and about the equilibrium, and shown as P^r and, since ratings
    near one differ there alone, as the logarithm of 1 - P^r. What has too little motion to be rated
    is a gap in the line.
    """

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
        self._hip = np.nan
        for reference in REFERENCES:
            leads = reference is facts.run.reference
            for name in ("flight", "stance") if facts.run.jumps else ("period",):
                looks = rr.SeriesLines(
                    names=[f"{name}, {reference.value}"],
                    colors=[LANES[name] if leads else style.faint(LANES[name])],
                    widths=[1.5 if leads else 0.75],
                    interpolation_mode="StepBefore",
                )
                for origin in (ORIGIN, LOST):
                    stream.log(f"{origin}/{reference.value}/{name}", looks, static=True)

    def push(self, trace: TracedRows) -> None:
        """Rate the stretches that end within these rows."""
        motor = trace.rows["motor_pos"]
        runs = runs_of(trace.stance.astype(np.int64) if self._jumps else trace.period)
        falls = np.diff(np.append(self._hip, trace.hip)) < 0.0
        self._hip = float(trace.hip[-1])
        for first, stop, key in zip(runs.first, runs.stop, runs.value.tolist(), strict=True):
            values = self._alignment(trace.joint[first:stop], motor[first:stop])
            self._take(
                RatedRows(
                    key=key,
                    time=float(trace.time[first]),
                    rows=int(stop - first),
                    rated=np.isfinite(values).sum(axis=-1),
                    total=np.nansum(values, axis=-1),
                    fell=bool(falls[first]),
                    falls=bool(falls[first + 1 : stop].all()),
                )
            )

    def finish(self) -> None:
        """Rate the last stretch whose end was seen; the one under way is left out."""
        if self._now is not None and self._next is not None:
            self._close(self._now, self._next.time)

    def _take(self, rows: RatedRows) -> None:
        """Take rows of one kind; as in `metrics.stance`, gaps are filled first, then contacts.

        A gap in which the hip only falls, as it did since touchdown, waits for the foot to be back.
        """
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
        if self._next is not None and self._lasts(self._now, self._next):
            self._close(self._now, self._next.time)
            self._now, self._next, self._gap, self._whole = self._next, self._gap, None, True
        elif self._next and self._gap and self._lasts(self._next, self._gap):
            self._now.add(self._next)
            self._now.add(self._gap)
            self._next = self._gap = None

    def _lasts(self, before: RatedRows, rows: RatedRows) -> bool:
        """Whether rows are a period or phase of their own, neither chatter nor a bounce."""
        lands = self._jumps and before.key == STANCE and before.falls
        return rows.rows >= SHORTEST and not (lands and rows.fell_on)

    def _alignment(self, joint: Floats, motor: Floats) -> Floats:
        """Alignments of rows with the leg carried as its setup has it, by reference (2, n)."""
        design, support = self._run.design, SUPPORTS[self._run.setup.kind]
        return np.stack(
            [
                alignment(deflection(design, joint, motor, support, reference))
                for reference in REFERENCES
            ]
        )

    def _close(self, stretch: RatedRows, time: float) -> None:
        if not self._whole:
            return
        name = ("flight", "stance")[stretch.key] if self._jumps else "period"
        index = [rr.TimeColumn("t", duration=[time])]
        for reference in REFERENCES:
            # In flight nothing is carried: the equilibrium is the motor's position.
            place = REFERENCES.index(Reference.MOTOR if name == "flight" else reference)
            rated = int(stretch.rated[place])
            # What is not rated is a gap in the line, which would else go on from before.
            known = rated >= SHORTEST
            value = float(stretch.total[place]) / rated if known else np.nan
            lost = np.log10(np.maximum(1.0 - value, LEAST))
            for origin, shown in ((ORIGIN, value), (LOST, lost)):
                column = rr.Scalars.columns(scalars=[shown])
                self._stream.send_columns(f"{origin}/{reference.value}/{name}", index, column)
