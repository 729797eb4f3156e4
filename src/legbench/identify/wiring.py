"""Encoders that are swapped or count backwards: competing hypotheses, each tried on the model."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Final

import numpy as np

from legbench.errors import PlantFault
from legbench.identify.checks import DataFinding
from legbench.identify.prediction import Guess, Predictor
from legbench.identify.trial import FitTrial
from legbench.signals import Floats

SUSPICIOUS: Final = 0.15
"""Misfit from which the wiring is doubted [rad]: springs that are half as stiff make less."""
BETTER: Final = 3.0
"""Factor by which another wiring must fit better to be named [-]."""
AS_GOOD: Final = 1.5
"""Factor within which two wirings explain the data alike [-]."""


def check_wiring(trials: Sequence[FitTrial], guess: Guess, reach: float) -> list[DataFinding]:
    """Find runs that another wiring of the encoders explains far better than the one recorded."""
    found = []
    for place, trial in enumerate(trials):
        alone = replace(guess, starts=guess.starts[place : place + 1])
        as_wired = _misfit(trial, alone, reach)
        if as_wired <= SUSPICIOUS:
            continue
        others = {
            (words, what): _misfit(other, alone, reach) for words, what, other in _hypotheses(trial)
        }
        best = min(others.values())
        if best * BETTER > as_wired:
            continue
        alike = [each for each, misfit in others.items() if misfit <= AS_GOOD * best]
        text = " or ".join(words for words, _ in alike)
        found.append(
            DataFinding(
                run=trial.name,
                what=" or ".join(dict.fromkeys(what for _, what in alike)),
                text=f"{text}: the angles then fit to {best:.2g} rad, as recorded to "
                f"{as_wired:.2g} rad",
                hopeless=True,
            )
        )
    return found


def _misfit(trial: FitTrial, guess: Guess, reach: float) -> float:
    """Root mean square of measured less predicted angles [rad]; infinite if there is no motion."""
    try:
        links = Predictor([trial], reach, friction=False).predict(guess)[0].links
    except PlantFault:
        return float("inf")
    return float(np.sqrt(np.mean((trial.joint_pos - links) ** 2)))


def _hypotheses(trial: FitTrial) -> list[tuple[str, str, FitTrial]]:
    """Every other wiring of link or motor encoders: words, short name, and the run under it."""
    found = []
    for side in ("link", "motor"):
        values = trial.joint_pos if side == "link" else trial.motor_pos
        for swap, first, second in product((False, True), (1.0, -1.0), (1.0, -1.0)):
            if not swap and first == second == 1.0:
                continue
            other = (values[:, ::-1] if swap else values) * np.array([first, second])
            found.append((*_named(side, swap, first, second), _rewired(trial, side, other)))
    return found


def _rewired(trial: FitTrial, side: str, values: Floats) -> FitTrial:
    return trial.with_links(values) if side == "link" else replace(trial, motor_pos=values)


def _named(side: str, swap: bool, first: float, second: float) -> tuple[str, str]:
    backwards = [str(joint + 1) for joint, sign in enumerate((first, second)) if sign < 0.0]
    words = [f"{side} encoders swapped"] if swap else []
    if backwards:
        words.append(f"{side} encoder {' and '.join(backwards)} with the wrong sign")
    short = ["swapped"] if swap else []
    return ", ".join(words), " and ".join([*short, *(["sign"] if backwards else [])])
