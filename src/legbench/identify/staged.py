"""Identification in stages: data, wiring, identifiability, fit, errors, adequacy, held-out runs.

    outcome = identify([load(path) for path in runs], free=parse_free(["k1", "k2"]))
    outcome.trusted, outcome.estimate("k1").value

A stage that fails ends it: hopeless data are not fitted, and what cannot be seen is refused.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from legbench.analytic.terms import Bars
from legbench.design import LegDesign
from legbench.errors import ConfigError, PlantFault
from legbench.identify.adequacy import residuals_of, scores_of
from legbench.identify.alternatives import OtherBars, explain
from legbench.identify.base import LegParameters, mended
from legbench.identify.checks import DataFinding, check_data
from legbench.identify.estimates import estimates_of
from legbench.identify.fitting import LeastSquaresFit, fit
from legbench.identify.gate import check_gate, look, pairs_alike
from legbench.identify.held_out import hold_out
from legbench.identify.outcome import Identification
from legbench.identify.parameters import INDEX, Freedom
from legbench.identify.prediction import Guess, nothing_moved
from legbench.identify.problem import Misfit, Problem
from legbench.identify.regression import regressed
from legbench.identify.spread import spread_of
from legbench.identify.trial import FitTrial
from legbench.identify.verdict import reasons_against
from legbench.identify.wiring import check_wiring
from legbench.mjcf.fitting import fitted_bar_density

ALIKE: Final = 0.99
"""Correlation from which two parameters are told to be hard to tell apart [-]."""
APART: Final = 0.5
"""Largest logarithm by which the further starts are off [-]: 0.6 to 1.65 times."""
SAME: Final = 1e-3
"""Share of the sum of squares within which two starts have ended alike [-]."""

Say = Callable[[str], None]
"""Told what is being done."""


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentificationTask:
    """What is to be learned, from which runs, starting where."""

    design: LegDesign
    """Leg as designed, where a fit starts."""
    trials: tuple[FitTrial, ...]
    held_out: tuple[FitTrial, ...] = ()
    free: Freedom = field(default_factory=Freedom)
    mass: float | None = None
    """Mass of the whole leg as weighed [kg]; none: that of the design."""
    bars: Bars | None = None
    """Bars of the linkage; none: they weigh nothing."""
    starts: int = 3
    """Number of starts of the fit: from the design, from a regression, and from legs beside it."""
    seed: int = 0
    """Source of the further starts."""

    def __post_init__(self) -> None:
        if not self.trials:
            raise ConfigError("no run to learn from; give one or more")
        if self.starts < 1:
            raise ConfigError(f"starts is {self.starts}; it must be 1 or more")
        if self.mass is not None and not 0.0 < self.mass < np.inf:
            raise ConfigError(f"mass is {self.mass:g} kg; it must be positive and finite")

    @property
    def leg(self) -> LegParameters:
        """Leg that the fit starts from."""
        return LegParameters.of(self.design, bars=self.bars, mass=self.mass)

    @property
    def other_bars(self) -> OtherBars | None:
        """The leg with bars as they usually are, or without; none: it is too light for them."""
        held = 0.0 if self.bars is None else self.bars.density
        try:
            bars = None if held else Bars(density=fitted_bar_density(self.design))
        except ConfigError:
            return None
        leg = LegParameters.of(self.design, bars=bars, mass=self.mass)
        return OtherBars(held=held, density=0.0 if bars is None else bars.density, leg=leg)


def identify(task: IdentificationTask, say: Say = lambda _: None) -> Identification:
    """Learn the parameters of a leg from runs.

    Raises:
        UnidentifiableError: the runs cannot show what is to be free; says which direction is
            unseen, and what to add.
        PlantFault: the design cannot be predicted at all.
    """
    leg, trials = task.leg, task.trials
    runs = tuple(trial.name for trial in trials)
    left_out = tuple(len(trial.left_out) for trial in trials)
    say("checking the data")
    findings = _findings(task, leg)
    if any(finding.hopeless for finding in findings):
        reasons = tuple(f"{each.run}: {each.text}" for each in findings)
        return Identification(
            runs=runs, left_out=left_out, findings=tuple(findings), reasons=reasons
        )
    problem = Problem(trials, leg.reach, task.free)
    guess = Guess(values=leg.values, starts=nothing_moved(trials))
    gate = look(problem.misfit(guess), problem.names)
    check_gate(gate, {trial.setup for trial in trials})
    say("fitting")
    fits = fits_from(problem, guess, task.starts, task.seed)
    best = min(fits, key=lambda each: each.misfit.cost)
    agreeing = [each for each in fits if each.misfit.cost <= best.misfit.cost * (1.0 + SAME)]
    outcome = Identification(
        runs=runs,
        left_out=left_out,
        findings=tuple(findings),
        starts=task.starts,
        agreeing=len(agreeing),
        evaluations=sum(each.evaluations for each in fits),
        converged=best.converged,
    )
    say("judging")
    return _judged(task, problem, best.misfit, outcome)


def _judged(
    task: IdentificationTask, problem: Problem, misfit: Misfit, begun: Identification
) -> Identification:
    """Add to an outcome what is known once the fit has ended."""
    trials, names = task.trials, task.free.names
    gate = look(misfit, problem.names)
    check_gate(gate, {trial.setup for trial in trials})
    spread = spread_of(misfit, trials)
    correlation = spread.correlation[: len(names), : len(names)]
    scores = scores_of(problem, misfit)
    values = misfit.guess.values
    outcome = replace(
        begun,
        gate=gate,
        estimates=estimates_of(names, task.leg.values, values, spread),
        correlation=correlation,
        alike=tuple(pairs_alike(correlation, names, ALIKE)),
        values=values,
        misfit=misfit,
        residuals=tuple(residuals_of(misfit, trials)),
        scores=tuple(scores),
        alternatives=tuple(explain(problem, misfit, scores, task.other_bars)),
        held_out=tuple(hold_out(each, misfit.guess, problem.reach) for each in task.held_out),
    )
    return replace(outcome, reasons=tuple(reasons_against(outcome)))


def _findings(task: IdentificationTask, leg: LegParameters) -> list[DataFinding]:
    limits = task.design.limits
    found = [each for trial in task.trials for each in check_data(trial, limits)]
    if any(finding.hopeless for finding in found):
        return found
    guess = Guess(values=leg.values, starts=nothing_moved(task.trials))
    wrong = check_wiring(task.trials, guess, leg.reach)
    # Angles of encoders that are wired otherwise say nothing about stops.
    rewired = {each.run for each in wrong}
    return [each for each in found if each.run not in rewired or each.what != "stop"] + wrong


def fits_from(problem: Problem, guess: Guess, starts: int, seed: int = 0) -> list[LeastSquaresFit]:
    """Fits from a guess, from what a regression makes of the runs, and from legs beside it.

    Args:
        problem: the runs, and what is free.
        guess: first start; further ones are beside the second, which hardly depends on it.
        starts: number of starts.
        seed: source of those that are drawn.

    Raises:
        PlantFault: no leg can be predicted from the guess.
    """
    found = [fit(problem, guess)]
    near = regressed(problem.trials, guess, problem.freedom, problem.reach) or guess
    random = np.random.default_rng(seed)
    for place in range(starts - 1):
        other = near
        if place or near is guess:
            other = beside(near, problem.freedom, problem.reach, random, APART)
        with suppress(PlantFault):
            found.append(fit(problem, other))
    return found


def beside(
    guess: Guess, free: Freedom, reach: float, random: np.random.Generator, apart: float
) -> Guess:
    """Guess whose free positive parameters are off by factors, mended to be a leg."""
    names = [name for name in free.names if guess.values[INDEX[name]] > 0.0]
    factors = np.exp(random.uniform(-apart, apart, len(names)))
    found = guess
    for name, factor in zip(names, factors.tolist(), strict=True):
        found = found.at(name, float(guess.values[INDEX[name]]) * factor)
    return replace(found, values=mended(found.values, reach)) if _shapes(free) else found


def _shapes(free: Freedom) -> bool:
    """Whether the coupling of the inertias may be changed."""
    return "B" in free.names
