"""The whole explanation: effects, fits, what else they have to agree with, and what to do next."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from legbench.design import LegDesign
from legbench.experiment import Experiment
from legbench.experiment.data import check_seed
from legbench.explain.apart import ProposedExperiment, count_proposals, propose
from legbench.explain.causes import Cause
from legbench.explain.consistency import StatementCheck, checks_of, count_predictions, predict
from legbench.explain.engine import NOBODY, Watch, in_setup
from legbench.explain.fitting import (
    CauseFit,
    count_fitted,
    effective,
    fit_pairs,
    fit_singles,
    perfect_fit,
)
from legbench.explain.jumping import PredictedHop, hops_of
from legbench.explain.motor_end import MotorEnd, count_ends, motor_ends
from legbench.explain.screening import Screened, ScreeningMethod, count_screened, screen
from legbench.explain.sensitivity import Sensitivity, count_sensitivities, sensitivities
from legbench.explain.targets import MISSING, Target
from legbench.paper import Published
from legbench.servo import PERFECT

JUDGED = 16
"""Largest number of fits that are tried against everything else that was measured [-]."""
AT_LEAST = 3
"""Number of fits that are tried if fewer reach the target [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedFit:
    """One fit and how it agrees with everything else that was measured."""

    fit: CauseFit
    checks: tuple[StatementCheck, ...]
    """Statements of the paper; empty if there was no time for them."""
    hop: PredictedHop | None
    """Jump of this leg; none if it was not simulated."""

    @property
    def held(self) -> int:
        """Number of statements that hold."""
        return sum(check.held for check in self.checks)


@dataclass(frozen=True, slots=True, kw_only=True)
class Explanation:
    """Everything that was found about the ratings of a target."""

    design: LegDesign
    """Leg that its controller believes in."""
    target: Target
    perfect: JudgedFit
    """Leg without any imperfection."""
    sensitivities: tuple[Sensitivity, ...]
    """Effects of plausible sizes, the largest first."""
    screened: tuple[Screened, ...]
    """Weights when everything is there at once; empty if that was not asked for."""
    singles: tuple[CauseFit, ...]
    """Fits of one cause, the best first."""
    pairs: tuple[CauseFit, ...]
    """Fits of two causes, the best first; empty if they were not asked for."""
    judged: tuple[JudgedFit, ...]
    """Best fits, those first that agree best with everything else."""
    ends: tuple[MotorEnd, ...]
    """One motor that ends at its range, in each setup."""
    proposals: tuple[ProposedExperiment, ...]
    """Steps that tell apart the fits that reach the target, the best first."""
    complete: bool
    """Whether nobody stopped it."""

    @property
    def best(self) -> JudgedFit | None:
        """Fit that agrees best: it reaches the target if one does, then most statements hold, then
        its sizes are the most plausible, then its misfit is the smallest.
        """
        return self.judged[0] if self.judged else None

    @property
    def alike(self) -> tuple[CauseFit, ...]:
        """Fits that the target cannot tell apart: every period is within its tolerance."""
        return tuple(judged.fit for judged in self.judged if judged.fit.within)

    @property
    def reaching(self) -> int:
        """Number of fits that reach the target, whether they were judged or not."""
        return sum(fit.within for fit in plain(self.singles, self.pairs))

    @property
    def experiment(self) -> Experiment | None:
        """Step of the target on the leg that explains it best; none without any fit."""
        if self.best is None:
            return None
        step, leg = self.target.experiment(self.design), self.best.fit.imperfections
        return replace(step, imperfections=in_setup(leg, self.target.setup))


@dataclass(frozen=True, slots=True, kw_only=True)
class Scope:
    """What is to be explored, and how."""

    pairs: bool = False
    """Whether to fit two causes together."""
    method: ScreeningMethod | None = None
    """Method of global screening; none: no screening."""
    setups: bool = True
    """Whether to try the best fits in the other setups, and a motor that ends at its range."""
    jump: bool = True
    """Whether to simulate the jump of the best fits, too."""
    seed: int = 0
    """Seed of the screening."""

    def __post_init__(self) -> None:
        check_seed(self.seed)


def explain(
    design: LegDesign,
    target: Target,
    causes: Sequence[Cause],
    numbers: Mapping[str, Published],
    scope: Scope | None = None,
    watch: Watch = NOBODY,
) -> Explanation:
    """Find what reproduces the ratings of a target; stopped, it returns what it has.

    Args:
        design: leg that its controller believes in.
        target: ratings to reproduce.
        causes: causes to consider. Those that act on the motors cycle by cycle take part in pairs
            only if there is nothing else.
        numbers: published numbers for everything that is checked beside the target.
        scope: what to explore; by default single causes and the jump.
        watch: who waits.

    Raises:
        ConfigError: the design cannot do the target's step.
        MissingExtraError: screening was asked for and SALib is not installed.
    """
    scope = scope or Scope()
    watch.begin("effects one at a time", count_sensitivities(causes))
    effects = sensitivities(design, target, causes, watch)
    screened: list[Screened] = []
    if scope.method is not None and not watch.stopped():
        watch.begin("screening", count_screened(scope.method, len(causes)))
        screened = screen(design, target, causes, scope.method, scope.seed, watch)
    watch.begin(f"fits of {len(causes)} causes", count_fitted(len(causes), 1))
    singles = _reached(fit_singles(design, target, causes, watch))
    pairs = _pairs(design, target, causes, watch) if scope.pairs else []
    chosen = choose(singles, pairs)
    perfect, judged = _judge(design, target, numbers, chosen, scope, watch)
    return Explanation(
        design=design,
        target=target,
        perfect=perfect,
        sensitivities=tuple(effects),
        screened=tuple(screened),
        singles=tuple(singles),
        pairs=tuple(pairs),
        judged=tuple(judged),
        ends=tuple(_ends(design, numbers, scope, watch)),
        proposals=tuple(_proposals(design, [one.fit for one in judged], watch)),
        complete=not watch.stopped(),
    )


def _ends(
    design: LegDesign, numbers: Mapping[str, Published], scope: Scope, watch: Watch
) -> list[MotorEnd]:
    if not scope.setups or watch.stopped():
        return []
    watch.begin("a motor that ends at its range", count_ends())
    return motor_ends(design, numbers, watch)


def _proposals(
    design: LegDesign, fits: Sequence[CauseFit], watch: Watch
) -> list[ProposedExperiment]:
    alike = [fit for fit in fits if fit.within]
    if len(alike) < 2 or watch.stopped():
        return []
    watch.begin("the next experiment", count_proposals(len(alike)))
    return propose(design, alike, watch)


def _pairs(
    design: LegDesign, target: Target, causes: Sequence[Cause], watch: Watch
) -> list[CauseFit]:
    """Fits of every two causes that matter at all."""
    if watch.stopped():
        return []
    fast = [cause for cause in causes if not cause.sampled]
    some = effective(design, target, fast if len(fast) > 1 else causes)
    count = len(some) * (len(some) - 1) // 2
    if count == 0:
        return []
    watch.begin(f"fits of {count} pairs of {len(some)} causes", count_fitted(count, 2))
    return _reached(fit_pairs(design, target, some, watch))


def _reached(fits: Sequence[CauseFit]) -> list[CauseFit]:
    """Fits that were computed before somebody stopped."""
    return [fit for fit in fits if fit.worst < MISSING]


def choose(singles: Sequence[CauseFit], pairs: Sequence[CauseFit]) -> list[CauseFit]:
    """Fits that are worth to be judged: those within the target, or else the best few."""
    ranked = sorted(plain(singles, pairs), key=lambda fit: fit.misfit)
    within = [fit for fit in ranked if fit.within]
    return within[:JUDGED] if len(within) >= AT_LEAST else ranked[:AT_LEAST]


def plain(singles: Sequence[CauseFit], pairs: Sequence[CauseFit]) -> list[CauseFit]:
    """Fits of one cause, and of two where neither of them reaches the target alone.

    A pair of which one cause is enough explains nothing more.
    """
    enough = {fit.causes[0].name for fit in singles if fit.within}
    needed = [fit for fit in pairs if not any(cause.name in enough for cause in fit.causes)]
    return [*singles, *needed]


def _judge(
    design: LegDesign,
    target: Target,
    numbers: Mapping[str, Published],
    fits: Sequence[CauseFit],
    scope: Scope,
    watch: Watch,
) -> tuple[JudgedFit, list[JudgedFit]]:
    """Try the perfect leg and the fits against everything else; the best come first."""
    perfect = perfect_fit(design, target)
    all_fits = [perfect, *fits]
    if watch.stopped() or not scope.setups:
        bare = [JudgedFit(fit=fit, checks=(), hop=None) for fit in all_fits]
        return bare[0], bare[1:]
    legs = [PERFECT, *(fit.imperfections for fit in fits)]
    watch.begin("the other setups", count_predictions(len(legs)))
    predicted = predict(design, target, numbers, legs, watch)
    hops: list[PredictedHop | None] = [None] * len(legs)
    if scope.jump and not watch.stopped():
        watch.begin("the jump", len(legs))
        hops = [*hops_of(design, legs)]
        watch.advance(len(legs))
    known = not watch.stopped()
    judged = [
        JudgedFit(
            fit=fit,
            checks=checks_of(predicted, place, hop, numbers) if known else (),
            hop=hop,
        )
        for place, (fit, hop) in enumerate(zip(all_fits, hops, strict=True))
    ]
    return judged[0], sorted(judged[1:], key=_order)


def _order(one: JudgedFit) -> tuple[bool, int, float, float]:
    """Order of merit: the target, then what else holds, then plausible sizes, then the misfit."""
    # Sizes that are alike to a tenth of what is plausible are equally so.
    return not one.fit.within, -one.held, round(one.fit.stretch, 1), one.fit.misfit
