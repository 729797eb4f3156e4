"""Motion of held legs whose motors move as they were measured, with its derivatives.

    legs = SensitiveLegs(friction=False)
    paths = legs.follow([Track(times=times, motors=motors, start=start, parameters=parameters)])
    paths[0].states, paths[0].slopes     # (n, 4), (n, 2, seeds)

Derivatives come from heyoka's variational equations. Legs are integrated side by side, a few in
each instruction; stretches in which no motor moves are one call.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final, final

import numpy as np

from legbench.analytic._heyoka import heyoka as hy
from legbench.analytic.compiled import sensitive_integrator, sensitive_seeds
from legbench.analytic.parameters import MOTOR
from legbench.errors import PlantFault
from legbench.signals import Floats

STATES: Final = 4
"""Number of states of a leg, two angles and their rates [-]."""
LANES: Final = 4
"""Number of legs in one instruction [-]; four are enough for the runs of most identifications."""
PRECISION: Final = 1e-10
"""Error of a step over the largest of states and derivatives [-]: far below an encoder's count."""
STEPS_PER_INTERVAL: Final = 20
"""Most steps that one interval between rows may take on average [-]; a leg takes a few dozen a
second, a diverging one any number."""
SPARE_STEPS: Final = 500
"""Steps that a stretch may take beyond that [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """One leg to follow: when, with which motors, from where, and with which parameters."""

    times: Floats
    """Times (n,) at which the states are wanted, the first being the start [s]."""
    motors: Floats
    """Motor positions (n - 1, 2) between the times [rad]."""
    start: Floats
    """Angles and rates at the start (4,) [rad, rad/s]."""
    parameters: Floats
    """Parameters as in `analytic.parameters`, up to the sharpness of friction (14,)."""
    restarts: tuple[int, ...] = ()
    """Rows from which derivatives are wanted by the state there, too."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Path:
    """Motion of one leg and its derivatives."""

    states: Floats
    """Angles and rates (n, 4) [rad, rad/s]."""
    slopes: Floats
    """Derivatives of the angles (n, 2, seeds), by the four states at the start and then by the
    parameters in their order."""
    pieces: Floats
    """Such derivatives of angles and rates (n, 4, seeds), by the state and the parameters since the
    last restart before each row."""
    restarts: tuple[int, ...]
    """Rows of the restarts, those of legs that were followed alongside among them."""


@final
class SensitiveLegs:
    """Held legs without stops, followed together with their derivatives."""

    def __init__(self, *, friction: bool, tolerance: float = PRECISION) -> None:
        self._make = lambda: sensitive_integrator(tolerance, LANES, friction=friction)
        self._seeds = STATES + len(sensitive_seeds(friction=friction))
        self._blocks: list[Any] = []

    def follow(self, tracks: Sequence[Track]) -> list[Path]:
        """Paths of legs along their tracks.

        Raises:
            PlantFault: a leg runs away.
        """
        found: list[Path] = []
        for place, first in enumerate(range(0, len(tracks), LANES)):
            if place == len(self._blocks):
                self._blocks.append(self._make())
            found += self._block(self._blocks[place], tracks[first : first + LANES])
        return found

    def _block(self, block: Any, tracks: Sequence[Track]) -> list[Path]:
        """Paths of the legs of one batch; lanes that are left over repeat the last leg."""
        lanes = [*tracks, *([tracks[-1]] * (LANES - len(tracks)))]
        length = max(len(track.times) for track in tracks)
        times = np.stack([_padded_times(track.times, length) for track in lanes], axis=1)
        motors = np.stack([_padded(track.motors, length - 1) for track in lanes], axis=2)
        self._begin(block, lanes)
        whole = np.empty((length, len(block.state), LANES))
        whole[0] = block.state
        moves = np.any(motors[1:] != motors[:-1], axis=(1, 2))
        restarts = {row for track in tracks for row in track.restarts if 0 < row < length - 1}
        edges = sorted({0, *(np.flatnonzero(moves) + 1).tolist(), *restarts, length - 1})
        for begin, end in pairwise(edges):
            if begin in restarts:
                self._restart(block)
            block.pars[MOTOR : MOTOR + 2] = motors[begin]
            most = SPARE_STEPS + STEPS_PER_INTERVAL * (end - begin)
            if end == begin + 1:
                block.propagate_until(times[end], max_steps=most)
                _check(block, float(times[begin].min()))
                whole[end] = block.state
            else:
                reached = block.propagate_grid(times[begin : end + 1], max_steps=most)[-1]
                _check(block, float(times[begin].min()))
                whole[begin + 1 : end + 1] = reached[1:]
        pieces = whole[:, STATES:].reshape(length, STATES, self._seeds, LANES)
        return [
            _path(whole[: len(track.times), :STATES, lane], pieces[..., lane], restarts)
            for lane, track in enumerate(tracks)
        ]

    def _begin(self, block: Any, lanes: Sequence[Track]) -> None:
        """Load starts and parameters."""
        block.set_time([float(track.times[0]) for track in lanes])
        block.state[:STATES] = np.stack([track.start for track in lanes], axis=1)
        self._restart(block)
        values = np.stack([track.parameters for track in lanes], axis=1)
        block.pars[:] = values[: len(block.pars)]

    def _restart(self, block: Any) -> None:
        """Begin derivatives anew: that of a state by itself is one."""
        block.state[STATES:] = np.eye(STATES, self._seeds).ravel()[:, np.newaxis]


def _path(states: Floats, pieces: Floats, restarts: Collection[int]) -> Path:
    """Path of one leg, whose derivatives are chained over the restarts.

    Args:
        states: angles and rates (n, 4).
        pieces: derivatives since the last restart, of n rows or more (m, 4, seeds).
        restarts: rows of the restarts.
    """
    pieces, last = pieces[: len(states)], len(states) - 1
    chosen = tuple(sorted(row for row in restarts if row < last))
    chained = pieces.copy() if chosen else pieces
    for begin, end in pairwise([*chosen, last]):
        rows = slice(begin + 1, end + 1)
        chained[rows] = pieces[rows, :, :STATES] @ chained[begin]
        chained[rows, :, STATES:] += pieces[rows, :, STATES:]
    return Path(states=states, slopes=chained[:, :2], pieces=pieces, restarts=chosen)


def _check(block: Any, time: float) -> None:
    """Refuse a stretch that was not integrated to its end; raises PlantFault."""
    reached = {hy.taylor_outcome.time_limit}
    if any(each[0] not in reached for each in block.propagate_res) or not np.all(
        np.isfinite(block.state)
    ):
        raise PlantFault(
            "integration failed", f"integration failed after t = {time:.6f} s: a leg runs away"
        )


def _padded(rows: Floats, length: int) -> Floats:
    """Rows (n, ...) lengthened by their last one."""
    return np.concatenate([rows, np.repeat(rows[-1:], length - len(rows), axis=0)])


def _padded_times(times: Floats, length: int) -> Floats:
    """Times (n,) lengthened by intervals like their last one [s]."""
    missing = length - len(times)
    last = times[-1] - times[-2] if len(times) > 1 else 1e-3
    return np.concatenate([times, times[-1] + last * np.arange(1, missing + 1)])
