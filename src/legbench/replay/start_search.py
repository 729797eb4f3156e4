"""Search for the start of a leg on drives, from what its encoders showed.

A leg that stands swings by a count of its encoders or two, which a jump enlarges a thousand times
in 2 s. How long it has stood is found from its rows at rest. Where the leg then leaves the recorded
one, places of the motors before the first row are sought, by least squares over more and more rows,
from which it stays beside for longer: late rows tell the start to a hundredth of a count, but only
from nearby, since a foot that lifts off a moment later kicks the leg by a count.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from legbench.loop import Progress
from legbench.plant.abstract import AbstractPlant
from legbench.replay.moved import Moved
from legbench.replay.start_estimate import BESIDE, PULSE, StartEstimate, StartTrials
from legbench.signals import Command, Floats

LONGEST_REST: Final = 2.0
"""Longest time for which a leg that was on drives stands before its first row [s]: it is put to
rest by its equations, from which bars and encoders keep it some counts away, and swings out."""
SHORT_REST: Final = 0.3
"""Longest time before the first row of a leg whose swing is sought [s]: the search makes up for the
rest, and repeats this time in each of its trials."""
WINDOWS: Final = (0.0, 0.1, 0.2, 0.35, 0.6, 1.0, 1.4, 2.0)
"""Time after the rest whose rows count in one least-squares estimate after the other [s]."""
STEPS: Final = 2
"""Largest number of steps of each of them."""
SHARES: Final = (1.0, 0.5, 0.25)
"""Parts of a step that are tried."""


def find_start(
    plant: AbstractPlant, moved: Moved, steps: Sequence[int], progress: Progress | None = None
) -> StartEstimate:
    """Estimate how the leg of a run on drives stood and swung before its first row.

    Its swing is sought where motors were measured and the plant stands as the leg stood: another
    leg, or one with noise on its encoders, is none that could swing so.

    Args:
        plant: the leg; where it is left does not matter.
        moved: rows of the run.
        steps: number of periods of the plant from each row to the next.
        progress: told after each step of the search how many rows it has been through.
    """
    rest, count = moved.rest(), moved.count
    swing = _swing(plant, moved, round(LONGEST_REST / plant.period))
    periods = _best(swing, rest, 1)
    start = StartEstimate(hold=moved.first, periods=periods, beside=np.zeros((2, 2)))
    apart = np.abs(swing[periods - 1 : periods - 1 + len(rest)] - rest).max()
    if not moved.measured or count is None or not apart < BESIDE * count:
        return start
    trials = StartTrials(plant, moved, steps, count)
    period = plant.period * float(np.median(steps)) if steps else plant.period
    windows = sorted({min(trials.rows, len(rest) + round(each / period)) for each in WINDOWS})
    least = PULSE * len(start.beside)
    short = swing[: max(least, round(SHORT_REST / plant.period)) + len(rest)]
    again = replace(start, periods=_best(short, rest, least))
    return _improved(trials, windows, start, again, progress)


def _swing(plant: AbstractPlant, moved: Moved, most: int) -> Floats:
    """Link angles of a leg that stands, after each period (n, 2) [rad]."""
    hold = Command.holding(moved.first)
    plant.reset()
    return np.array([plant.step(hold).joint_pos for _ in range(most + len(moved.rest()))])


def _best(swing: Floats, rest: Floats, least: int) -> int:
    """Number of periods, at least `least`, after which a swing fits rows at rest best."""
    most = len(swing) - len(rest)
    apart = [
        np.sum((swing[first : first + len(rest)] - rest) ** 2) for first in range(least - 1, most)
    ]
    return most if np.isnan(apart).any() else least + int(np.argmin(apart))


def _improved(
    trials: StartTrials,
    windows: Sequence[int],
    first: StartEstimate,
    again: StartEstimate,
    progress: Progress | None,
) -> StartEstimate:
    """Start from which the leg stays beside the recorded one for longest.

    Args:
        trials: of the run.
        windows: numbers of rows that count, one after the other.
        first: start that is returned if no other is better.
        again: start that is moved.
        progress: told after each step how many rows it has been through.
    """
    best, longest, at = first, trials.follow(first).beside, again
    through, total = 0, STEPS * sum(windows)
    for rows in windows:
        for step in range(STEPS):
            found = None if longest == trials.rows else trials.better(at, rows, SHARES)
            if found is None:
                break
            at, beside = found, trials.follow(found).beside
            if beside > longest:
                best, longest = at, beside
            if progress is not None:
                progress(through + (step + 1) * rows, total)
        through += STEPS * rows
    return best
