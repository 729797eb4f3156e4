"""The scatter of manufacture: standard deviations, and the file they come from."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from legbench.design.toml import UNITS, TomlTable, load_tables, units_per_si
from legbench.errors import DesignError

FARTHEST = 3.0
"""Error beyond which a part is sorted out in manufacture [standard deviations]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerances:
    """Standard deviations of manufacture, of each segment and joint on its own.

    The defaults are about what separates Table III from Table II, common errors left aside.

    Raises:
        DesignError: a negative tolerance, or one so wide that parts without mass come out.
    """

    mass: float = 0.02
    """Relative tolerance of each mass [-]."""
    com: float = 0.001
    """Tolerance of each centre of mass [m]."""
    inertia: float = 0.05
    """Relative tolerance of each inertia [-]."""
    length: float = 0.0002
    """Tolerance of the lengths of thigh and foot [m]; the shank is as long as both together, as its
    bars are."""
    stiffness: float = 0.03
    """Relative tolerance of each spring's stiffness [-]."""
    damping: float = 0.12
    """Relative tolerance of each joint's damping [-]."""

    def __post_init__(self) -> None:
        for name in TOLERANCES:
            value = getattr(self, name)
            widest = np.inf if name in ABSOLUTE else 1.0 / FARTHEST
            if not 0.0 <= value < widest:
                raise DesignError(
                    f"tolerance of {name} is {value:g}; it must be zero or more"
                    + (f" and below {widest:.3g}" if np.isfinite(widest) else "")
                )

    def only(self, name: str) -> "Tolerances":
        """Tolerances in which `name` alone scatters, as much as here."""
        return replace(self, **{other: 0.0 for other in TOLERANCES if other != name})


TOLERANCES = tuple(entry.name for entry in fields(Tolerances))
"""Names of the tolerances."""
ABSOLUTE = ("com", "length")
"""Names of the tolerances in metres; the others are relative."""


def tolerances_from_mapping(content: Mapping[str, Any]) -> Tolerances:
    """Build tolerances from a file with `[units]` and `[tolerances]`; what is left out is default.

    Raises:
        DesignError: an unknown key or unit, or a value that cannot be.
    """
    unknown = set(content) - {"units", "tolerances"}
    if unknown:
        raise DesignError(
            f"unknown entries: {', '.join(sorted(unknown))}; there are units, tolerances"
        )
    per_si = units_per_si(content.get("units", {}), {"length": UNITS["length"]}) | {"ratio": 1.0}
    table = TomlTable("tolerances", content.get("tolerances", {}), per_si)
    given = {
        name: table.number(name, "length" if name in ABSOLUTE else "ratio")
        for name in TOLERANCES
        if name in table.content
    }
    table.finish()
    return Tolerances(**given)


def load_tolerances(path: Path) -> Tolerances:
    """Read a tolerance file.

    Raises:
        DesignError: the file is missing, is not TOML or makes no sense; the message starts with
            the path.
    """
    hint = "no such tolerance file; 'default' is always there"
    return load_tables(path, tolerances_from_mapping, hint)
