"""Least-squares problem of some runs: residuals in standard deviations, and their Jacobian."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from legbench.analytic.sensitivity import STATES
from legbench.identify.parameters import INDEX, PARAMETERS, Freedom, moved, steps_of
from legbench.identify.prediction import Guess, Prediction, Predictor
from legbench.identify.trial import Trial
from legbench.signals import Floats

START_SCALE = np.array([1e-2, 1e-2, 1e-1, 1e-1])
"""Typical error of posture and rates in the first row [rad, rad/s]."""
PARTS = ("first q1", "first q2", "first rate of q1", "first rate of q2")
"""Names of what may be free in the first row."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Misfit:
    """Residuals of a guess, in standard deviations of the encoders, and their derivatives."""

    guess: Guess
    residuals: tuple[Floats, ...]
    """Measured less predicted (n, 2) of each run [-]."""
    jacobians: tuple[Floats, ...]
    """Derivatives of the prediction by the fit's steps (n, 2, m) of each run [-]."""
    rounding: tuple[Floats, ...]
    """Derivatives of the prediction by what the motors' counts hide, one for each motor, in
    standard deviations of a rounding (n, 2, 2) of each run [-]."""
    cost: float
    """Sum of squares [-]."""

    def normal(self) -> tuple[Floats, Floats]:
        """Normal matrix (m, m) and right side (m,) of a Gauss-Newton step."""
        flat = [each.reshape(-1, each.shape[-1]) for each in self.jacobians]
        pairs = list(zip(flat, self.residuals, strict=True))
        matrix = sum((slope.T @ slope for slope in flat), np.zeros((flat[0].shape[1],) * 2))
        right = sum((slope.T @ each.ravel() for slope, each in pairs), np.zeros(len(matrix)))
        return matrix, right


@final
class Problem:
    """Runs of one leg, and what a fit may change of it."""

    def __init__(
        self, trials: Sequence[Trial], reach: float, freedom: Freedom, *, friction: bool = False
    ) -> None:
        self.trials, self.freedom, self.reach = tuple(trials), freedom, reach
        friction = friction or bool({"f1", "f2"} & set(freedom.names))
        self._predictor = Predictor(trials, reach, friction=friction)

        parts = [
            (place, part)
            for place, trial in enumerate(self.trials)
            for part in range(STATES if trial.moving else STATES // 2)
            if freedom.start or trial.moving
        ]
        self._starts: list[tuple[int, int]] = parts

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all that is free, those of each run's start behind the leg's own."""
        starts = [f"{PARTS[part]} of {self.trials[place].name}" for place, part in self._starts]
        return (*self.freedom.names, *starts)

    def misfit(self, guess: Guess, horizon: float | None = None) -> Misfit:
        """Compare a guess with the runs; raises PlantFault as `Predictor.predict`."""
        predicted = self._predictor.predict(guess, horizon)
        residuals, jacobians, rounding = [], [], []
        for place, (trial, each) in enumerate(zip(self.trials, predicted, strict=True)):
            rows = len(each.links)
            left = (trial.joint_pos[:rows] - each.links) / trial.sigma
            residuals.append(without_rows(left, trial))
            jacobians.append(self._slope(place, trial, each, guess))
            rounding.append(_rounding(trial, each))
        cost = float(sum(np.sum(each * each) for each in residuals))
        return Misfit(
            guess=guess,
            residuals=tuple(residuals),
            jacobians=tuple(jacobians),
            rounding=tuple(rounding),
            cost=cost,
        )

    def _slope(self, place: int, trial: Trial, each: Prediction, guess: Guess) -> Floats:
        """Derivative of one run's prediction by the fit's steps (n, 2, m) [-]."""
        own = all_slopes(each, trial, guess.values)
        chosen = own[:, :, [INDEX[name] for name in self.freedom.names]]
        starts = np.zeros((len(own), 2, len(self._starts)))
        scaled = without_rows(each.by_start * START_SCALE / trial.sigma[:, np.newaxis], trial)
        for column, (run, part) in enumerate(self._starts):
            if run == place:
                starts[:, :, column] = scaled[:, :, part]
        return np.concatenate([chosen, starts], axis=2)

    def stepped(self, guess: Guess, step: Floats) -> Guess:
        """Guess after a step of the fit (m,)."""
        values = guess.values.copy()
        own = len(self.freedom.names)
        for name, amount in zip(self.freedom.names, step[:own].tolist(), strict=True):
            values[INDEX[name]] = moved(name, float(values[INDEX[name]]), amount)
        starts = guess.starts.copy()
        for (run, part), amount in zip(self._starts, step[own:].tolist(), strict=True):
            starts[run, part] += amount * START_SCALE[part]
        return replace(guess, values=values, starts=starts)


def _rounding(trial: Trial, each: Prediction) -> Floats:
    """Derivatives of one run's prediction by the rounding of both motors (n, 2, 2) [-]."""
    places = [INDEX["motor_zero1"], INDEX["motor_zero2"]]
    hidden = np.array([motor.count for motor in trial.motors]) / math.sqrt(12.0)
    return without_rows(each.by_values[:, :, places] * hidden / trial.sigma[:, np.newaxis], trial)


def all_slopes(each: Prediction, trial: Trial, values: Floats) -> Floats:
    """Derivatives of one run's prediction by steps of every parameter (n, 2, p) [-]."""
    scales = np.array([steps_of(name, float(values[INDEX[name]])) for name in PARAMETERS])
    return without_rows(each.by_values * scales / trial.sigma[:, np.newaxis], trial)


def without_rows(values: Floats, trial: Trial) -> Floats:
    """Values of the first rows of a run (n, ...), with zeros where no drive has answered."""
    values[trial.left_out[trial.left_out < len(values)]] = 0.0
    return values
