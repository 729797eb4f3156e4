"""What the counts of the motors' encoders hide, as unknowns of a fit.

A motor enters the equations as an input, and its encoder shows it in whole counts. A motor that
stands is up to half a count beside what is shown, by the same angle for as long as it stands; so
each time that it stands has one unknown error, known beforehand to the spread of a rounding. Errors
of a moving motor change with every count, and share one unknown. (Errors in variables: Fuller,
Measurement Error Models, 1987.)
"""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from legbench.analytic.parameters import MOTOR
from legbench.analytic.sensitivity import STATES, Path
from legbench.identify.trial import SETTLED_ROWS, FitTrial
from legbench.signals import Bools, Floats

MOST_STANDS: Final = 8
"""Most times that one motor of one run stands that have an unknown of their own [-]; those beyond,
the shortest, share that of the moving motor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """Rows in which one motor is beside what its encoder shows by one unknown angle."""

    joint: int
    """Index of the motor, 0 or 1."""
    rows: Bools
    """Whether each row of the run belongs to it (n,)."""
    sigma: float
    """Standard deviation of the angle, a count over the root of twelve [rad]."""

    @property
    def edges(self) -> tuple[int, ...]:
        """Rows, without the first, at which the motor enters or leaves the stretch.

        The position in row k + 1 is held from row k to row k + 1.
        """
        changes = np.flatnonzero(self.rows[2:] != self.rows[1:-1]) + 1
        return tuple(changes.tolist())


def stretches_of(trial: FitTrial) -> tuple[Stretch, ...]:
    """Unknown errors of a run's motors; none of a motor whose encoder has no counts."""
    found = []
    for joint, motor in enumerate(trial.motors):
        if motor.count == 0.0:
            continue
        sigma, rest = motor.count / math.sqrt(12.0), np.ones(len(trial.time), dtype=np.bool_)
        for begin, end in _stands(trial.motor_pos[:, joint]):
            rest[begin:end] = False
            rows = np.zeros_like(rest)
            rows[begin:end] = True
            found.append(Stretch(joint=joint, rows=rows, sigma=sigma))
        if rest.any():
            found.append(Stretch(joint=joint, rows=rest, sigma=sigma))
    return tuple(found)


def _stands(positions: Floats) -> list[tuple[int, int]]:
    """First rows, and rows behind the last, of the longest times that a motor stands."""
    edges = [0, *(np.flatnonzero(np.diff(positions)) + 1).tolist(), len(positions)]
    long = [pair for pair in pairwise(edges) if pair[1] - pair[0] >= SETTLED_ROWS]
    return sorted(sorted(long, key=lambda pair: pair[0] - pair[1])[:MOST_STANDS])


def by_stretch(path: Path, stretch: Stretch, start: Floats) -> Floats:
    """Derivative of the angles of a path by the angle of a stretch, in its deviations (n, 2).

    Args:
        path: the path, whose restarts have the edges of the stretch among them.
        stretch: the stretch.
        start: derivative of the start by the motor's first position (4,) [-].
    """
    last, now = len(path.states) - 1, start * float(stretch.rows[0])
    found = np.empty((last + 1, 2))
    found[0] = now[:2]
    for begin, end in pairwise([0, *path.restarts, last]):
        piece = path.pieces[begin + 1 : end + 1]
        slope = piece[:, :, :STATES] @ now
        if stretch.rows[begin + 1]:
            slope += piece[:, :, STATES + MOTOR + stretch.joint]
        found[begin + 1 : end + 1], now = slope[:, :2], slope[-1]
    return stretch.sigma * found
