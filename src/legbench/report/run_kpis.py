"""Figures of one run as a flat table with units, for notebooks and searches."""

from dataclasses import asdict, dataclass
from typing import Final

import numpy as np

from legbench.metrics.source import Recorded
from legbench.metrics.summary import summarise
from legbench.metrics.units import UNITS

RATIOS: Final = ("energy_residual", "real_time_factor", "jumps", "limited_cycles")
"""Figures of a summary that are ratios or counts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Kpi:
    """One figure of a run."""

    value: float
    """NaN where the run, its setup or a missing truth does not show it."""
    unit: str
    """SI unit; `1` for a ratio or a count."""


def kpis(run: Recorded) -> dict[str, Kpi]:
    """Figures of a run by name, in the order of its summary.

    Lists of ratings give one figure a value, such as `rating_periods_motor_1`, and the lowest and
    the mean of them, such as `rating_periods_motor_lowest`.

    Raises:
        FormatError: the run describes no leg.
    """
    found: dict[str, Kpi] = {}
    for name, value in asdict(summarise(run)).items():
        if name in RATIOS:
            found[name] = Kpi(value=float(value), unit="1")
        elif name.startswith("rating_") and isinstance(value, list):
            found |= _listed(name, value, "1")
        elif name == "periods":
            found |= _listed("period", value, UNITS[name])
        elif name in UNITS and not isinstance(value, list):
            found[name] = Kpi(value=value, unit=UNITS[name])
    return found


def _listed(name: str, values: list[float], unit: str) -> dict[str, Kpi]:
    found = {f"{name}_{n}": Kpi(value=each, unit=unit) for n, each in enumerate(values, 1)}
    known = [each for each in values if np.isfinite(each)]
    if known:
        found[f"{name}_lowest"] = Kpi(value=min(known), unit=unit)
        found[f"{name}_mean"] = Kpi(value=float(np.mean(known)), unit=unit)
    return found
