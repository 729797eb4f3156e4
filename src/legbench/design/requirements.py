"""Requirements of a leg: masses, lengths and stiffness, bounds, and preferences."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from legbench.design.leg import Limits
from legbench.design.toml import UNITS, TomlTable, load_tables, tables_to_toml, units_per_si
from legbench.errors import DesignError
from legbench.signals import Floats
from legbench.writing import save_whole

REQUIREMENT_UNITS: dict[str, dict[str, float]] = {
    "mass": UNITS["mass"],
    "length": UNITS["length"],
    "leg_stiffness": {"N/m": 1.0, "N/mm": 1e-3, "kN/m": 1e-3},
    "damping": UNITS["damping"],
    "angle": UNITS["angle"],
}
"""Quantity -> unit -> how many of it make one SI unit, for the `[units]` table."""

LEG_KEYS = {
    "total_mass": "mass",
    "leg_mass": "mass",
    "leg_com": "length",
    "relaxed_length": "length",
    "leg_stiffness": "leg_stiffness",
    "damping": "damping",
}
"""Quantity of each key of `[leg]`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """Bounds of a decision variable, and the value at which the search starts.

    Raises:
        DesignError: an empty range, a start outside it, or a number that is none.
    """

    lower: float
    start: float
    upper: float

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.lower, self.start, self.upper))):
            raise DesignError(
                f"bounds are [{self.lower:g}, {self.start:g}, {self.upper:g}]; they must be finite "
                "numbers"
            )
        if not self.lower < self.upper:
            raise DesignError(
                f"bounds [{self.lower:g}, {self.upper:g}] are empty; lower must be below upper"
            )
        if not self.lower <= self.start <= self.upper:
            raise DesignError(
                f"start {self.start:g} lies outside its bounds [{self.lower:g}, {self.upper:g}]"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """The seven decision variables, all dimensionless, with the values of Table I.

    Raises:
        DesignError: a range in which no leg exists.
    """

    relaxed_length: Range = field(default=Range(lower=0.6, start=0.8, upper=0.95))
    """Relaxed length of the leg, l_o / (l1 + l2 + l3) [-]."""
    thigh_length: Range = field(default=Range(lower=0.1, start=0.6, upper=0.9))
    """Share of the thigh in thigh and foot, l1 / (l1 + l3) [-]."""
    thigh_com: Range = field(default=Range(lower=0.15, start=0.45, upper=0.5))
    """Centre of mass of the thigh, c1 / l1 [-]."""
    shank_com: Range = field(default=Range(lower=0.15, start=0.45, upper=0.5))
    """Centre of mass of the shank, c2 / l2 [-]."""
    foot_com: Range = field(default=Range(lower=0.15, start=0.45, upper=0.5))
    """Centre of mass of the foot, c3 / l3 [-]."""
    shank_inertia: Range = field(default=Range(lower=1 / 16, start=1 / 12, upper=0.5))
    """Inertia of the shank, I2 / (m2 l2^2) [-]."""
    foot_inertia: Range = field(default=Range(lower=1 / 16, start=1 / 12, upper=0.5))
    """Inertia of the foot, I3 / (m3 l3^2) [-]."""

    def __post_init__(self) -> None:
        for name in VARIABLES:
            bound: Range = getattr(self, name)
            inside = bound.lower > 0.0
            if name in ("relaxed_length", "thigh_length"):
                inside = inside and bound.upper < 1.0
            elif name.endswith("_com"):
                inside = inside and bound.upper <= 1.0
            if not inside:
                raise DesignError(
                    f"bounds of {name} are [{bound.lower:g}, {bound.upper:g}]; the ratio lies "
                    "between 0 and 1 in every leg, an inertia above 0"
                )

    @property
    def lower(self) -> Floats:
        """Lower ends, in the order of `VARIABLES` (7,) [-]."""
        return np.array([getattr(self, name).lower for name in VARIABLES])

    @property
    def upper(self) -> Floats:
        """Upper ends, in the order of `VARIABLES` (7,) [-]."""
        return np.array([getattr(self, name).upper for name in VARIABLES])

    @property
    def start(self) -> Floats:
        """Start of the search, in the order of `VARIABLES` (7,) [-]."""
        return np.array([getattr(self, name).start for name in VARIABLES])


VARIABLES = tuple(entry.name for entry in fields(Bounds))
"""Names of the decision variables, in the order of Table I."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """Weights of objective (11); the paper's by default.

    Raises:
        DesignError: a negative weight, or none at all.
    """

    mass_share: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Weights of the squares of `m_i / m_leg - l_i / (l1 + l2 + l3)`."""
    thigh_inertia: float = 0.5
    """Weight of the square of `I1 / (m1 l1^2) - 1/12`."""

    def __post_init__(self) -> None:
        weights = (*self.mass_share, self.thigh_inertia)
        if not all(math.isfinite(weight) and weight >= 0.0 for weight in weights):
            raise DesignError(f"weights are {weights}; they must be finite and not negative")
        if not any(weights):
            raise DesignError("all weights of the objective are zero; nothing is preferred")


@dataclass(frozen=True, slots=True, kw_only=True)
class Requirements:
    """Everything that decides a design; the paper's by default (section III-B, Table I).

    Raises:
        DesignError: a value that no leg can have, or a leg that weighs more than the system.
    """

    name: str = "paper"
    total_mass: float = 1.0
    """Mass of trunk and leg, m_sys [kg]."""
    leg_mass: float = 0.363
    """Mass of the leg, m_leg [kg]: printed as 0.36; 0.363 gives every entry of Table II."""
    leg_com: float = 0.068
    """Centre of mass of the stretched leg below the hip, c_leg [m]."""
    relaxed_length: float = 0.253
    """Relaxed length of the leg, l_o [m]."""
    leg_stiffness: float = 905.0
    """Radial stiffness at the relaxed length, k_leg [N/m]."""
    damping: float = 0.0073
    """Damping of both joints, d1 = d2 [N m s/rad]; the lower one of the prototype's."""
    bounds: Bounds = field(default_factory=Bounds)
    weights: Weights = field(default_factory=Weights)
    limits: Limits = field(default_factory=Limits)
    """Joint stops of the finished leg."""
    overhang: float | None = None
    """How far mass may reach beyond both joints of its segment [m]: every inertia then stays below
    `m (c + e) (l - c + e)`. The paper does not ask for it, and no leg is matched with zero."""

    def __post_init__(self) -> None:
        for key in LEG_KEYS:
            value = getattr(self, key)
            if not (math.isfinite(value) and (value > 0.0 or (key == "damping" and value == 0.0))):
                raise DesignError(f"{key} is {value:g}; it must be a positive finite number")
        if self.overhang is not None and not 0.0 < self.overhang < math.inf:
            raise DesignError(
                f"overhang is {self.overhang:g} m; it must be positive and finite: a leg whose "
                "mass all lies between the joints of its segments cannot meet (5) and (9) together"
            )
        if not self.leg_mass < self.total_mass:
            raise DesignError(
                f"leg_mass is {self.leg_mass:g} kg of a total_mass of {self.total_mass:g} kg; the "
                "trunk needs a positive mass: lower the one or raise the other"
            )


PAPER = Requirements()


def requirements_from_mapping(content: Mapping[str, Any]) -> Requirements:
    """Build requirements from the tables of a requirements file; the paper's fill what is left out.

    Raises:
        DesignError: an unknown key or unit, or a value that no leg can have.
    """
    known = ("units", "leg", "bounds", "weights", "limits", "constraints")
    unknown = set(content) - {"name", *known}
    if unknown:
        raise DesignError(
            f"unknown entries: {', '.join(sorted(unknown))}; there are {', '.join(known)}"
        )
    per_si = units_per_si(content.get("units", {}), REQUIREMENT_UNITS) | {"ratio": 1.0}
    leg, bounds, weights, limits, constraints = (
        TomlTable(name, content.get(name, {}), per_si) for name in known[1:]
    )
    values: dict[str, Any] = {
        key: leg.number(key, LEG_KEYS[key]) for key in LEG_KEYS if key in leg.content
    }
    ranges = {name: _range(bounds, name) for name in VARIABLES if name in bounds.content}
    for table in (leg, bounds):
        table.finish()
    return Requirements(
        name=str(content.get("name", "unnamed")),
        bounds=replace(PAPER.bounds, **ranges),
        weights=_weights(weights),
        limits=_limits(limits),
        overhang=_overhang(constraints),
        **values,
    )


def _range(table: TomlTable, name: str) -> Range:
    lower, start, upper = table.numbers(name, "ratio", ("lower", "start", "upper"))
    try:
        return Range(lower=lower, start=start, upper=upper)
    except DesignError as error:
        raise DesignError(f"[bounds] {name}: {error}") from None


def _weights(table: TomlTable) -> Weights:
    given: dict[str, Any] = {}
    if "mass_share" in table.content:
        given["mass_share"] = table.numbers("mass_share", "ratio", ("thigh", "shank", "foot"))
    if "thigh_inertia" in table.content:
        given["thigh_inertia"] = table.number("thigh_inertia", "ratio")
    table.finish()
    return replace(PAPER.weights, **given)


def _limits(table: TomlTable) -> Limits:
    given = {name: table.pair(name, "angle") for name in ("hip", "knee") if name in table.content}
    table.finish()
    return replace(PAPER.limits, **given)


def _overhang(table: TomlTable) -> float | None:
    value = table.number("overhang", "length") if "overhang" in table.content else None
    table.finish()
    return value


def requirements_to_mapping(requirements: Requirements) -> dict[str, Any]:
    """The tables of a requirements file, in SI; `requirements_from_mapping` inverts it exactly.

    A constraint that is not asked for is left out, so that older files and traces keep their name.
    """
    content = asdict(requirements)
    ranges = {name: list(content["bounds"][name].values()) for name in VARIABLES}
    tables: dict[str, Any] = {
        "name": requirements.name,
        "units": {quantity: next(iter(units)) for quantity, units in REQUIREMENT_UNITS.items()},
        "leg": {key: content[key] for key in LEG_KEYS},
        "bounds": ranges,
        "weights": {
            "mass_share": list(requirements.weights.mass_share),
            "thigh_inertia": requirements.weights.thigh_inertia,
        },
        "limits": {name: list(pair) for name, pair in content["limits"].items()},
    }
    if requirements.overhang is not None:
        tables["constraints"] = {"overhang": requirements.overhang}
    return tables


def load_requirements(path: Path) -> Requirements:
    """Read a requirements file.

    Raises:
        DesignError: the file is missing, is not TOML, or asks for what no leg can have; the
            message starts with the path.
    """
    hint = "no such requirements file; the presets are 'paper' and 'quadruped'"
    return load_tables(path, requirements_from_mapping, hint)


def save_requirements(requirements: Requirements, path: Path) -> None:
    """Write a requirements file in SI units; `load_requirements` gives the same back.

    Raises:
        ConfigError: it cannot be written; an older file is untouched.
    """
    save_whole(path, tables_to_toml(requirements_to_mapping(requirements)))
