"""Bus and limit files: TOML to dataclasses, every key checked."""

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

from legbench.drives.codec.datatypes import SHORT_NAMES
from legbench.drives.codec.pdo import Mapped
from legbench.drives.config import (
    NOT_IN_FILES,
    RPDO,
    BusConfig,
    Identity,
    NodeConfig,
    Parameter,
    PdoConfig,
)
from legbench.drives.errors import CodecError
from legbench.drives.limits import SafetyLimits
from legbench.drives.units import AxisUnits
from legbench.errors import ConfigError

Built = TypeVar("Built")
_OBJECT = re.compile(r"([0-9A-Fa-f]{4}):([0-9A-Fa-f]{2}) ([a-z]+[0-9]*)")
_IDENTITY = tuple(field.name for field in fields(Identity))
_PLAIN_TYPES: dict[str, tuple[type, ...]] = {"str": (str,), "float": (int, float)}


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
        with path.open("rb") as file:
            return build(tomllib.load(file))
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file; hardware/ holds the bench's") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from None
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None


def limits_from_mapping(content: Mapping[str, Any]) -> SafetyLimits:
    """Limits from the keys of a file; raises ConfigError."""
    given = dict(content)
    for name in ("motor_range", "joint_range"):
        if name in given:
            given[name] = tuple(_range(name, pair) for pair in _list(name, given[name]))
    for name in ("motor_knee_range", "joint_knee_range"):
        if name in given:
            given[name] = _range(name, given[name])
    ranges = ("motor_range", "joint_range", "motor_knee_range", "joint_knee_range")
    return _build(SafetyLimits, "limits", given, converted=ranges)


def bus_from_mapping(content: Mapping[str, Any]) -> BusConfig:
    """A bus from the tables of a file; raises ConfigError."""
    given = dict(content)
    tables = _list("node", given.pop("node", []))
    given["nodes"] = tuple(_node(table) for table in tables)
    return _build(BusConfig, "bus", given, converted=("nodes",))


def _node(table: object) -> NodeConfig:
    given = _table("node", table)
    name = str(given.get("name", "?"))
    where = f"node '{name}'"
    identity = {key: given.pop(key) for key in _IDENTITY if key in given}
    given["identity"] = _build(Identity, where, identity)
    for axis in ("motor", "link"):
        given[axis] = _build(AxisUnits, f"{where} {axis}", _table(axis, given.get(axis, {})))
    if "id" in given:
        given["node_id"] = given.pop("id")
    for key in ("link_object", "temperature_object"):
        if key in given:
            given[key] = parse_object(given[key])
    for key, plural in (("rpdo", "rpdos"), ("tpdo", "tpdos")):
        if key in given:
            usual = {"deadline_ms": RPDO.deadline_ms} if key == "rpdo" else {}
            given[plural] = tuple(_pdo(where, entry, usual) for entry in _list(key, given.pop(key)))
    if "soft_limits" in given:
        given["soft_limits"] = _range("soft_limits", given["soft_limits"])
    parameters = _table("parameters", given.get("parameters", {}))
    given["parameters"] = tuple(_parameter(*item) for item in parameters.items())
    done = ("identity", "motor", "link", "link_object", "temperature_object", "rpdos", "tpdos")
    return _build(NodeConfig, where, given, converted=(*done, "parameters", "soft_limits"))


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
        if isinstance(value, bool) or not isinstance(value, allowed):
            raise ConfigError(f"{where}: {name} is {value!r}; it must be of type {words}")
    try:
        return kind(**given)
    except TypeError as error:
        raise ConfigError(f"{where}: {str(error).partition(') ')[2] or error}") from None


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
    return (float(numbers[0]), float(numbers[1]))
