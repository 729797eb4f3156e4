"""Competing explanations of a misfit: each is fitted, and those that explain most are named."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from legbench.errors import PlantFault
from legbench.identify.adequacy import SIGNIFICANT, Score
from legbench.identify.base import LegParameters
from legbench.identify.fitting import fit
from legbench.identify.parameters import INDEX, PARAMETERS
from legbench.identify.problem import Misfit, Problem

BARS: Final = "bars"
"""Name of the alternative that the bars weigh something else."""
TRIED: Final = 6
"""Largest number of parameters that are freed in turn [-]."""
NAMED: Final = 0.8
"""Share of the best explanation's gain from which another is named beside it [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OtherBars:
    """Leg of a fit with bars of another mass, which no single parameter stands for."""

    held: float
    """Mass per length of the bars of the fit [kg/m]; zero: they weigh nothing."""
    density: float
    """Mass per length that is tried instead [kg/m]."""
    leg: LegParameters
    """Leg with such bars."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Alternative:
    """Something that was held, and what changing it makes of the fit."""

    name: str
    """Name of a parameter that is freed, or `bars`."""
    held: float
    """Value at which it was held [unit]."""
    value: float
    """Value that it takes when it is free, or that is tried [unit]."""
    share: float
    """Share of the excess of the sum of squares over noise that it explains [-]."""

    @property
    def text(self) -> str:
        """Say what it would have to be."""
        if self.name == BARS:
            weigh = f"of {self.value:.3g} kg/m" if self.value else "without mass"
            return f"bars {weigh} explain {1e2 * self.share:.0f} % of the misfit"
        unit = PARAMETERS[self.name].unit
        change = (
            f"{1e2 * (self.value / self.held - 1.0):+.2g} %"
            if PARAMETERS[self.name].positive
            else f"{self.value - self.held:+.2g} {unit}"
        )
        return f"{self.name} {change} explains {1e2 * self.share:.0f} % of the misfit"


def explain(
    problem: Problem, misfit: Misfit, scores: Sequence[Score], bars: OtherBars | None = None
) -> list[Alternative]:
    """Free the suspicious parameters one by one, and return what each explains, the best first.

    Where there are any, other bars are tried, too: they change inertias and first moments together.
    """
    suspects = [score.name for score in scores if score.gain > SIGNIFICANT][:TRIED]
    expected = sum(each.size for each in misfit.residuals) - len(problem.names)
    excess = max(misfit.cost - expected, 1e-12)
    found = []
    if suspects and bars is not None:
        found += _with_bars(problem, misfit, bars, excess)
    for name in suspects:
        ordered = tuple(each for each in PARAMETERS if each in {*problem.freedom.names, name})
        freedom = replace(problem.freedom, names=ordered)
        wider = Problem(problem.trials, problem.reach, freedom)
        try:
            ended = fit(wider, misfit.guess, horizons=(None,)).misfit
        except PlantFault:
            continue
        found.append(
            Alternative(
                name=name,
                held=float(misfit.guess.values[INDEX[name]]),
                value=float(ended.guess.values[INDEX[name]]),
                share=(misfit.cost - ended.cost) / excess,
            )
        )
    return sorted(found, key=lambda each: -each.share)


def _with_bars(
    problem: Problem, misfit: Misfit, bars: OtherBars, excess: float
) -> list[Alternative]:
    """What other bars explain; nothing if such a leg cannot be predicted."""
    values = bars.leg.values.copy()
    free = [INDEX[name] for name in problem.freedom.names]
    values[free] = misfit.guess.values[free]
    try:
        ended = fit(problem, replace(misfit.guess, values=values), horizons=(None,)).misfit
    except PlantFault:
        return []
    share = (misfit.cost - ended.cost) / excess
    return [Alternative(name=BARS, held=bars.held, value=bars.density, share=share)]


def named(alternatives: Sequence[Alternative]) -> list[Alternative]:
    """Explanations that are about as good as the best one."""
    return [each for each in alternatives if each.share >= NAMED * alternatives[0].share]
