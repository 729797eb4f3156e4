"""How a leg on drives stood and swung before its first row, and where it goes from such a start."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final, final

import numpy as np

from legbench.errors import PlantFault
from legbench.plant.abstract import AbstractPlant
from legbench.replay.moved import Moved
from legbench.signals import Command, Floats

PULSE: Final = 20
"""Periods for which the motors stand beside their place, twice: two places of two motors lead the
four coordinates and rates of the links where they have to be."""
PROBE: Final = 2e-5
"""Change of these places for finite differences [rad]: a few micro-radians of a link."""
USUAL: Final = 3e-4
"""Usual size of these distances [rad]: in so short a time they swing a link by a few counts."""
ROUNDING: Final = 12.0**-0.5
"""Standard deviation of a rounding error [counts]."""
BESIDE: Final = 2.5
"""Distance up to which a link is where it was recorded [counts of the encoder]: rounding is half a
count, and a foot that chatters as it lifts off kicks the leg by a count or two."""
LOST: Final = 20.0
"""Distance from which on a leg is not followed any further [counts]."""
WORTH: Final = 0.99
"""Part of the distance to the recorded links at which a step counts as one that helps [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StartEstimate:
    """What the motors do before the first row of a resimulation."""

    hold: Floats
    """Place of the motors at rest (2,) [rad]."""
    periods: int
    """Number of periods before the first row."""
    beside: Floats
    """Distance of both motors from there in the last two times `PULSE` periods (2, 2) [rad]."""
    rows: int | None = None
    """Number of rows from which `beside` was estimated; none where it is zero."""

    def motor_pos(self) -> Iterator[Floats]:
        """Positions of the motors (2,), period by period, up to the first row [rad]."""
        pulses = self.beside if self.beside.any() else self.beside[:0]
        yield from (self.hold for _ in range(self.periods - PULSE * len(pulses)))
        for way in pulses:
            yield from (self.hold + way for _ in range(PULSE))


@dataclass(frozen=True, slots=True, kw_only=True)
class FollowedRows:
    """Rows of a leg up to where it is lost."""

    links: Floats
    """Link angles (n, 2) [rad]."""
    beside: int
    """Number of rows before the leg leaves the recorded one."""


@final
class StartTrials:
    """Resimulations of the first rows of a run from one start or another.

    Attributes:
        rows: number of rows of the run.
    """

    def __init__(
        self, plant: AbstractPlant, moved: Moved, steps: Sequence[int], count: float
    ) -> None:
        """Prepare to move a leg as a run was moved.

        Args:
            plant: the leg.
            moved: rows of the run.
            steps: number of periods of the plant from each row to the next.
            count: that of the link encoders [rad].
        """
        self._plant, self._moved, self._steps, self._count = plant, moved, steps, count
        self._known = ~moved.stale
        self.rows = len(steps) + 1

    def follow(self, start: StartEstimate, rows: int | None = None) -> FollowedRows:
        """Move the leg from a start, over a number of rows or until it is lost."""
        lost = LOST * self._count
        links: list[Floats] = []
        for seen in self._observed(start):
            links.append(seen)
            far = not np.abs(self._apart(links[-1:], len(links) - 1)).max() < lost
            if len(links) == rows or (rows is None and far):
                break
        found = np.array(links).reshape(-1, 2)
        away = np.abs(self._apart(found)).max(axis=1) > BESIDE * self._count
        return FollowedRows(links=found, beside=int(np.argmax(away)) if away.any() else len(found))

    def _observed(self, start: StartEstimate) -> Iterator[Floats]:
        """Link angles row by row, as far as the leg comes (2,) [rad]."""
        plant = self._plant
        with suppress(PlantFault):
            seen = plant.reset()
            for motor_pos in start.motor_pos():
                seen = plant.step(Command.holding(motor_pos))
            yield seen.joint_pos
            for row, steps in enumerate(self._steps):
                for motor_pos in self._moved.between(row, steps):
                    seen = plant.step(Command.holding(motor_pos))
                yield seen.joint_pos

    def missing(self, links: Floats) -> Floats:
        """Way from the first rows of links (n, 2) to the recorded ones (2 n,) [rad].

        An angle by which an encoder is always beside its model is not the start's, and left out.
        """
        apart, known = self._apart(links), self._known[: len(links)]
        beside = apart.sum(axis=0) / np.maximum(1, known.sum(axis=0))
        return np.where(known, apart - beside, 0.0).ravel()

    def _apart(self, links: Floats | Sequence[Floats], first: int = 0) -> Floats:
        """Way from links (n, 2) to the recorded ones, whose first row is given (n, 2) [rad].

        It is zero where a drive has not answered, so that nothing is known.
        """
        rows = slice(first, first + len(links))
        return np.where(self._known[rows], self._moved.joint_pos[rows] - links, 0.0)

    def better(
        self, start: StartEstimate, rows: int, shares: Sequence[float]
    ) -> StartEstimate | None:
        """Start from which the first rows are nearer to the recorded ones.

        A step of Gauss and Newton in `beside`, with finite differences.

        Args:
            start: where the step begins.
            rows: number of rows that count.
            shares: parts of the step that are tried; the first one that helps is taken.

        Returns:
            None if none of them helps.
        """
        probes = [
            replace(start, beside=start.beside + PROBE * way) for way in np.eye(4).reshape(4, 2, 2)
        ]
        links = [self.follow(each, rows).links for each in (start, *probes)]
        common = min(map(len, links))
        if common == 0:
            return None  # Beside one of these starts the leg comes to no row.
        base, *others = (self.missing(each[:common]) for each in links)
        slopes = np.stack([base - each for each in others], axis=1) / PROBE
        # Of ways that rounded angles do not tell apart, the usual ones.
        weight = ROUNDING * self._count / USUAL
        ways = -weight * start.beside.ravel()
        equations, wanted = np.vstack([slopes, weight * np.eye(4)]), np.append(base, ways)
        step = np.linalg.lstsq(equations, wanted, rcond=None)[0].reshape(2, 2)
        for share in shares:
            moved = replace(start, beside=start.beside + share * step, rows=rows)
            found = self.follow(moved, common).links
            if len(found) == common and np.std(self.missing(found)) < WORTH * np.std(base):
                return moved
        return None
