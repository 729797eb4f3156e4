"""Comparison of stories of hops with those of the reference, and what may excuse a difference.

A hop grazes where a condition is met only just, or only just not: the reference itself tells hops
that begin a hair's breadth beside it in another way, or far apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from reference.dop853 import Accuracy
from reference.hops import Hops, Story

from legbench.control import JumpConfig
from legbench.design import LegDesign
from legbench.signals import Floats

UNITS = np.array([0.01, 0.1, 0.1, 0.1, 1.0, 1.0])
"""Units of the six numbers of an apex [m, m/s, rad, rad, rad/s, rad/s]."""
SAME_TIME = 1e-6
"""Largest difference between two times of one event [s]."""
DOUBTFUL = 1e-6
"""Error above which a hop is computed once more, with shorter steps [-]."""
FINER = 0.1
"""Factor on the longest steps then [-]."""
FINEST = Accuracy(1e-13, 1e-15)
"""Tolerances then."""
NEIGHBOUR, STEEP = 1e-7, 1e3
"""Distance in `UNITS` of the hops beside a doubtful one, and of the starts beside one that may lie
on an edge of a basin; growth of it in one hop, or shift of an event by it, beyond which the hop
grazes [-]."""
TWICE = 2e-4
"""Time within which an event that is told twice is doubled [s]."""


class Case(Protocol):
    """A leg, its controller, and where it starts."""

    @property
    def design(self) -> LegDesign:
        """Parameters of the leg."""
        ...

    @property
    def config(self) -> JumpConfig:
        """Settings of the controller."""
        ...

    @property
    def vector(self) -> Floats:
        """Apex at which the hop begins (6,)."""
        ...


class Told(Protocol):
    """Story of a hop by whoever is judged."""

    events: list[tuple[str, float]]
    ending: str
    apex: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """Comparison of one hop with the reference."""

    error: float
    """Largest difference of the final states in `UNITS`; infinite if the stories differ [-]."""
    fault: str
    """One of `missed`, `doubled`, `false`, `late` and `ending`; empty if the stories agree."""
    grazes: str
    """What tells the hop from those beside it; empty if nothing does."""
    stories: tuple[Told, Story]


def reference(cases: Sequence[Case], starts: Floats, *, fine: bool = False) -> list[Story]:
    """Stories of hops from starts (6, n)."""
    designs, configs = [case.design for case in cases], [case.config for case in cases]
    if fine:
        return Hops(designs, configs, starts, FINEST, FINER).run()
    return Hops(designs, configs, starts).run()


def judge(cases: Sequence[Case], told: Sequence[Told]) -> list[Verdict]:
    """Compare stories with the reference; doubtful ones with its finest, and with hops beside."""
    starts = np.array([case.vector for case in cases]).T
    found = [_compare(*pair) for pair in zip(told, reference(cases, starts), strict=True)]
    doubtful = _doubtful(found)
    if doubtful:
        some = [cases[index] for index in doubtful]
        again = reference(some, starts[:, doubtful], fine=True)
        for index, story in zip(doubtful, again, strict=True):
            found[index] = _compare(told[index], story)
    for index in _doubtful(found):
        grazes = _beside(cases[index], found[index].stories[1])
        found[index] = replace(found[index], grazes=grazes)
    return found


def _doubtful(verdicts: Sequence[Verdict]) -> list[int]:
    return [index for index, verdict in enumerate(verdicts) if not verdict.error <= DOUBTFUL]


def _compare(told: Told, story: Story) -> Verdict:
    fault = difference(told, story)
    apart = np.abs(np.subtract(told.apex, story.apex)) / UNITS
    error = float("inf") if fault else float(np.max(apart))
    return Verdict(error=error, fault=fault, grazes="", stories=(told, story))


def difference(told: Told, story: Told) -> str:
    """Kind of the first difference of two stories; empty if they agree."""
    pairs = list(zip(told.events, story.events, strict=False))
    for index, ((name, time), (wanted, then)) in enumerate(pairs):
        if name == wanted and abs(time - then) < SAME_TIME:
            continue
        if index and told.events[index - 1][0] == name and time - told.events[index - 1][1] < TWICE:
            return "doubled"
        if name == wanted:
            return "late"
        return "missed" if then < time else "false"
    if len(told.events) != len(story.events):
        return "missed" if len(told.events) < len(story.events) else "false"
    return "" if told.ending == story.ending else "ending"


def _beside(case: Case, story: Story) -> str:
    """What hops beside this one do otherwise, by the finest reference; empty if nothing."""
    units = np.concatenate([np.eye(6), -np.eye(6)]) * UNITS
    starts = (case.vector + NEIGHBOUR * units).T
    names = [name for name, _ in story.events]
    for other in reference([case] * len(units), starts, fine=True):
        for index, (name, time) in enumerate(other.events):
            if index >= len(names) or name != names[index]:
                return f"{name} at {1e3 * time:.4f} ms comes or not"
            if abs(time - story.events[index][1]) > STEEP * NEIGHBOUR:
                return f"{name} at {1e3 * time:.4f} ms is steep"
        if len(other.events) < len(names):
            name, time = story.events[len(other.events)]
            return f"{name} at {1e3 * time:.4f} ms comes or not"
        if other.ending != story.ending:
            return f"ends with {other.ending} or {story.ending}"
        if np.max(np.abs(np.subtract(other.apex, story.apex)) / UNITS) > STEEP * NEIGHBOUR:
            return "the hop is steep"
    return ""
