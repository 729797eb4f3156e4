"""Cycles of n hops, and the cycle in which the motion from an unstable hop ends."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from legbench.analytic.taylor import TaylorLeg
from legbench.errors import ConfigError
from legbench.modes.drive import AbstractDrive
from legbench.modes.fixed_point import UNITS, tangent_map
from legbench.modes.hop import Apex, Hop, return_map, settle
from legbench.signals import Floats

CLOSED = 1e-9
"""Distance between the two ends of a cycle that is solved, in `UNITS` [-]."""
NEWTON = 25
"""Number of iterations after which a cycle is given up."""
SHORTER = 0.5
"""Largest change of an iteration, in `UNITS` [-]."""
LONGEST = 8
"""Largest number of hops after which a motion is said to repeat [-]."""
REPEATS = 1e-4
"""Distance between two apexes that count as the same, in `UNITS` [-]."""
NUDGE = 0.01
"""Initial distance from an unstable hop whose end is sought, in `UNITS` [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HopCycle:
    """Cycle of hops, the last of which ends where the first began."""

    apexes: tuple[Apex, ...]
    hops: tuple[Hop, ...]
    multipliers: tuple[complex, ...]
    """Eigenvalues of the derivative of all hops together, the largest first."""
    directions: Floats
    """Eigenvectors, one a column, complex, in `UNITS` at the first apex (6, 6)."""
    residual: float
    """Largest remainder of `map(apex) - next apex`, in `UNITS` [-]."""

    @property
    def period(self) -> int:
        """Number of hops after which it repeats [-]."""
        return len(self.apexes)

    @property
    def duration(self) -> float:
        """Duration of all hops together [s]."""
        return sum(hop.duration for hop in self.hops)

    @property
    def stable(self) -> bool:
        """Whether small deviations die out."""
        return abs(self.multipliers[0]) < 1.0


def stacked(
    leg: TaylorLeg, drive: AbstractDrive, apexes: Floats
) -> tuple[Floats, Floats, list[Floats]]:
    """Distances by which hops miss the next apex, with their derivative and those of the hops.

    Args:
        leg: the compiled leg.
        drive: law of its motors.
        apexes: one a row, in `UNITS` (n, 6).

    Returns:
        Residual (6 n,), its derivative (6 n, 6 n), and the derivatives of the hops, n of (6, 6).

    Raises:
        ConfigError: a hop does not return to an apex.
    """
    count = len(apexes)
    residual, slope = np.zeros(6 * count), np.zeros((6 * count, 6 * count))
    slopes = []
    for index, at in enumerate(apexes):
        after, by_start = tangent_map(leg, drive, Apex.of(at * UNITS))
        following = (index + 1) % count
        rows = slice(6 * index, 6 * index + 6)
        residual[rows] = after - apexes[following]
        slope[rows, rows] += by_start
        slope[rows, 6 * following : 6 * following + 6] -= np.eye(6)
        slopes.append(by_start)
    return residual, slope, slopes


def find_cycle(leg: TaylorLeg, drive: AbstractDrive, guess: Sequence[Apex]) -> HopCycle:
    """Cycle near some consecutive apexes, by Newton's method on all of them together.

    Raises:
        ConfigError: there is none, or a hop on the way to it does not return.
    """
    at = np.array([apex.vector() for apex in guess]) / UNITS
    worst = np.inf
    for _ in range(NEWTON):
        residual, slope, slopes = stacked(leg, drive, at)
        worst = float(np.max(np.abs(residual)))
        if worst < CLOSED:
            return described(leg, drive, at, slopes, worst)
        change = np.linalg.lstsq(slope, residual, rcond=1e-9)[0]
        share = min(1.0, SHORTER / float(np.max(np.abs(change)) + 1e-300))
        at = at - share * change.reshape(at.shape)
    raise ConfigError(
        f"no hop of period {len(guess)} near apex height {guess[0].height:.4g} m: Newton's method "
        f"is left with {worst:.2g}; start it from hops that are closer to one"
    )


def described(
    leg: TaylorLeg, drive: AbstractDrive, at: Floats, slopes: list[Floats], residual: float
) -> HopCycle:
    """The cycle of solved apexes in `UNITS` (n, 6), with the derivatives of its hops."""
    values, directions = multiplied(slopes)
    apexes = tuple(Apex.of(row * UNITS) for row in at)
    return HopCycle(
        apexes=apexes,
        hops=tuple(return_map(leg, drive, apex) for apex in apexes),
        multipliers=tuple(complex(value) for value in values),
        directions=directions,
        residual=residual,
    )


def multiplied(slopes: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Eigenvalues, the largest first, and eigenvectors of hops in a row with derivatives (6, 6)."""
    product = np.eye(6)
    for slope in slopes:
        product = slope @ product
    values, vectors = np.linalg.eig(product)
    order = np.argsort(-np.abs(values))
    return values[order], vectors[:, order]


def repeats(apexes: Sequence[Apex], longest: int = LONGEST) -> int | None:
    """Number of hops after which the last apexes repeat; none if not within `longest`."""
    rows = np.array([apex.vector() for apex in apexes]) / UNITS
    for period in range(1, longest + 1):
        last = rows[-2 * longest :]
        if len(last) > period and np.max(np.abs(last[period:] - last[:-period])) < REPEATS:
            return period
    return None


def end_of(
    leg: TaylorLeg, drive: AbstractDrive, cycle: HopCycle, hops: int
) -> tuple[list[Apex], HopCycle | None]:
    """Disturb a hop along its largest multiplier's direction, and follow the motion to its end.

    Returns:
        The apexes on the way, fewer than asked for if the leg stops hopping, and the cycle in which
        they end, if they do.
    """
    direction = np.real(cycle.directions[:, 0])
    nudge = NUDGE * direction / np.max(np.abs(direction))
    start = Apex.of(cycle.apexes[0].vector() + nudge * UNITS)
    apexes = settle(leg, drive, start, hops)
    period = repeats(apexes) if len(apexes) > hops else None
    if period is None:
        return apexes, None
    try:
        return apexes, find_cycle(leg, drive, apexes[-period:])
    except ConfigError:
        return apexes, None
