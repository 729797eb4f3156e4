"""Orbits as trajectories: states over one period, for other programs."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from legbench.modes.branches import Branch
from legbench.modes.carry import Carrier
from legbench.modes.damped import DampedFamily
from legbench.modes.family import Family
from legbench.signals import Floats

ROWS = 101
"""Number of instants of a period, both ends included [-]."""
COLUMNS = ("time", "q1", "q2", "v1", "v2")
"""Names of a trajectory's columns [s, rad, rad, rad/s, rad/s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OrbitPath:
    """Orbit that is sampled over its period."""

    family: str
    """Name of the family to which the orbit belongs."""
    index: int
    """Place of the orbit in the family, from 0 [-]."""
    energy: float
    """Energy above rest [J]."""
    period: float
    """Duration of one oscillation [s]."""
    stable: bool | None
    """Whether neighbours of the same energy stay near; None of a damped mode."""
    rows: Floats
    """Time and state in the order of `COLUMNS` (n, 5)."""


def family_paths(family: Family) -> Iterator[OrbitPath]:
    """The orbits of a nonlinear mode."""
    carrier = family.shooting.carrier
    for index, orbit in enumerate(family.orbits):
        yield OrbitPath(
            family=family.mode.name,
            index=index,
            energy=orbit.energy,
            period=orbit.period,
            stable=orbit.monodromy.stable,
            rows=_rows(carrier, np.array([*orbit.start, 0.0, 0.0]), orbit.period),
        )


def branch_paths(family: Family, branches: tuple[Branch, ...]) -> Iterator[OrbitPath]:
    """The orbits of the branches of a mode, each branch a family of its own."""
    carrier = family.shooting.carrier
    for number, branch in enumerate(branches, start=1):
        for index, orbit in enumerate(branch.orbits):
            yield OrbitPath(
                family=f"{family.mode.name} branch {number}",
                index=index,
                energy=orbit.energy,
                period=orbit.period,
                stable=orbit.monodromy.stable,
                rows=_rows(carrier, orbit.start, orbit.period),
            )


def damped_paths(family: DampedFamily, carrier: Carrier) -> Iterator[OrbitPath]:
    """The orbits of a damped mode, under the drive that keeps them going."""
    for index, orbit in enumerate(family.orbits):
        yield OrbitPath(
            family=f"{family.name} damped",
            index=index,
            energy=orbit.energy,
            period=orbit.period,
            stable=None,
            rows=_rows(carrier, orbit.start, orbit.period, orbit.extra),
        )


def _rows(carrier: Carrier, start: Floats, period: float, extra: float = 0.0) -> Floats:
    times = np.linspace(0.0, period, ROWS)
    return np.column_stack([times, carrier.path(start, times, extra=extra)])


def paths_to_json(paths: list[OrbitPath]) -> list[dict[str, object]]:
    """Trajectories as JSON, one object an orbit with a list a column."""
    return [
        {
            "family": one.family,
            "orbit": one.index,
            "energy": one.energy,
            "period": one.period,
            "stable": one.stable,
            **{name: one.rows[:, place].tolist() for place, name in enumerate(COLUMNS)},
        }
        for one in paths
    ]
