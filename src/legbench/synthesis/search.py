"""Search by CMA-ES over the seven ratios (section IV)."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Protocol

import numpy as np

from legbench.design.dependent import INFEASIBLE
from legbench.design.requirements import Bounds
from legbench.errors import ConfigError
from legbench.signals import Floats
from legbench.synthesis._cma import cma
from legbench.synthesis.trace import Trace

SPREAD = 0.3
"""Initial standard deviation, of the width of the bounds."""
TOLERANCE = 1e-12
"""Spread of the cost within a generation that ends a search [-]."""

Cost = Callable[[Floats], Floats]
"""Cost (n,) of ratios (n, 7)."""
Progress = Callable[[int, float], None]
"""Called after a generation with evaluations done and the best cost so far."""


class StopRequest(Protocol):
    """Request to end a search, which is read between generations."""

    @property
    def is_set(self) -> bool:
        """Whether to end the search and keep the best so far."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchSettings:
    """Settings of a search.

    Raises:
        ConfigError: a setting with which there is nothing to search.
    """

    seed: int = 0
    population: int = 20
    """Number of candidates in a generation."""
    restarts: int = 0
    """Number of further searches, each with twice the population; the best counts."""
    evaluations: int = 20_000
    """Largest number of evaluations of all searches together."""

    def __post_init__(self) -> None:
        for name, least in (("seed", 0), ("population", 4), ("restarts", 0), ("evaluations", 1)):
            value = getattr(self, name)
            if value < least:
                raise ConfigError(f"{name} is {value}; it must be {least} or more")


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchResult:
    """Result of a search."""

    free: Floats
    """The best ratios (7,)."""
    cost: float
    evaluations: int
    complete: bool
    """Whether it converged; else it was interrupted or ran out of evaluations."""

    @property
    def feasible(self) -> bool:
        """Whether a leg exists there."""
        return self.cost < INFEASIBLE


def identity_of(problem: Mapping[str, Any], settings: SearchSettings) -> dict[str, Any]:
    """Everything that decides a search, for the first line of its trace."""
    searched = {key: value for key, value in asdict(settings).items() if key != "evaluations"}
    return {"problem": dict(problem), "settings": searched, "pycma": cma.__version__}


def search(
    bounds: Bounds,
    cost: Cost,
    settings: SearchSettings,
    trace: Trace,
    *,
    stop: StopRequest | None = None,
    progress: Progress | None = None,
) -> SearchResult:
    """Minimise `cost` within bounds; every evaluation goes into `trace`.

    Bounds are met by a transformation that reaches them exactly: the paper's optimum lies on six.
    """
    complete = True
    for restart in range(settings.restarts + 1):
        population = settings.population << restart
        generator = np.random.default_rng([settings.seed, restart])
        strategy = _strategy(bounds, population, generator)
        while complete and not strategy.stop():
            if (stop is not None and stop.is_set) or len(trace) >= settings.evaluations:
                complete = False
                break
            unit = np.array(strategy.ask())
            points = _ratios(bounds, unit)
            known = trace.recall(points)
            costs = cost(points) if known is None else known
            trace.append(points, costs, recalled=known is not None)
            strategy.tell(list(unit), costs.tolist())
            if progress is not None:
                progress(len(trace), trace.best()[1])
    if len(trace) == 0:
        raise ConfigError("the search was stopped before it had tried anything")
    free, lowest = trace.best()
    return SearchResult(free=free, cost=lowest, evaluations=len(trace), complete=complete)


def _ratios(bounds: Bounds, unit: Floats) -> Floats:
    """Ratios within the bounds (n, 7) for points of the unit cube (n, 7)."""
    return bounds.lower + np.clip(unit, 0.0, 1.0) * (bounds.upper - bounds.lower)


def _strategy(
    bounds: Bounds, population: int, generator: np.random.Generator
) -> cma.CMAEvolutionStrategy:
    """A search in the unit cube that draws from `generator` alone and writes nothing."""
    start = (bounds.start - bounds.lower) / (bounds.upper - bounds.lower)
    options = {
        "bounds": [0.0, 1.0],
        "popsize": population,
        "randn": lambda *shape: generator.standard_normal(shape),
        "seed": float("nan"),
        "tolfun": TOLERANCE,
        "verbose": -9,
        "verb_log": 0,
    }
    return cma.CMAEvolutionStrategy(start, SPREAD, options)
