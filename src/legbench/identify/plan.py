"""Planning of the next run: which experiment shrinks the intervals most.

Each candidate is predicted with what is known of the leg; its Jacobian adds to the normal matrix
of the runs so far, and the inverse of the sum tells the errors that would be left. Those that are
best are then simulated, within the safety limits, before one is proposed.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from legbench.errors import ConfigError, PlantFault
from legbench.experiment.data import Experiment
from legbench.experiment.run import run
from legbench.identify.candidates import candidates, trial_of_candidate
from legbench.identify.outcome import Identification
from legbench.identify.parameters import PARAMETERS
from legbench.identify.prediction import Guess, nothing_moved
from legbench.identify.problem import Problem
from legbench.identify.staged import IdentificationTask
from legbench.identify.trial import FitTrial
from legbench.limits.safety import SafetyLimits
from legbench.plants import SimChoice
from legbench.signals import Floats

SHOWN: Final = 8
"""Number of candidates that are shown [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedExperiment:
    """One candidate, and the errors that it would leave."""

    name: str
    experiment: Experiment
    errors: dict[str, float]
    """Standard errors after it, for white noise: shares of positive parameters, units of others."""
    shrinks: dict[str, float]
    """Errors before over errors after; infinite for what was unknown before [-]."""
    figure: float
    """Mean logarithm of the errors that are to shrink [-]: the smaller the better."""

    def to_json(self) -> dict[str, Any]:
        """Name, errors and factors, without the experiment."""
        return {"name": self.name, "errors": self.errors, "shrinks": self.shrinks}


def ranked(
    task: IdentificationTask,
    outcome: Identification | None,
    *,
    sharpen: str | None = None,
    among: Iterable[tuple[str, Experiment]] | None = None,
) -> list[PlannedExperiment]:
    """Rank candidates, the best first.

    Args:
        task: the runs so far, and what is free.
        outcome: what was learned from them; none: nothing, and the design is believed.
        sharpen: the parameter whose error matters; none: all that are free.
        among: candidates with their names; none: all of `candidates`.

    Raises:
        ConfigError: no candidate can be predicted.
    """
    names, values = task.free.names, task.leg.values
    if outcome is not None and outcome.values is not None:
        values = outcome.values
    now = sum(
        (_information(task, trial, values) for trial in task.trials),
        np.zeros((len(names), len(names))),
    )
    before = _errors(now)
    found = []
    for name, experiment in candidates(task) if among is None else among:
        try:
            trial = trial_of_candidate(name, experiment, task)
            after = _errors(now + _information(task, trial, values))
        except (ConfigError, PlantFault):
            continue  # a leg that refuses it or cannot do it is not asked to
        logarithms = np.log(after)
        chosen = logarithms if sharpen is None else logarithms[names.index(sharpen)]
        found.append(
            PlannedExperiment(
                name=name,
                experiment=experiment,
                errors=dict(zip(names, _in_units(names, after), strict=True)),
                shrinks=dict(zip(names, _factors(before, after), strict=True)),
                figure=float(np.mean(chosen)),
            )
        )
    if not found:
        raise ConfigError("no candidate suits this leg; its set points are out of reach")
    return sorted(found, key=lambda plan: plan.figure)


def best_of(
    plans: Sequence[PlannedExperiment],
    limits: SafetyLimits | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> PlannedExperiment:
    """Return the best candidate that a simulated leg can do within the safety limits.

    Raises:
        ConfigError: there is none; says what ended the best.
    """
    first = ""
    for plan in plans:
        tried = replace(plan.experiment, plant=SimChoice(limits=limits))
        ended = run(tried)
        if ended.complete:
            return plan
        first = first or f"{plan.name}: {ended.manifest.get('cause')}"
        say(f"{plan.name} ends early: {ended.manifest.get('cause')}")
    raise ConfigError(f"no candidate stays within the limits ({first}); loosen them")


def plan_lines(plans: Sequence[PlannedExperiment]) -> list[str]:
    """Lines for people: the best candidates, and by what factor each parameter's error shrinks."""
    names = list(plans[0].shrinks)
    width = max(len(plan.name) for plan in plans[:SHOWN])
    head = f"{'next run: errors shrink by':<{width}} " + " ".join(f"{n:>7.7}" for n in names)
    rows = [
        f"{plan.name:<{width}} " + " ".join(f"{plan.shrinks[n]:>7.3g}" for n in names)
        for plan in plans[:SHOWN]
    ]
    return [head, *rows]


def _information(task: IdentificationTask, trial: FitTrial, values: Floats) -> Floats:
    """Normal matrix (m, m) of one run, what is free in its first row being eliminated."""
    problem = Problem([trial], task.leg.reach, task.free)
    guess = Guess(values=values, starts=nothing_moved([trial]))
    matrix, _ = problem.misfit(guess).normal()
    own = len(task.free.names)
    mixed, rest = matrix[:own, own:], matrix[own:, own:]
    if not len(rest):
        return matrix
    return matrix[:own, :own] - mixed @ np.linalg.solve(rest, mixed.T)


def _errors(information: Floats) -> Floats:
    """Standard errors (m,) of a normal matrix; infinite along directions that it does not show."""
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    size = np.where(size > 0.0, size, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    # A normal matrix has the square of the Jacobian's condition.
    unseen = values < max(values[-1], 1e-300) * 1e-12
    spread = (vectors[:, ~unseen] ** 2 / values[~unseen]).sum(axis=1)
    lost = (vectors[:, unseen] ** 2).sum(axis=1) > 1e-6
    return np.where(lost, np.inf, np.sqrt(spread)) / size


def _factors(before: Floats, after: Floats) -> list[float]:
    """Factors by which errors shrink; what stays unknown shrinks by nothing."""
    pairs = zip(before.tolist(), after.tolist(), strict=True)
    return [1.0 if one == other else one / other for one, other in pairs]


def _in_units(names: Sequence[str], errors: Floats) -> list[float]:
    scales = [PARAMETERS[name].scale or 1.0 for name in names]
    return [float(error) * scale for error, scale in zip(errors, scales, strict=True)]
