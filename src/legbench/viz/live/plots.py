"""The four XY plots of a run: polar, joint space, modal phase twice."""

from typing import final

import numpy as np

from legbench.signals import Floats
from legbench.viz import style
from legbench.viz.facts import Facts
from legbench.viz.live._rerun import rr
from legbench.viz.live.axes import PlotSpec
from legbench.viz.live.key import period_key, phase_key, stance_key
from legbench.viz.live.xyplot import XYPlot
from legbench.viz.trace import Thinner, TracedRows

FREQ = 200.0
"""Rate of the trajectories' points, about a hundred a period [Hz]."""
MOST_POINTS = 1 << 17
"""Points of the whole run behind the trails, of which every second one is dropped when there are
more: eleven minutes of them, 2 MB a plane."""


def plot_specs(facts: Facts) -> dict[str, PlotSpec]:
    """The plots by name; jumps are coloured by stance and flight, the rest by period."""
    jumps = facts.run.jumps
    coloured = "stance / flight" if jumps else "periods"
    periods = period_key("jump" if jumps else "period")
    phases = stance_key() if jumps else phase_key(facts, at_rest=False)
    usual = stance_key() if jumps else periods
    return {
        "polar": PlotSpec(
            path="/plots/polar",
            title=f"{style.POLAR}: {coloured}",
            x=style.X1,
            y=style.X2,
            least=(style.POLAR_LEAST, 0.0),
            key=usual,
        ),
        "joint": PlotSpec(
            path="/plots/joint",
            title=f"{style.JOINT}: {coloured}",
            x=style.Q1,
            y=style.Q2,
            equal=True,
            margin=0.12,
            through=facts.rest,
            key=usual,
        ),
        "periods": PlotSpec(
            path="/plots/periods",
            title=f"{style.MODAL}: {'jumps' if jumps else 'periods'}",
            x=style.Z2,
            y=style.DZ2,
            key=periods,
        ),
        "phases": PlotSpec(
            path="/plots/phases",
            title=f"{style.MODAL}: {_phases(facts)}",
            x=style.Z2,
            y=style.DZ2,
            key=phases,
        ),
    }


def _phases(facts: Facts) -> str:
    return "stance / flight" if facts.run.jumps else "controller"


@final
class ThinnedPoints:
    """Points of a whole run in one plane, fewer of each part the longer the run is.

    Attributes:
        last: the last point that was added (1, 2).
    """

    def __init__(self, most: int = MOST_POINTS) -> None:
        self._most, self._parts = most, list[Floats]()
        self._added = self._kept = 0
        self._step = 1
        self.last: Floats = np.zeros((0, 2))

    def __bool__(self) -> bool:
        return self._added > 0

    def add(self, points: Floats) -> None:
        """Add points (n, 2) that follow those added before."""
        kept = points[-self._added % self._step :: self._step].copy()
        self._parts.append(kept)
        self._added += len(points)
        self._kept += len(kept)
        self.last = points[-1:].copy()
        while self._kept > self._most:
            self._parts = [self.points[::2]]
            self._kept, self._step = len(self._parts[0]), 2 * self._step

    @property
    def points(self) -> Floats:
        """Points that are kept (m, 2), evenly spread."""
        return np.concatenate(self._parts)


@final
class Plots:
    """Publishes trajectories in the four planes."""

    def __init__(self, stream: rr.RecordingStream, facts: Facts) -> None:
        self._jumps, self._phases = facts.run.jumps, facts.run.phases
        self._plots = {name: XYPlot(stream, spec) for name, spec in plot_specs(facts).items()}
        self._thinner = Thinner(FREQ)
        self._seen = {name: ThinnedPoints() for name in self._plots}
        self._others: dict[str, list[Floats]] = {name: [] for name in self._plots}
        self._other_thinner: dict[str, Thinner] = {}

    def push(self, trace: TracedRows) -> None:
        """Add rows to the trails."""
        kept = self._thinner.pick(trace.time)
        if len(kept) == 0:
            return
        periods = style.period_colours(trace.period[kept])
        phases = self._phase_colours(trace)[kept]
        for name, plot in self._plots.items():
            points = _points(trace, name)[kept]
            before = self._seen[name].last if self._seen[name] else points[:1]
            self._seen[name].add(points)
            plot.cover(points)
            by_phase = name == "phases" or (self._jumps and name != "periods")
            plot.push(
                trace.time[kept],
                np.concatenate([before, points]),
                phases if by_phase else periods,
            )

    def overlay(self, key: str, trace: TracedRows, colour: style.Rgb) -> None:
        """Draw rows of another run, which follow those drawn before, over the trails."""
        kept = self._other_thinner.setdefault(key, Thinner(FREQ)).pick(trace.time)
        if len(kept) == 0:
            return
        for name, plot in self._plots.items():
            points = _points(trace, name)[kept]
            known = points[np.isfinite(points).all(axis=1)]
            if len(known):
                self._others[name].append(np.stack([known.min(axis=0), known.max(axis=0)]))
            plot.overlay(key, trace.time[kept], points, colour)

    def finish(self) -> None:
        """Draw the whole run behind the trails, on axes that also fit the other runs."""
        for name, plot in self._plots.items():
            if seen := self._seen[name]:
                others = self._others[name]
                plot.backdrop(seen.points, np.concatenate(others) if others else None)

    def _phase_colours(self, trace: TracedRows) -> style.Colours:
        if self._jumps:
            return style.stance_colours(trace.stance)
        return style.colours_by_code(self._phases, trace.rows["phase"])


def _points(trace: TracedRows, name: str) -> Floats:
    planes = {"polar": trace.polar, "joint": trace.joint}
    return planes.get(name, trace.modal)
