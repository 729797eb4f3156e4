"""Bus and limit files: TOML to dataclasses, every key checked."""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, TypeVar

from legbench.drives.errors import CodecError
from legbench.drives.protocol.datatypes import SHORT_NAMES
from legbench.drives.protocol.objects import name_of
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import (
    NOT_IN_FILES,
    RPDO,
    BusConfig,
    Identity,
    NodeConfig,
    Parameter,
    PdoConfig,
)
from legbench.drives.setup.configuration import interpolation_time
from legbench.drives.setup.homed import HomedCondition
from legbench.drives.setup.units import AxisUnits
from legbench.errors import ConfigError
from legbench.limits.safety import SafetyLimits
from legbench.reading import UnreadableError, read_toml

Built = TypeVar("Built")
_OBJECT = re.compile(r"([0-9A-Fa-f]{4}):([0-9A-Fa-f]{2}) ([a-z]+[0-9]*)")
_IDENTITY = tuple(field.name for field in fields(Identity))
_PLAIN_TYPES: dict[str, tuple[type, ...]] = {
    "str": (str,),
    "float": (int, float),
    "bool": (bool,),
}
LARGEST = 1e18
"""Bound that the magnitude of every number of a file stays below."""
AXES = 2
"""Axes of a leg, and so pairs of a range."""


def load_bus(path: Path) -> BusConfig:
    """Read a bus file.

    Raises:
        ConfigError: it is missing, no TOML, or describes no bus; the message starts with the path.
    """
    return _load(path, bus_from_mapping)


def load_limits(path: Path) -> SafetyLimits:
    """Read a limits file.

    Raises:
        ConfigError: it is missing, no TOML, or has a limit that makes no sense.
    """
    return _load(path, limits_from_mapping)


def _load(path: Path, build: Callable[[Mapping[str, Any]], Built]) -> Built:
    try:
        return build(read_toml(path))
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file; hardware/ holds the bench's") from None
    except (ConfigError, UnreadableError) as error:
        raise ConfigError(f"{path}: {error}") from None


def limits_from_mapping(content: Mapping[str, Any]) -> SafetyLimits:
    """Limits from the keys of a file; raises ConfigError."""
    given = dict(content)
    for name in ("motor_range", "joint_range"):
        if name in given:
            pairs = _list(name, given[name])
            if len(pairs) != AXES:
                raise ConfigError(
                    f"{name} has {len(pairs)} entries; it needs {AXES} pairs [low, high] in rad, "
                    "one for each axis"
                )
            given[name] = tuple(_range(name, pair) for pair in pairs)
    for name in ("motor_knee_range", "joint_knee_range"):
        if name in given:
            given[name] = _range(name, given[name])
    _waive(given)
    done = ("motor_range", "joint_range", "motor_knee_range", "joint_knee_range", "waive")
    return _build(SafetyLimits, "limits", given, converted=done)


def bus_from_mapping(content: Mapping[str, Any]) -> BusConfig:
    """A bus from the tables of a file; raises ConfigError."""
    given = dict(content)
    tables = _list("node", given.pop("node", []))
    given["nodes"] = tuple(_node(table, place) for place, table in enumerate(tables, start=1))
    _waive(given)
    bus = _build(BusConfig, "bus", given, converted=("nodes", "waive"))
    interpolation_time(bus.period_us)
    return bus


@contextmanager
def _at(where: str) -> Iterator[None]:
    """Put a place of the file in front of an error that does not begin with it yet."""
    try:
        yield
    except ConfigError as error:
        if str(error).startswith(where):
            raise
        raise ConfigError(f"{where}: {error}") from None


def _waive(given: dict[str, Any]) -> None:
    """Turn the list of waivers into a tuple of names."""
    if "waive" in given:
        names = _list("waive", given["waive"])
        if not all(isinstance(name, str) for name in names):
            raise ConfigError(f"'waive' must be a list of names, not {names!r}")
        given["waive"] = tuple(names)


def _node(table: object, place: int) -> NodeConfig:
    given = _table("node", table)
    where = f"node '{given['name']}'" if "name" in given else f"node {place} of the file"
    with _at(where):
        return _node_of(given, where)


def _node_of(given: dict[str, Any], where: str) -> NodeConfig:
    identity = {key: given.pop(key) for key in _IDENTITY if key in given}
    given["identity"] = _build(Identity, where, identity)
    for axis in ("motor", "link"):
        with _at(f"{where} {axis}"):
            given[axis] = _build(AxisUnits, f"{where} {axis}", _table(axis, given.get(axis, {})))
    if "id" in given:
        given["node_id"] = given.pop("id")
    for key in ("link_object", "temperature_object"):
        if key in given:
            with _at(f"{where}: {key}"):
                given[key] = parse_object(given[key])
    for key, plural in (("rpdo", "rpdos"), ("tpdo", "tpdos")):
        if key in given:
            usual = {"deadline_ms": RPDO.deadline_ms} if key == "rpdo" else {}
            pdos = _list(key, given.pop(key))
            with _at(f"{where}: {key}"):
                given[plural] = tuple(_pdo(where, entry, usual) for entry in pdos)
    if "homed" in given:
        with _at(f"{where} homed"):
            given["homed"] = _homed(f"{where} homed", given["homed"])
    if "soft_limits" in given:
        given["soft_limits"] = _range("soft_limits", given["soft_limits"])
    parameters = _table("parameters", given.get("parameters", {}))
    given["parameters"] = found = tuple(_parameter(*item) for item in parameters.items())
    keys = [parameter.key for parameter in found]
    for key in keys:
        if keys.count(key) > 1:
            raise ConfigError(f"{where} gives parameter {name_of(*key)} twice")
    done = ("identity", "motor", "link", "link_object", "temperature_object", "rpdos", "tpdos")
    return _build(NodeConfig, where, given, converted=(*done, "parameters", "soft_limits", "homed"))


