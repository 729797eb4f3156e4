"""Link angles that parameters predict for recorded runs, with all derivatives."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final, final

import numpy as np

from legbench.analytic.parameters import MOMENT, MOTOR, STIFFNESS
from legbench.analytic.sensitivity import STATES, Path, SensitiveLegs, Track
from legbench.design.statics import balance
from legbench.errors import PlantFault
from legbench.identify.base import can_be, equation_parameters
from legbench.identify.parameters import INDEX
from legbench.identify.rounding import Stretch, by_stretch, stretches_of
from legbench.identify.trial import FitTrial
from legbench.signals import Floats

SHARES: Final = np.linspace(0.1, 1.0, 10)
"""Shares of gravity at which a rest posture is found, one after the other [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Guess:
    """What is believed of a leg and its runs."""

    values: Floats
    """Parameters in the order of `PARAMETERS` (p,)."""
    starts: Floats
    """Posture against the rest posture, and rates, in the first row of each run (r, 4)
    [rad, rad/s]; of a run that begins in motion against what its first rows show."""
    hidden: Floats = field(default_factory=lambda: np.zeros(0))
    """Angles that the counts of the motors' encoders hide, one for each stretch of each run, in
    standard deviations (h,) [-]; empty: there are none."""

    def at(self, name: str, value: float) -> "Guess":
        """Return this guess with another value of one parameter."""
        values = self.values.copy()
        values[INDEX[name]] = value
        return replace(self, values=values)


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """Prediction of one run."""

    links: Floats
    """Link angles as the encoders show them (n, 2) [rad]."""
    by_values: Floats
    """Their derivatives by all parameters (n, 2, p)."""
    by_start: Floats
    """Their derivatives by what is free in the first row (n, 2, 4)."""
    by_hidden: Floats
    """Their derivatives by the hidden angles of this run (n, 2, h)."""


@final
class Predictor:
    """Predictions for some runs of one leg."""

    def __init__(self, trials: Sequence[FitTrial], reach: float, *, friction: bool) -> None:
        self.trials, self.reach = tuple(trials), reach
        self.stretches = tuple(stretches_of(trial) for trial in self.trials)
        self._legs = SensitiveLegs(friction=friction)

    def predict(self, guess: Guess, horizon: float | None = None) -> list[Prediction]:
        """Predict every run, up to `horizon` [s] after its first motion or to its end.

        Raises:
            PlantFault: inertias that no body has, a leg that its springs do not carry, or one that
                runs away.
        """
        if not can_be(guess.values, self.reach):
            raise PlantFault("no such leg", "the inertias are those of no body")
        begun = [
            _begun(run, guess, start, self.reach, rows_within(run.trial, horizon))
            for run, start in zip(self._runs(guess.hidden), guess.starts, strict=True)
        ]
        paths = self._legs.follow([each.track for each in begun])
        return [_measured(path, each, guess) for path, each in zip(paths, begun, strict=True)]

    def _runs(self, hidden: Floats) -> list["_Run"]:
        """Runs with the motors where they are believed to have been."""
        found, first = [], 0
        for trial, stretches in zip(self.trials, self.stretches, strict=True):
            motors = trial.motor_pos.copy()
            for each, angle in zip(stretches, hidden[first:].tolist(), strict=False):
                motors[each.rows, each.joint] += each.sigma * angle
            found.append(_Run(trial=trial, motors=motors, stretches=stretches))
            first += len(stretches)
        return found


def rows_within(trial: FitTrial, horizon: float | None) -> int:
    """Number of rows up to a time after the first motion of the motors [s]."""
    if horizon is None:
        return len(trial.time)
    away = np.abs(trial.motor_pos - trial.motor_pos[0]).max(axis=1)
    moved = np.flatnonzero(away > max(6.0 * each.sigma for each in trial.motors))
    first = trial.time[moved[0]] if len(moved) else trial.time[0]
    return max(2, int(np.searchsorted(trial.time, first + horizon)))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Run:
    """A run, and where its motors are believed to have been."""

    trial: FitTrial
    motors: Floats
    """Positions of the motors, but for their zeros (n, 2) [rad]."""
    stretches: tuple[Stretch, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Begun:
    """A run that is about to be followed."""

    track: Track
    stretches: tuple[Stretch, ...]
    start_by_equations: Floats
    """Derivative of the start by the equations' parameters (4, e)."""
    equations_by_values: Floats
    """Derivative of the equations' parameters by all values (e, p)."""


def _begun(run: _Run, guess: Guess, start: Floats, reach: float, rows: int) -> _Begun:
    """Begin at the rest posture of the first motor positions, plus what is free in it.

    A run that begins in motion begins where its first rows show it, whatever its parameters are.
    """
    trial, stretches = run.trial, run.stretches
    found, slope = equation_parameters(guess.values, reach, trial.setup)
    zeros = guess.values[[INDEX["motor_zero1"], INDEX["motor_zero2"]]]
    slope[[MOTOR, MOTOR + 1], [INDEX["motor_zero1"], INDEX["motor_zero2"]]] = 1.0
    motors = run.motors[:rows] + zeros
    by = np.zeros((STATES, len(found)))
    track = Track(
        times=trial.time[:rows],
        motors=motors[1:],
        start=trial.first_state + start if trial.moving else start,
        parameters=found,
        restarts=tuple(sorted({edge for each in stretches for edge in each.edges})),
    )
    begun = _Begun(
        track=track, stretches=stretches, start_by_equations=by, equations_by_values=slope
    )
    if trial.moving:
        return begun
    stiffness, moment = found[STIFFNESS : STIFFNESS + 2], found[MOMENT : MOMENT + 2]
    rest = motors[0].copy()
    for share in SHARES:
        rest = balance(stiffness, share * moment, motors[0], rest)
    hold = stiffness + moment * np.cos(rest)
    stretch = motors[0] - rest
    if not (
        hold.min() > 0.0 and np.all(np.abs(stiffness * stretch - moment * np.sin(rest)) < 1e-8)
    ):
        raise PlantFault("no rest posture", "the springs do not carry the leg at its start")
    for joint in (0, 1):
        by[joint, STIFFNESS + joint] = stretch[joint] / hold[joint]
        by[joint, MOMENT + joint] = -np.sin(rest[joint]) / hold[joint]
        by[joint, MOTOR + joint] = stiffness[joint] / hold[joint]
    first = np.concatenate([rest + start[:2], start[2:]])
    return replace(begun, track=replace(track, start=first))


def _measured(path: Path, begun: _Begun, guess: Guess) -> Prediction:
    """What the encoders show of a path: late by the delay, off by their zeros."""
    states, by_start = path.states, path.slopes[:, :, :STATES]
    by_equations = path.slopes[:, :, STATES:]
    seeds = by_equations.shape[-1]
    by_equations = by_equations + by_start @ begun.start_by_equations[:, :seeds]
    by_values = by_equations @ begun.equations_by_values[:seeds]
    by_hidden = _by_hidden(path, begun)
    links, rates, delay = states[:, :2], states[:, 2:], guess.values[INDEX["delay"]]
    if delay != 0.0:
        times = begun.track.times
        links, rates, by_values, by_start, by_hidden = _late(
            times, delay, links, rates, by_values, by_start, by_hidden
        )
    by_values[:, :, INDEX["delay"]] -= rates
    for joint in (0, 1):
        zero = INDEX[f"link_zero{joint + 1}"]
        links = links + np.eye(2)[joint] * guess.values[zero]
        by_values[:, joint, zero] += 1.0
    return Prediction(links=links, by_values=by_values, by_start=by_start, by_hidden=by_hidden)


def _by_hidden(path: Path, begun: _Begun) -> Floats:
    """Derivatives of the angles of a path by what is hidden of its motors (n, 2, h)."""
    found = [
        by_stretch(path, each, begun.start_by_equations[:, MOTOR + each.joint])
        for each in begun.stretches
    ]
    return np.stack(found, axis=-1) if found else np.zeros((len(path.states), 2, 0))


def _late(
    times: Floats, delay: float, links: Floats, rates: Floats, *slopes: Floats
) -> tuple[Floats, ...]:
    """Everything `delay` [s] earlier than the rows; before the first row the leg rests.

    Angles are interpolated by cubics through angles and rates, the rest linearly.
    """
    wanted = np.clip(times - delay, times[0], times[-1])
    place = np.clip(np.searchsorted(times, wanted, side="right") - 1, 0, len(times) - 2)
    width = (times[place + 1] - times[place])[:, np.newaxis]
    share = (wanted - times[place])[:, np.newaxis] / width
    before, after = links[place], links[place + 1]
    rise = after - before
    bend = share * (1.0 - share)
    skew = (1.0 - share) * (rates[place] * width - rise) - share * (rates[place + 1] * width - rise)
    found = [before + share * rise + bend * skew]
    for each in (rates, *slopes):
        part = share.reshape(-1, *([1] * (each.ndim - 1)))
        found.append((1.0 - part) * each[place] + part * each[place + 1])
    return tuple(found)


def nothing_moved(trials: Sequence[FitTrial]) -> Floats:
    """Starts (r, 4) of runs that begin at rest."""
    return np.zeros((len(trials), STATES))
