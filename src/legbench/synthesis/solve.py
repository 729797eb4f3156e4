"""Solution of requirements: a finished leg, and everything that tells how good it is."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from legbench.design import LegDesign
from legbench.design.dependent import MARGINS, cost, design_of, margins, objective, solve_dependent
from legbench.design.matching import Condition, Parameters, check_conditions, standing_angle
from legbench.design.requirements import VARIABLES, Requirements, requirements_to_mapping
from legbench.design.toml import design_to_mapping
from legbench.errors import DesignError
from legbench.signals import Floats
from legbench.strict_json import null_for_nan
from legbench.synthesis.crosscheck import evolve
from legbench.synthesis.search import (
    Cost,
    Progress,
    SearchResult,
    SearchSettings,
    StopRequest,
    identity_of,
    search,
)
from legbench.synthesis.sensitivity import ActiveBound, active_bounds, refine
from legbench.synthesis.trace import Trace

MARGIN_UNITS = (
    *("m1/m_leg", "m2/m_leg", "m3/m_leg", "I1/(m_leg l2^2)", "margin/(k1 + k2)"),
    *(f"(largest I{n} - I{n})/(m_leg l2^2)" for n in (1, 2, 3)),
)
"""What the margins of `dependent.margins` are shares of."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Solution:
    """Leg that a search has found, with the figures of the search."""

    requirements: Requirements
    design: LegDesign
    free: Floats
    """The seven ratios (7,)."""
    objective: float
    """Value of objective (11) [-]."""
    cost: float
    """Cost that was minimised: objective (11), and, where asked for, the price of scatter [-]."""
    conditions: tuple[Condition, ...]
    active: tuple[ActiveBound, ...]
    evaluations: int
    complete: bool
    """Whether the search converged; else this is the best so far."""
    seed: int
    check: SearchResult | None
    """Result of differential evolution, if it was asked for."""

    def to_json(self) -> dict[str, Any]:
        """Return everything as one JSON object."""
        checked = None
        if self.check is not None:
            checked = {
                "objective": self.check.cost,
                "evaluations": self.check.evaluations,
                "ratios": dict(zip(VARIABLES, self.check.free.tolist(), strict=True)),
                "objective_difference": self.check.cost - self.objective,
                "ratio_difference": float(np.abs(self.check.free - self.free).max()),
            }
        return {
            "requirements": requirements_to_mapping(self.requirements),
            "design": design_to_mapping(self.design),
            "ratios": dict(zip(VARIABLES, self.free.tolist(), strict=True)),
            "objective": self.objective,
            "cost": self.cost,
            "residuals": conditions_to_json(self.conditions),
            "active_bounds": [null_for_nan(asdict(bound)) for bound in self.active],
            "evaluations": self.evaluations,
            "complete": self.complete,
            "seed": self.seed,
            "differential_evolution": checked,
        }


def conditions_to_json(conditions: Sequence[Condition]) -> dict[str, Any]:
    """Conditions by name."""
    return {
        condition.name: {
            "equation": condition.equation,
            "residual": condition.residual,
            "scale": condition.scale,
            "unit": condition.unit,
            "ratio": condition.ratio,
        }
        for condition in conditions
    }


def solve(
    requirements: Requirements,
    settings: SearchSettings,
    *,
    trace: Trace | None = None,
    scatter_cost: Callable[[Sequence[LegDesign]], Floats] | None = None,
    cross_check: bool = True,
    stop: StopRequest | None = None,
    progress: Progress | None = None,
) -> Solution:
    """Search, refine and judge a leg.

    Args:
        requirements: what to design for.
        settings: how to search.
        trace: where the evaluations are kept; by default in memory.
        scatter_cost: what candidates that exist pay on top of objective (11), e.g. for ratings
            lost to manufacture. The result is then neither refined nor cross-checked, and the
            bounds' costs, which belong to (11), are left out.
        cross_check: whether differential evolution has to find the same.
        stop: ends the search early, with the best so far.
        progress: called after every generation.

    Raises:
        DesignError: no leg meets the requirements; the message names what cannot be met.
    """
    plain = scatter_cost is None
    total = _total_cost(requirements, scatter_cost)
    if trace is None:
        trace = Trace(identity_of(requirements_to_mapping(requirements), settings))
    try:
        found = search(requirements.bounds, total, settings, trace, stop=stop, progress=progress)
    finally:
        trace.close()
    if not found.feasible:
        if not found.complete:
            raise DesignError(
                f"none of the {len(trace)} legs that were tried meets requirements "
                f"'{requirements.name}', and the search was not over: give it more --evaluations, "
                "some 20000"
            )
        raise DesignError(explain(requirements, found.free))
    settled = plain and found.complete
    check = evolve(requirements.bounds, total, settings.seed) if settled and cross_check else None
    return _judged(requirements, found, check, seed=settings.seed, plain=plain)


def _judged(
    requirements: Requirements,
    found: SearchResult,
    check: SearchResult | None,
    *,
    seed: int,
    plain: bool,
) -> Solution:
    """Refine what the search found, if it minimised objective (11) alone, and judge the leg."""
    settled = plain and found.complete
    free = refine(requirements, found.free) if settled else found.free
    design = design_of(requirements, free)
    value = float(objective(requirements, solve_dependent(requirements, free)))
    angle = standing_angle(design, requirements.relaxed_length)
    return Solution(
        requirements=requirements,
        design=design,
        free=free,
        objective=value,
        cost=value if plain else found.cost,
        conditions=check_conditions(Parameters.of(design), angle),
        active=active_bounds(requirements, free) if settled else (),
        evaluations=found.evaluations,
        complete=found.complete,
        seed=seed,
        check=check,
    )


def _total_cost(
    requirements: Requirements, scatter_cost: Callable[[Sequence[LegDesign]], Floats] | None
) -> Cost:
    def plain(free: Floats) -> Floats:
        return cost(requirements, free)

    if scatter_cost is None:
        return plain

    def robust(free: Floats) -> Floats:
        value = plain(free)
        designs: list[LegDesign] = []
        kept: list[int] = []
        for index, ratios in enumerate(free):
            try:
                designs.append(design_of(requirements, ratios))
                kept.append(index)
            except DesignError:
                continue
        if designs:
            value[kept] += scatter_cost(designs)
        return value

    return robust


def explain(requirements: Requirements, free: Floats) -> str:
    """Name the condition that keeps the nearest leg (7,) from existing."""
    margin = margins(requirements, solve_dependent(requirements, free))
    lacking = [
        f"{name} ({unit} = {value:.3g})"
        for name, unit, value in zip(MARGINS, MARGIN_UNITS, margin, strict=False)
        if not value > 0.0
    ]
    overhang = requirements.overhang
    freely = "" if overhang is None else f", or allow a larger overhang than {overhang:g} m"
    return (
        f"no leg within the bounds meets requirements '{requirements.name}'; the nearest one lacks "
        f"{' and '.join(lacking)}: change leg_com ({requirements.leg_com:g} m), relaxed_length "
        f"({requirements.relaxed_length:g} m) or leg_stiffness ({requirements.leg_stiffness:g} "
        f"N/m), or widen the bounds{freely}"
    )
