"""Yield of a design under the scatter of manufacture, and its price in a search."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from legbench.design import LegDesign
from legbench.errors import ConfigError
from legbench.signals import Floats
from legbench.synthesis.release import KEPT, Advance, Release, rate_legs, released
from legbench.synthesis.scatter import scatter
from legbench.synthesis.tolerance import TOLERANCES, Tolerances


@dataclass(frozen=True, slots=True, kw_only=True)
class Yield:
    """Yield of a design, with all tolerances and with each alone."""

    tolerances: Tolerances
    release: Release
    legs: int
    kept: int
    """Number of the `legs` that keep P^r above `KEPT`."""
    nominal: float
    """Rating P^r of the design itself [-]."""
    mean: float
    """Ratings P^r of the scattered legs [-]."""
    tenth: float
    """Rating P^r that nine legs of ten keep [-]."""
    causes: dict[str, tuple[float, float]]
    """Tolerance -> share of legs kept and mean P^r, when it scatters alone; the worst first."""


def check_sample(legs: int, seed: int) -> None:
    """Refuse a number of legs below 1, and a seed below 0; raises ConfigError."""
    if legs < 1:
        raise ConfigError(f"legs is {legs}; a yield needs 1 leg or more")
    if seed < 0:
        raise ConfigError(f"seed is {seed}; it must be 0 or more")


def measure_yield(
    design: LegDesign,
    tolerances: Tolerances,
    *,
    legs: int = 1000,
    legs_each: int | None = None,
    seed: int = 0,
    release: Release | None = None,
    progress: Advance | None = None,
) -> Yield:
    """Make `legs` legs with all tolerances, and `legs_each` with each alone; rate all of them.

    By default a tenth as many with each alone.

    Raises:
        ConfigError: fewer than one leg, or a design that cannot be released there.
    """
    release = release or Release()
    legs_each = max(1, legs // 10) if legs_each is None else legs_each
    check_sample(min(legs, legs_each), seed)
    made = [design, *scatter(design, tolerances, legs, seed)]
    for name in TOLERANCES:
        made += scatter(design, tolerances.only(name), legs_each, seed + 1)
    values = rate_legs([design] * len(made), made, release, progress).values
    together, alone = values[1 : legs + 1], values[legs + 1 :].reshape(len(TOLERANCES), legs_each)
    causes = {
        name: (float((row > KEPT).mean()), float(row.mean()))
        for name, row in zip(TOLERANCES, alone, strict=True)
    }
    return Yield(
        tolerances=tolerances,
        release=release,
        legs=legs,
        kept=int((together > KEPT).sum()),
        nominal=float(values[0]),
        mean=float(together.mean()),
        tenth=float(np.quantile(together, 0.1)),
        causes=dict(sorted(causes.items(), key=lambda item: item[1][1])),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ScatterCost:
    """Cost of the rating that scatter takes from a candidate of a search."""

    tolerances: Tolerances
    legs: int = 12
    """Number of legs that are made of every candidate, with the same errors."""
    weight: float = 1.0
    """Price in the objective of a unit of P^r lost [-]."""
    seed: int = 0
    release: Release = field(default_factory=lambda: Release(duration=0.5))

    def __call__(self, designs: Sequence[LegDesign]) -> Floats:
        """Cost (n,) of designs; one whose legs cannot be released loses all of its rating."""
        values = np.zeros(len(designs))
        made = [scatter(design, self.tolerances, self.legs, self.seed) for design in designs]
        held = [index for index, legs in enumerate(made) if self._holds(designs[index], legs)]
        if held:
            nominal = [designs[index] for index in held for _ in range(self.legs)]
            legs = [leg for index in held for leg in made[index]]
            ratings = rate_legs(nominal, legs, self.release).values
            values[held] = ratings.reshape(len(held), self.legs).mean(axis=1)
        return self.weight * (1.0 - values)

    def _holds(self, design: LegDesign, legs: Sequence[LegDesign]) -> bool:
        try:
            released([design] * len(legs), legs, self.release)
        except ConfigError:
            return False
        return True
