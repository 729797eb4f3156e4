"""Design files: TOML in the units that its `[units]` table declares, SI when written."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from legbench.design.leg import LegDesign, Limits, Segment
from legbench.errors import DesignError
from legbench.reading import UnreadableError, read_toml
from legbench.shipped import locate, shipped_designs
from legbench.writing import save_whole

Built = TypeVar("Built")

UNITS: dict[str, dict[str, float]] = {
    "mass": {"kg": 1.0, "g": 1e3},
    "length": {"m": 1.0, "mm": 1e3},
    "inertia": {"kg m^2": 1.0, "kg mm^2": 1e6, "g mm^2": 1e9},
    "stiffness": {"N m/rad": 1.0, "N mm/rad": 1e3},
    "damping": {"N m s/rad": 1.0, "N mm s/rad": 1e3},
    "angle": {"rad": 1.0, "deg": math.degrees(1.0)},
}
"""Quantity -> unit -> how many of it make one SI unit; the first unit of each is the default.

Values are divided, not multiplied, so that 207 g is 0.207 kg to the last bit."""

SEGMENT_KEYS = {"mass": "mass", "length": "length", "com": "length", "inertia": "inertia"}
SECTIONS = ("units", "trunk", "thigh", "shank", "foot", "springs", "limits")


class TomlTable:
    """One table of the file, which gives numbers in SI and remembers which keys were read."""

    def __init__(self, name: str, content: Mapping[str, Any], per_si: Mapping[str, float]) -> None:
        if not isinstance(content, Mapping):
            raise DesignError(f"[{name}] must be a table, not {content!r}")
        self.name, self.content, self.per_si = name, content, per_si
        self.left = set(content)

    def number(self, key: str, quantity: str) -> float:
        """Return the number under `key`, in SI.

        Raises:
            DesignError: it is missing, or no number.
        """
        if key not in self.content:
            raise DesignError(f"[{self.name}] lacks '{key}' ({quantity})")
        self.left.discard(key)
        return self._si(key, self.content[key], quantity)

    def pair(self, key: str, quantity: str) -> tuple[float, float]:
        """Return the two numbers under `key`, in SI.

        Raises:
            DesignError: they are missing, or not two numbers.
        """
        low, high = self.numbers(key, quantity, ("a", "b"))
        return (low, high)

    def numbers(self, key: str, quantity: str, names: Sequence[str]) -> tuple[float, ...]:
        """Return the numbers under `key`, in SI, one for each of `names`.

        Raises:
            DesignError: they are missing, too few or too many, or not numbers.
        """
        values = self.content.get(key)
        if not isinstance(values, list) or len(values) != len(names):
            wanted = ", ".join(names)
            raise DesignError(f"[{self.name}] needs '{key}' = [{wanted}], not {values!r}")
        self.left.discard(key)
        return tuple(self._si(key, value, quantity) for value in values)

    def _si(self, key: str, value: object, quantity: str) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise DesignError(f"[{self.name}] '{key}' is {value!r}; it must be a number")
        try:
            return float(value) / self.per_si[quantity]
        except OverflowError:
            raise DesignError(f"[{self.name}] '{key}' is too large for a number") from None

    def finish(self) -> None:
        """Refuse the keys that were not read.

        Raises:
            DesignError: there are some; the message names them.
        """
        if self.left:
            raise DesignError(f"[{self.name}] has unknown keys: {', '.join(sorted(self.left))}")


def units_per_si(
    declared: Mapping[str, Any], units: Mapping[str, Mapping[str, float]] = UNITS
) -> dict[str, float]:
    """How many of its declared unit make one SI unit, for every quantity of `units`.

    Raises:
        DesignError: an unknown quantity, or a unit that the quantity is not known in.
    """
    per_si = {quantity: 1.0 for quantity in units}
    if not isinstance(declared, Mapping):
        raise DesignError(f"[units] must be a table, not {declared!r}")
    for quantity, unit in declared.items():
        if quantity not in units:
            raise DesignError(f"[units] knows no '{quantity}'; it knows {', '.join(units)}")
        if not isinstance(unit, str) or unit not in units[quantity]:
            known = ", ".join(f"'{name}'" for name in units[quantity])
            raise DesignError(f"[units] {quantity} is '{unit}'; known are {known}")
        per_si[quantity] = units[quantity][unit]
    return per_si


def design_from_mapping(content: Mapping[str, Any]) -> LegDesign:
    """Build a design from the tables of a design file.

    Raises:
        DesignError: a missing or unknown key, an unknown unit, or a value no leg can have.
    """
    unknown = set(content) - {"name", *SECTIONS}
    if unknown:
        raise DesignError(f"unknown entries: {', '.join(sorted(unknown))}")
    per_si = units_per_si(content.get("units", {}))

    def table(name: str) -> TomlTable:
        if name not in content:
            raise DesignError(f"[{name}] is missing; a design has {', '.join(SECTIONS[1:])}")
        return TomlTable(name, content[name], per_si)

    def segment(name: str) -> Segment:
        entries = table(name)
        values = {key: entries.number(key, quantity) for key, quantity in SEGMENT_KEYS.items()}
        entries.finish()
        try:
            return Segment(**values)
        except DesignError as error:
            raise DesignError(f"[{name}] {error}") from None

    trunk, springs, limits = table("trunk"), table("springs"), table("limits")
    design = LegDesign(
        name=str(content.get("name", "unnamed")),
        trunk_mass=trunk.number("mass", "mass"),
        thigh=segment("thigh"),
        shank=segment("shank"),
        foot=segment("foot"),
        stiffness=springs.pair("stiffness", "stiffness"),
        damping=springs.pair("damping", "damping"),
        limits=Limits(hip=limits.pair("hip", "angle"), knee=limits.pair("knee", "angle")),
    )
    for entries in (trunk, springs, limits):
        entries.finish()
    return design


def load_design(path: Path | str) -> LegDesign:
    """Read a design file, or one that comes with the package, such as `prototype`.

    Raises:
        DesignError: the file is missing, is not TOML, or describes no leg; the message starts
            with the path.
    """
    names = ", ".join(shipped_designs())
    hint = f"no such design file; give its path, or the name of one that is here: {names}"
    return load_tables(locate(Path(path)), design_from_mapping, hint)


def load_tables(path: Path, build: Callable[[Mapping[str, Any]], Built], hint: str) -> Built:
    """Return what `build` makes of the tables of a TOML file.

    Raises:
        DesignError: the file is missing (`hint` says what there is), is not TOML, or `build`
            refuses it; the message starts with the path.
    """
    try:
        return build(read_toml(path))
    except FileNotFoundError:
        raise DesignError(f"{path}: {hint}") from None
    except (DesignError, UnreadableError) as error:
        raise DesignError(f"{path}: {error}") from None


def design_to_mapping(design: LegDesign) -> dict[str, Any]:
    """The tables of a design file, in SI; `design_from_mapping` inverts it exactly."""
    tables: dict[str, Any] = {
        "name": design.name,
        "units": {quantity: next(iter(units)) for quantity, units in UNITS.items()},
        "trunk": {"mass": design.trunk_mass},
    }
    for name in ("thigh", "shank", "foot"):
        segment = getattr(design, name)
        tables[name] = {key: getattr(segment, key) for key in SEGMENT_KEYS}
    tables["springs"] = {"stiffness": list(design.stiffness), "damping": list(design.damping)}
    tables["limits"] = {"hip": list(design.limits.hip), "knee": list(design.limits.knee)}
    return tables


def save_design(design: LegDesign, path: Path | str) -> None:
    """Write a design file in SI units; `load_design` gives the same design back, bit for bit.

    Raises:
        ConfigError: it cannot be written; an older file is untouched.
    """
    save_whole(Path(path), tables_to_toml(design_to_mapping(design)))


def tables_to_toml(tables: Mapping[str, Any]) -> str:
    """TOML text of one level of tables; numbers in full."""
    lines: list[str] = []
    for key, value in tables.items():
        if isinstance(value, dict):
            lines += [
                "",
                f"[{key}]",
                *(f"{name} = {_toml(entry)}" for name, entry in value.items()),
            ]
        else:
            lines.append(f"{key} = {_toml(value)}")
    return "\n".join(lines) + "\n"


def _toml(value: object) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, list):
        return "[" + ", ".join(_toml(entry) for entry in value) + "]"
    return repr(value)
