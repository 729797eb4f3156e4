"""Runs that a fit has not seen, predicted by it."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from legbench.errors import PlantFault
from legbench.identify.adequacy import Residual, residuals_of
from legbench.identify.fitting import fit
from legbench.identify.parameters import INDEX, Freedom
from legbench.identify.prediction import Guess, nothing_moved
from legbench.identify.problem import Problem
from legbench.identify.trial import FitTrial

DRIFT: Final = 2.0
"""Factor by which a held-out run may exceed what counts and equations explain [-]: its motion also
has the errors of the estimates in it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldOut:
    """Prediction of one run that was held out."""

    run: str
    residuals: tuple[Residual, ...]
    """Residuals of both joints; none: the leg could not be predicted."""

    @property
    def good(self) -> bool:
        """Whether the run is predicted to the noise of its encoders."""
        return bool(self.residuals) and all(
            each.coloured <= DRIFT * each.allowed + 0.2 * each.sigma for each in self.residuals
        )

    @property
    def text(self) -> str:
        """Say how well it was predicted."""
        if not self.residuals:
            return f"{self.run}: no prediction, the leg runs away"
        parts = (f"q{each.joint} to {each.rms:.2g} rad" for each in self.residuals)
        noise = ", ".join(f"{each.sigma:.2g}" for each in self.residuals)
        return f"{self.run}: {', '.join(parts)} (noise {noise} rad)"


def hold_out(trial: FitTrial, guess: Guess, reach: float) -> HeldOut:
    """Predict a run from fitted parameters; its first posture alone is its own."""
    rubs = any(guess.values[INDEX[name]] for name in ("f1", "f2"))
    problem = Problem([trial], reach, Freedom(names=()), friction=rubs)
    own = Guess(values=guess.values, starts=nothing_moved([trial]))
    try:
        misfit = fit(problem, own, horizons=(None,)).misfit
    except (PlantFault, np.linalg.LinAlgError):
        return HeldOut(run=trial.name, residuals=())
    return HeldOut(run=trial.name, residuals=tuple(residuals_of(misfit, [trial])))
