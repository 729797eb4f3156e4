"""Tables of campaigns that were never run: ratings and jumps as a test wants them."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pyarrow as pa

from legbench.campaign import measured_table, whole_table

MODELS = Path(__file__).parents[2] / "models"
STEP, BANG_BANG = "position-jump", "bang-bang"
SETUPS = ("hfts", "vfts", "ffs")

Curve = Callable[[str, float, float], list[float]]
"""Ratings of a cell by setup, z2 and dz2."""


@dataclass(kw_only=True)
class Runs:
    """Rows of runs, and the settings of each."""

    rows: list[dict[str, Any]] = field(default_factory=list)
    settings: dict[str, dict[str, Any]] = field(default_factory=dict)
    trials: dict[str, int] = field(default_factory=dict)

    def add(
        self,
        setup: str,
        controller: str,
        z2: float | None,
        dz2: float | None,
        rows: Iterable[dict[str, Any]],
        **said: Any,
    ) -> None:
        """Add a run; `said` replaces what every row says of it."""
        trial = said.pop("trial", 0)
        name = f"{len(self.settings):02d}".ljust(64, "0")
        run = {"status": "complete", "cause": None, "numerics": "sound"} | said
        whole = {"row": "run", "index": 0, "length": 2.0}
        self.rows += [{"experiment": name} | run | row for row in (whole, *rows)]
        self.trials[name] = trial
        self.settings[name] = {
            "setup.kind": setup,
            "controller.kind": controller,
            "controller.settings.z2": z2,
            "controller.settings.dz2": dz2,
            "design.name": "prototype",
            "seed": trial,
        }

    def table(self) -> pa.Table:
        """The table of all runs."""
        return whole_table(measured_table(self.rows), self.settings, self.trials, [], b"[]")


def periods(equilibrium: list[float], motor: list[float] | None = None) -> list[dict[str, Any]]:
    """Rows of rated periods."""
    pairs = zip(equilibrium, motor or equilibrium, strict=True)
    return [
        {"row": "period", "index": n, "rating_equilibrium": one, "rating_motor": two, "rating": one}
        for n, (one, two) in enumerate(pairs, 1)
    ]


def jumps(
    stance: list[float], flight: list[float], lengths: dict[str, list[float]]
) -> list[dict[str, Any]]:
    """Rows of stances, flights and jumps."""
    found: list[dict[str, Any]] = []
    for kind, ratings in (("stance", stance), ("flight", flight)):
        found += [
            {"row": kind, "index": n, "rating": each}
            | {"rating_motor": each, "rating_equilibrium": each - 0.001}
            for n, each in enumerate(ratings, 1)
        ]
    count = len(next(iter(lengths.values())))
    found += [
        {"row": "jump", "index": n + 1} | {name: values[n] for name, values in lengths.items()}
        for n in range(count)
    ]
    return found


def as_the_paper_says() -> Runs:
    """A campaign that shows every statement of the paper, about both references."""
    runs = Runs()
    lower = {"hfts": 0.02, "vfts": 0.0, "ffs": 0.08}
    for setup in SETUPS:
        for z2 in (1.0, 1.8):
            falling = [0.99 - lower[setup] - 0.03 * n for n in range(7)]
            runs.add(setup, STEP, z2, 0.3, periods(falling))
            level = 0.93 if z2 == 1.8 else 0.96
            driven = [0.80, 0.88, *[level] * 14]
            runs.add(setup, BANG_BANG, z2, 0.08, periods(driven))
    lengths = {
        "foot_clearance": [0.01, 0.044, 0.045, 0.043],
        "trunk_excursion": [0.086] * 4,
        "foot_travel": [0.024] * 4,
    }
    stances, flights = [0.5, 0.995, 0.996, 0.995], [0.2, 0.98, 0.975, 0.981]
    runs.add("jump", "jump", 0.8, 0.28, jumps(stances, flights, lengths), drift=0.018)
    return runs
