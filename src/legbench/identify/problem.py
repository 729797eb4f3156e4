"""Least-squares problem of some runs: residuals in standard deviations, and their Jacobian."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from legbench.analytic.sensitivity import STATES
from legbench.identify.parameters import INDEX, PARAMETERS, Freedom, moved, steps_of
from legbench.identify.prediction import Guess, Prediction, Predictor
from legbench.identify.trial import FitTrial
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
    hidden: tuple[Floats, ...]
    """Derivatives of the prediction by the angles that the motors' counts hide (n, 2, h) of each
    run [-]; those of the other runs are zero."""
    prior: Floats
    """Those angles, which are zero but for one standard deviation, over all runs (h,) [-]."""
    cost: float
    """Sum of squares, that of the hidden angles included [-]."""

    def parts(self) -> Iterator[tuple[Floats, Floats, slice]]:
        """Yield residuals (n, 2) and derivatives (n, 2, m + h) of each run, with the columns of
        the run's own hidden angles among all.
        """
        first = self.jacobians[0].shape[-1]
        for residuals, own, hidden in zip(self.residuals, self.jacobians, self.hidden, strict=True):
            stop = first + hidden.shape[-1]
            yield residuals, np.concatenate([own, hidden], axis=2), slice(first, stop)
            first = stop

    def normal(self) -> tuple[Floats, Floats]:
        """Normal matrix (m, m) and right side (m,) of a Gauss-Newton step, hidden angles last."""
        own = self.jacobians[0].shape[-1]
        matrix = np.diag(np.append(np.zeros(own), np.ones(len(self.prior))))
        right = np.append(np.zeros(own), -self.prior)
        for residuals, slopes, hidden in self.parts():
            flat = slopes.reshape(-1, slopes.shape[-1])
            columns = np.r_[:own, hidden]
            matrix[np.ix_(columns, columns)] += flat.T @ flat
            right[columns] += flat.T @ residuals.ravel()
        return matrix, right

    def whole(self) -> tuple[Floats, Floats]:
        """Residuals (rows,) and derivatives (rows, m) of all runs, hidden angles last.

        The last rows say that hidden angles are zero but for one standard deviation.
        """
        own = self.jacobians[0].shape[-1]
        left, found = [], []
        for residuals, slopes, hidden in self.parts():
            flat = np.zeros((residuals.size, own + len(self.prior)))
            flat[:, np.r_[:own, hidden]] = slopes.reshape(residuals.size, -1)
            left.append(residuals.ravel())
            found.append(flat)
        found.append(np.eye(own + len(self.prior))[own:])
        return np.concatenate([*left, -self.prior]), np.concatenate(found)


@final
class Problem:
    """Runs of one leg, and what a fit may change of it."""

    def __init__(
        self,
        trials: Sequence[FitTrial],
        reach: float,
        freedom: Freedom,
        *,
        friction: bool = False,
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
        """Compare a guess with the runs; raises PlantFault as `Predictor.predict`.

        Angles that the motors' counts hide are unknowns over the whole run alone: a horizon is for
        finding the way, which half a count does not bar.
        """
        predicted = self._predictor.predict(guess, horizon)
        shown = horizon is None
        residuals, jacobians, hidden = [], [], []
        for place, (trial, each) in enumerate(zip(self.trials, predicted, strict=True)):
            rows = len(each.links)
            left = (trial.joint_pos[:rows] - each.links) / trial.sigma
            residuals.append(without_rows(left, trial))
            jacobians.append(self._slope(place, trial, each, guess))
            by_hidden = each.by_hidden if shown else each.by_hidden[:, :, :0]
            hidden.append(without_rows(by_hidden / trial.sigma[:, np.newaxis], trial))
        prior = self._prior(guess) if shown else np.zeros(0)
        cost = float(sum(np.sum(each * each) for each in residuals) + prior @ prior)
        return Misfit(
            guess=guess,
            residuals=tuple(residuals),
            jacobians=tuple(jacobians),
            hidden=tuple(hidden),
            prior=prior,
            cost=cost,
        )

    def _slope(self, place: int, trial: FitTrial, each: Prediction, guess: Guess) -> Floats:
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
        rest = step[own:].tolist()
        for (run, part), amount in zip(self._starts, rest, strict=False):
            starts[run, part] += amount * START_SCALE[part]
        behind = step[own + len(self._starts) :]
        hidden = self._prior(guess) + behind if len(behind) else guess.hidden
        return replace(guess, values=values, starts=starts, hidden=hidden)

    def _prior(self, guess: Guess) -> Floats:
        """Hidden angles of a guess (h,), which may have none yet [-]."""
        count = sum(len(each) for each in self._predictor.stretches)
        return guess.hidden if len(guess.hidden) else np.zeros(count)


def all_slopes(each: Prediction, trial: FitTrial, values: Floats) -> Floats:
    """Derivatives of one run's prediction by steps of every parameter (n, 2, p) [-]."""
    scales = np.array([steps_of(name, float(values[INDEX[name]])) for name in PARAMETERS])
    return without_rows(each.by_values * scales / trial.sigma[:, np.newaxis], trial)


def without_rows(values: Floats, trial: FitTrial) -> Floats:
    """Values of the first rows of a run (n, ...), with zeros where no drive has answered."""
    values[trial.left_out[trial.left_out < len(values)]] = 0.0
    return values
