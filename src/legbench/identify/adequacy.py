"""Whether a fit leaves noise alone: whiteness by run and joint, and what else would explain it.

Means over a few rows are small if residuals are white, and large if they hang together. What the
counts of the encoders explain is allowed; so is what equations and simulation differ by.

A parameter that is not free has a score: how much the sum of squares would fall if it were. By that
a wrong fixed inertia, a delay or a stretched time are told from each other, though all of them only
make the residuals larger (Rao's score test).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from legbench.identify.noise import FLOOR
from legbench.identify.parameters import INDEX, PARAMETERS, moved
from legbench.identify.prediction import Guess, Predictor
from legbench.identify.problem import Misfit, Problem, all_slopes
from legbench.identify.trial import FitTrial
from legbench.signals import Floats

ROWS: Final = 20
"""Rows of a mean [-]: a tenth of a period of a swinging leg."""
RARE: Final = 4.0
"""Standard deviations beyond which a mean square is no chance [-]."""
SIGNIFICANT: Final = 30.0
"""Fall of the sum of squares from which a parameter is no chance [-]: one in 10^7 for white noise,
which leaves room for the dozen that are tried."""
UNSEEN: Final = 1e-4
"""Share of a parameter's slope that the free ones must leave of it for it to be told [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Residual:
    """What a fit leaves of one joint in one run."""

    run: str
    joint: int
    """1 for q1, 2 for q2."""
    rms: float
    """Root mean square [rad]."""
    sigma: float
    """Standard deviation of the encoder [rad]."""
    coloured: float
    """Root mean square of what hangs together over `ROWS` rows [rad]."""
    allowed: float
    """What of it counts and equations explain [rad]."""

    @property
    def white(self) -> bool:
        """Whether nothing hangs together beyond what is allowed."""
        return self.coloured <= self.allowed


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """What freeing one more parameter would gain."""

    name: str
    value: float
    """Value that it would take, about, with all others as they are [unit]."""
    gain: float
    """Fall of the sum of squares, against what coloured noise makes of it [-]."""


def residuals_of(misfit: Misfit, trials: Sequence[FitTrial]) -> list[Residual]:
    """Residuals of a fit by run and joint."""
    found = []
    for trial, residuals in zip(trials, misfit.residuals, strict=True):
        for joint in (0, 1):
            own, sigma = residuals[:, joint], float(trial.sigma[joint])
            square, chance = _of_means(own)
            found.append(
                Residual(
                    run=trial.name,
                    joint=joint + 1,
                    rms=sigma * float(np.sqrt(np.mean(np.delete(own, trial.left_out) ** 2))),
                    sigma=sigma,
                    coloured=sigma * math.sqrt(max(0.0, square - chance)),
                    allowed=_explained(trial, joint),
                )
            )
    return found


def _of_means(residuals: Floats) -> tuple[float, float]:
    """Mean square of means over `ROWS` rows, and its largest value by chance [-]."""
    count = len(residuals) // ROWS
    means = residuals[: count * ROWS].reshape(count, ROWS).mean(axis=1)
    return float(np.mean(means**2)), (1.0 + RARE * math.sqrt(2.0 / count)) / ROWS


def _explained(trial: FitTrial, joint: int) -> float:
    """Coloured residual that the counts of link and motor encoders explain [rad].

    Motors that stand have been fitted; one that creeps is up to half a count beside what its
    encoder shows, and a link that comes to rest stays so.
    """
    link = trial.links[joint].count / math.sqrt(12.0)
    return math.hypot(FLOOR, link, 0.5 * trial.motors[joint].count)


def scores_of(problem: Problem, misfit: Misfit) -> list[Score]:
    """Scores of every parameter that is not free, the largest gain first."""
    free = set(problem.freedom.names)
    others = [name for name in PARAMETERS if name not in free]
    slopes = _other_slopes(problem, misfit.guess, others)
    left, own = misfit.whole()
    slopes = np.pad(slopes, ((0, len(misfit.prior)), (0, 0)))
    base = np.linalg.qr(own / np.linalg.norm(own, axis=0))[0]
    excess = _excess(misfit, problem.trials)
    found = []
    for name, slope in zip(others, slopes.T, strict=True):
        bare = slope - base @ (base.T @ slope)
        size = float(bare @ bare)
        if size <= UNSEEN**2 * float(slope @ slope) or size == 0.0:
            continue
        score = float(bare @ left)
        value = float(misfit.guess.values[INDEX[name]])
        step = score / size
        if PARAMETERS[name].positive:
            step = float(np.clip(step, -1.0, 1.0))
        gain = score**2 / (size * excess)
        found.append(Score(name=name, value=moved(name, value, step), gain=gain))
    return sorted(found, key=lambda each: -each.gain)


def _other_slopes(problem: Problem, guess: Guess, names: Sequence[str]) -> Floats:
    """Slopes of all rows by parameters that are not free (rows, p) [-]."""
    predictor = Predictor(problem.trials, problem.reach, friction=True)
    predicted = predictor.predict(guess)
    places = [INDEX[name] for name in names]
    return np.concatenate(
        [
            all_slopes(each, trial, guess.values)[:, :, places].reshape(-1, len(names))
            for each, trial in zip(predicted, problem.trials, strict=True)
        ]
    )


def _excess(misfit: Misfit, trials: Sequence[FitTrial]) -> float:
    """Factor by which coloured noise raises the variance of a score [-].

    It is measured from the residuals, and bounded by what the counts of the encoders can make.
    """
    most = 1.0
    for trial, residuals in zip(trials, misfit.residuals, strict=True):
        for joint in (0, 1):
            measured = ROWS * _of_means(residuals[:, joint])[0]
            share = _explained(trial, joint) / float(trial.sigma[joint])
            most = max(most, min(measured, 1.0 + ROWS * share**2))
    return most