def _homed(where: str, table: object) -> HomedCondition:
    given = _table("homed", table)
    if "object" in given:
        given["object"] = parse_object(given["object"])
    return _build(HomedCondition, where, given, converted=("object",))


def _pdo(where: str, table: object, usual: Mapping[str, int]) -> PdoConfig:
    given = dict(usual) | _table("PDO", table)
    objects = _list("objects", given.get("objects", []))
    given["objects"] = tuple(parse_object(text) for text in objects)
    return _build(PdoConfig, f"{where} PDO", given, converted=("objects",))


def _parameter(text: str, value: object) -> Parameter:
    entry = parse_object(text)
    if isinstance(value, bool) or not isinstance(value, int):
        raise ConfigError(f"parameter '{text}' is {value!r}; it must be a whole number")
    return Parameter(index=entry.index, sub=entry.sub, kind=entry.kind, value=value)


def parse_object(text: object) -> Mapped:
    """An object as files name it, such as `6064:00 i32`; raises ConfigError."""
    found = _OBJECT.fullmatch(text) if isinstance(text, str) else None
    kind = None if found is None else SHORT_NAMES.get(found[3])
    if found is None or kind is None:
        raise ConfigError(
            f"{text!r} is no object; write index, sub-index and type, such as '6064:00 i32', with "
            f"the types {', '.join(SHORT_NAMES)}"
        )
    try:
        return Mapped(int(found[1], 16), int(found[2], 16), kind)
    except CodecError as error:
        raise ConfigError(str(error)) from None


def format_object(entry: Mapped) -> str:
    """The inverse of `parse_object`."""
    short = next(name for name, kind in SHORT_NAMES.items() if kind is entry.kind)
    return f"{entry.index:04X}:{entry.sub:02X} {short}"


def _build(
    kind: Callable[..., Built],
    where: str,
    given: Mapping[str, Any],
    converted: tuple[str, ...] = (),
) -> Built:
    """A dataclass from keys: unknown and missing ones are named, plain types checked."""
    known = {
        field.name: field
        for field in fields(kind)  # pyright: ignore[reportArgumentType]
        if field.init and NOT_IN_FILES not in field.metadata
    }
    unknown = sorted(set(given) - set(known))
    if unknown:
        raise ConfigError(
            f"{where} has unknown keys: {', '.join(unknown)}; it knows {', '.join(known)}"
        )
    for name, value in given.items():
        if name in converted:
            continue
        words = str(getattr(known[name].type, "__name__", known[name].type)).split(" | ")[0]
        allowed = _PLAIN_TYPES.get(words, (int,))
        if (isinstance(value, bool) and words != "bool") or not isinstance(value, allowed):
            raise ConfigError(f"{where}: {name} is {value!r}; it must be of type {words}")
    plain = {
        name: _finite(where, name, value)
        for name, value in given.items()
        if name not in converted and isinstance(value, int | float)
    }
    lacking = [
        "id" if name == "node_id" else name
        for name, field in known.items()
        if name not in given and field.default is MISSING
    ]
    if lacking:
        raise ConfigError(f"{where}: {', '.join(lacking)} must be given")
    return kind(**(dict(given) | plain))


def _finite(where: str, name: str, value: float) -> float:
    """Return a number of a file, refusing one that is infinite, not a number or too large."""
    if not abs(value) < LARGEST:
        text = f"{value}" if isinstance(value, float) else "too large"
        raise ConfigError(
            f"{where}: {name} is {text}; it must be a number below {LARGEST:g}: a limit that is "
            "not to act is left out"
        )
    return value


def _table(name: str, value: object) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise ConfigError(f"'{name}' must be a table, not {value!r}")
    return dict(value)


def _list(name: str, value: object) -> list[Any]:
    if not isinstance(value, list):
        raise ConfigError(f"'{name}' must be a list, not {value!r}")
    return value


def _range(name: str, pair: object) -> tuple[float, float]:
    numbers = pair if isinstance(pair, list) else []
    if len(numbers) != 2 or not all(
        isinstance(number, int | float) and not isinstance(number, bool) for number in numbers
    ):
        raise ConfigError(f"{name} needs pairs [low, high] in rad, not {pair!r}")
    low, high = (float(_finite("range", name, number)) for number in numbers)
    return (low, high)
