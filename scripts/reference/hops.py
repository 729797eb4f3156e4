"""Hops of many legs by brute force: from an apex of the centre of mass to the next one.

All hops of a batch take their steps together, and the earliest event of each ends its piece.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from reference.conditions import (
    CONTACT,
    FALL,
    FELL,
    FELL_BACK,
    LIMIT,
    PUSH,
    RISE,
    TURN,
    Conditions,
)
from reference.dop853 import SLOWEST, Accuracy, attempt, dense
from reference.events import first_events
from reference.lanes import launch
from reference.law import SCALE, Law, Settings, probes
from reference.legs import GRAVITY, Legs, foot, landed

from legbench.control import JumpConfig
from legbench.design import LegDesign
from legbench.signals import Floats, Ints

BLIND = 2e-4
"""Shortest stance or flight after an event [s]."""
HORIZON = 2.0
"""Time after which a leg without an apex stands [s]."""
MOST_EVENTS = 400
"""Largest number of events of ground and controller in a hop [-]."""
SHORTEST = 1e-13
"""Step below which the integration has failed [s]."""
LONGEST, LONGEST_TOUCHED = 8e-3, 2e-3
"""Longest steps, and those of a leg on a stop, whose time constant is 10 ms [s]."""
DUE = 1e-12
"""Value above which a condition holds already when a piece begins [rad]."""


@dataclass(slots=True)
class Story:
    """What happened in a hop, in order."""

    events: list[tuple[str, float]] = field(default_factory=list)
    """Name and time [s] of every event of ground and controller."""
    ending: str = ""
    """One of `apex`, `stands`, `fell` and `fault`."""
    apex: tuple[float, ...] = ()
    """Height [m], speed [m/s], z1, z2 [rad] and their rates [rad/s] at the end of the hop; height
    and speed are zero if the leg stands."""
    pieces: int = 0
    """Number of pieces of the hop [-]."""


class Hops:
    """A batch of hops.

    Args:
        designs: one for each hop.
        settings: of the controllers.
        starts: apexes (6, n): height [m], speed [m/s], z1, z2 [rad], dz1, dz2 [rad/s].
        accuracy: tolerances of the integration.
        longest: factor on the longest steps [-].
    """

    def __init__(
        self,
        designs: Sequence[LegDesign],
        settings: Sequence[JumpConfig],
        starts: Floats,
        accuracy: Accuracy | None = None,
        longest: float = 1.0,
    ) -> None:
        self.accuracy, self.longest = accuracy or Accuracy(), longest
        found = [Settings.of(*pair) for pair in zip(settings, designs, strict=True)]
        self.laws = [Law(each) for each in found]
        self.stories = [Story() for _ in designs]
        self.steps = 0
        self._open = np.ones(len(designs), dtype=bool)
        self.lanes = launch(Legs.of(designs), probes(found), starts)
        everyone = np.arange(len(designs))
        for lane in everyone.tolist():
            self._obey(lane)
        self._begin(everyone)

    def run(self) -> list[Story]:
        """Follow all hops to their ends."""
        while True:
            open_ = self._open[self.lanes.number]
            if not open_.any():
                return self.stories
            if not open_.all():
                self.lanes = self.lanes.take(open_)
            self._step()

    def _step(self) -> None:
        """Take one step of every hop, up to its first event."""
        lanes = self.lanes
        self.steps += lanes.number.size
        end = self._ends()
        limit = np.where(lanes.touched.any(axis=0), LONGEST_TOUCHED, LONGEST) * self.longest
        step = np.minimum(np.minimum(lanes.step, limit), end - lanes.time)
        whole = lanes.time + step >= end
        tried = attempt(lanes.rates, lanes.y, step, self.accuracy)
        factor = np.nan_to_num(tried.factor, nan=SLOWEST)
        factor = np.where(lanes.rejected, np.minimum(factor, 1.0), factor)
        cut = tried.accepted & (step < lanes.step)
        inside = dense(lanes.rates, lanes.y, step, tried)
        lane, what, share = first_events(lanes, inside, step, tried.accepted)
        happens = np.zeros(step.size, dtype=bool)
        happens[lane] = True
        time = np.where(whole, end, lanes.time + step)
        lanes.y = np.where(tried.accepted, tried.reached, lanes.y)
        if lane.size:
            lanes.y[:, lane] = inside.take(lane).at(share)
            time[lane] = lanes.time[lane] + step[lane] * share
        lanes.time = np.where(tried.accepted, time, lanes.time)
        lanes.step = np.where(cut, np.maximum(lanes.step, step * factor), step * factor)
        lanes.rejected = ~tried.accepted
        arrived = np.flatnonzero(tried.accepted & whole & ~happens)
        self._go_on(lane, what, arrived)
        for failed in np.flatnonzero(lanes.rejected & (step < SHORTEST)).tolist():
            self._finish(failed, "fault")

    def _ends(self) -> Floats:
        """Times at which the pieces end at the latest [s]."""
        lanes = self.lanes
        end = np.minimum(lanes.alarm, HORIZON)
        end = np.where(lanes.time < lanes.blind, np.minimum(end, lanes.blind), end)
        apex = self._apex(slice(None))
        comes = lanes.flies & lanes.left & (apex >= lanes.time)
        return np.where(comes, np.minimum(end, apex), end)

    def _apex(self, lane: int | slice) -> Any:
        """Times at which the centres of mass are highest, if the legs are in flight [s]."""
        return self.lanes.began[lane] + self.lanes.centre[1, lane] / GRAVITY

    def _go_on(self, lane: Ints, what: Ints, arrived: Ints) -> None:
        """Let happen what ends the pieces, and begin the next ones."""
        self._switch(lane[what == CONTACT])
        for one, condition in zip(lane.tolist(), what.tolist(), strict=True):
            self._happen(one, condition)
        for one in arrived.tolist():
            self._arrive(one)
        flipped = lane[what >= PUSH]
        self._begin(np.concatenate([lane, arrived]), kept=flipped)

    def _begin(self, some: Ints, kept: Ints | None = None) -> None:
        """Begin pieces; what is due already happens at once. Stops of `kept` stay as switched."""
        while some.size:
            some = some[self._open[self.lanes.number[some]]]
            self._decide(some if kept is None else np.setdiff1d(some, kept))
            lanes = self.lanes.take(some)
            seen = Conditions(lanes).at(lanes.y, lanes.time)
            due = [seen[RISE] > DUE, seen[FALL] > DUE, seen[FELL] > DUE, seen[FELL_BACK] > DUE]
            what = np.select(due, [RISE, FALL, FELL, FELL_BACK], -1)
            contact = (what < 0) & (seen[CONTACT] >= 0.0)
            rising = contact & lanes.flies & ~lanes.sinking()
            self.lanes.blind[some[rising]] = lanes.time[rising] + BLIND
            contact &= ~rising & (lanes.flies | (seen[CONTACT] > 0.0))
            what = np.where(contact, CONTACT, what)
            for one, condition in zip(some.tolist(), what.tolist(), strict=True):
                if 0 <= condition != CONTACT:
                    self._happen(one, condition)
            self._switch(some[contact])
            some, kept = some[what >= 0], None

    def _decide(self, some: Ints) -> None:
        """Let the law of the stops say which of them push."""
        some = some[self.lanes.touched[:, some].any(axis=0)]
        lanes = self.lanes.take(some)
        self.lanes.pushing[:, some] = lanes.touched & (lanes.asked(lanes.y, by_law=True) > 0.0)

    def _happen(self, lane: int, what: int) -> None:
        """Handle one event of a lane, except its contact."""
        lanes = self.lanes
        number, time = int(lanes.number[lane]), float(lanes.time[lane])
        law, story = self.laws[number], self.stories[number]
        story.pieces += 1
        y = self._reading(lane)
        if what in (FELL, FELL_BACK):
            self._finish(lane, "fell")
        elif what == RISE:
            self._note(lane, law.rise(time))
        elif what == FALL:
            self._note(lane, law.fall(time, y))
        elif what == TURN:
            law.extreme(y)
            self._obey(lane)
        elif LIMIT <= what < CONTACT:
            lanes.touched[what - LIMIT, lane] ^= True
        elif what >= PUSH:
            lanes.pushing[what - PUSH, lane] ^= True

    def _arrive(self, lane: int) -> None:
        """Handle the end of a piece by time: alarm, apex, horizon, or the end of blindness."""
        lanes, law = self.lanes, self.laws[self.lanes.number[lane]]
        time = lanes.time[lane]
        if time >= law.alarm:
            self._note(lane, law.wake(self._reading(lane)))
        elif lanes.flies[lane] and lanes.left[lane] and time == self._apex(lane):
            self._finish(lane, "apex" if law.settled else "fault")
        elif time >= HORIZON:
            self._finish(lane, "stands")

    def _note(self, lane: int, name: str) -> None:
        """Add an event to the story, and do what the controller says."""
        story = self.stories[self.lanes.number[lane]]
        story.events.append((name, float(self.lanes.time[lane])))
        if len(story.events) > MOST_EVENTS:
            self._finish(lane, "fault")
        self._obey(lane)

    def _obey(self, lane: int) -> None:
        lanes, law = self.lanes, self.laws[self.lanes.number[lane]]
        lanes.upper[lane], lanes.lower[lane] = law.upper, law.lower
        lanes.turning[lane], lanes.alarm[lane] = law.turning, law.alarm
        lanes.motor[:, lane] = law.motor

    def _reading(self, lane: int) -> float:
        return float(self.lanes.probe[:, lane] @ self.lanes.y[:2, lane])

    def _switch(self, some: Ints) -> None:
        """Touchdown or lift-off of some lanes."""
        if not some.size:
            return
        lanes = self.lanes
        part = lanes.take(some)
        height, forward, up = foot(part.legs, part.y)
        speed = part.centre[1] - GRAVITY * (part.time - part.began)
        after = landed(part.legs, part.y, np.array([part.centre[2], speed]))
        lanes.y[2:, some] = np.where(part.flies, after, part.y[2:])
        lanes.centre[:, some] = np.where(part.flies, part.centre, [-height, -up, -forward])
        lanes.began[some] = np.where(part.flies, part.began, part.time)
        lanes.left[some] |= ~part.flies
        lanes.flies[some] = ~part.flies
        lanes.blind[some] = part.time + BLIND
        for entry, new in zip(lanes.form, part.legs.form(~part.flies), strict=True):
            entry[some] = new
        for lane, flew in zip(some.tolist(), part.flies.tolist(), strict=True):
            # An impact changes the rates at once, and may be the extreme of y itself.
            self.laws[lanes.number[lane]].extreme(self._reading(lane))
            self._note(lane, "touchdown" if flew else "liftoff")

    def _finish(self, lane: int, ending: str) -> None:
        lanes, story = self.lanes, self.stories[self.lanes.number[lane]]
        q1, q2, v1, v2 = lanes.y[:, lane].tolist()
        modal = (SCALE * x for x in (q1 + q2, q2 - q1, v1 + v2, v2 - v1))
        height = speed = 0.0
        if lanes.flies[lane]:
            z, up, speed = lanes.centre[:, lane].tolist()
            elapsed = float(lanes.time[lane] - lanes.began[lane])
            height = z + (up - 0.5 * GRAVITY * elapsed) * elapsed
        story.ending, story.apex = ending, (height, speed, *modal)
        self._open[lanes.number[lane]] = False
