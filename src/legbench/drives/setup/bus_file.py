"""Bus and limit files: TOML to dataclasses, every key checked."""

import re
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from legbench.drives.errors import CodecError
from legbench.drives.protocol.datatypes import SHORT_NAMES
from legbench.drives.protocol.objects import name_of
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.building import Built, at, build, check_keys, finite
from legbench.drives.setup.config import BusConfig, Identity, NodeConfig, Parameter
from legbench.drives.setup.configuration import interpolation_time
from legbench.drives.setup.encoders import Side
from legbench.drives.setup.homed import HomedCondition
from legbench.drives.setup.pdos import (
    CONTROLWORD,
    LINK_POSITION_SHORT,
    POSITION_ACTUAL,
    RPDO,
    STATUSWORD,
    TARGET_POSITION,
    PdoConfig,
    packed,
)
from legbench.drives.setup.quirks import ModeShown, Quirks
from legbench.drives.setup.units import AxisUnits
from legbench.errors import ConfigError
from legbench.limits.safety import SafetyLimits
from legbench.reading import UnreadableError, read_toml
from legbench.shipped import shipped_root

_OBJECT = re.compile(r"([0-9A-Fa-f]{4}):([0-9A-Fa-f]{2}) ([a-z]+[0-9]*)")
_IDENTITY = tuple(field.name for field in fields(Identity))
OBJECT_KEYS = (
    "motor_object",
    "target_object",
    "link_object",
    "torque_object",
    "temperature_object",
)
"""Keys of a node that name an object."""
AXES = 2
"""Axes of a leg, and so pairs of a range."""


def load_bus(path: Path) -> BusConfig:
    """Read a bus file.

    Raises:
        ConfigError: it is missing, no TOML, or describes no bus; the message starts with the path.
    """
    return _load(path, lambda content: bus_from_mapping(content, path.parent))


def load_limits(path: Path) -> SafetyLimits:
    """Read a limits file.

    Raises:
        ConfigError: it is missing, no TOML, or has a limit that makes no sense.
    """
    return _load(path, limits_from_mapping)


def _load(path: Path, make: Callable[[Mapping[str, Any]], Built]) -> Built:
    try:
        return make(read_toml(path))
    except FileNotFoundError:
        raise ConfigError(
            f"{path}: no such file; files to begin with are in {shipped_root() / 'hardware'}: copy "
            "them and put in what your leg has"
        ) from None
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
    return build(SafetyLimits, "limits", given, converted=done)


def bus_from_mapping(content: Mapping[str, Any], folder: Path = Path()) -> BusConfig:
    """A bus from the tables of a file in `folder`; raises ConfigError."""
    check_keys(BusConfig, "bus", content)
    given = dict(content)
    tables = _list("node", given.pop("node", []))
    # A data sheet of the bus is that of every node which names none.
    usual = {"eds": given.pop("eds")} if "eds" in given else {}
    given["nodes"] = tuple(
        _node(usual | _table("node", table), place, folder)
        for place, table in enumerate(tables, start=1)
    )
    _waive(given)
    bus = build(BusConfig, "bus", given, converted=("nodes", "waive"))
    interpolation_time(bus.period_us)
    return bus


def _waive(given: dict[str, Any]) -> None:
    """Turn the list of waivers into a tuple of names."""
    if "waive" in given:
        names = _list("waive", given["waive"])
        if not all(isinstance(name, str) for name in names):
            raise ConfigError(f"'waive' must be a list of names, not {names!r}")
        given["waive"] = tuple(names)


def _node(given: dict[str, Any], place: int, folder: Path) -> NodeConfig:
    where = f"node '{given['name']}'" if "name" in given else f"node {place} of the file"
    with at(where):
        return _node_of(given, where, folder)


def _node_of(given: dict[str, Any], where: str, folder: Path) -> NodeConfig:
    check_keys(NodeConfig, where, given)
    identity = {key: given.pop(key) for key in _IDENTITY if key in given}
    given["identity"] = build(Identity, where, identity)
    _encoders(where, given)
    if "eds" in given:
        if not isinstance(given["eds"], str):
            raise ConfigError(f"{where}: eds is {given['eds']!r}; it must be the path of a file")
        given["eds"] = folder / given["eds"]
    if "id" in given:
        given["node_id"] = given.pop("id")
    for key in OBJECT_KEYS:
        if key in given:
            with at(f"{where}: {key}"):
                given[key] = parse_object(given[key])
    given["quirks"] = _quirks(where, given.get("quirks", {}))
    _pdos(where, given)
    if "homed" in given:
        with at(f"{where} homed"):
            given["homed"] = _homed(f"{where} homed", given["homed"])
    if "soft_limits" in given:
        given["soft_limits"] = _range("soft_limits", given["soft_limits"])
    parameters = _table("parameters", given.get("parameters", {}))
    given["parameters"] = found = tuple(_parameter(*item) for item in parameters.items())
    keys = [parameter.key for parameter in found]
    for key in keys:
        if keys.count(key) > 1:
            raise ConfigError(f"{where} gives parameter {name_of(*key)} twice")
    done = ("identity", "motor", "link", "side", "quirks", "rpdos", "tpdos", "eds", *OBJECT_KEYS)
    return build(NodeConfig, where, given, converted=(*done, "parameters", "soft_limits", "homed"))


def _homed(where: str, table: object) -> HomedCondition:
    given = _table("homed", table)
    if "object" in given:
        given["object"] = parse_object(given["object"])
    return build(HomedCondition, where, given, converted=("object",))


def _encoders(where: str, given: dict[str, Any]) -> None:
    """Turn the tables of a drive's encoders into units: [node.motor], [node.link], or both.

    A drive that has the one of the link alone closes its position loop over it.
    """
    found = [axis for axis in ("motor", "link") if axis in given]
    if not found:
        raise ConfigError(f"{where} has no encoder; describe it in [node.motor], [node.link]")
    units: dict[str, AxisUnits] = {}
    for axis in found:
        with at(f"{where} {axis}"):
            units[axis] = build(AxisUnits, f"{where} {axis}", _table(axis, given[axis]))
    given["motor"] = units[found[0]]
    given["link"] = units["link"] if len(found) == 2 else None
    given["side"] = Side(found[0])


def _quirks(where: str, value: object) -> Quirks:
    given = _table("quirks", value)
    codes = _list("warnings", given.get("warnings", []))
    for code in codes:
        if isinstance(code, bool) or not isinstance(code, int):
            raise ConfigError(f"{where} quirks: warnings holds {code!r}; it must be a whole number")
    given["warnings"] = tuple(codes)
    shown = given.get("mode_shown", ModeShown.CONFIGURED)
    if shown not in list(ModeShown):
        raise ConfigError(
            f"{where} quirks: mode_shown is {shown!r}; it must be one of {', '.join(ModeShown)}"
        )
    given["mode_shown"] = ModeShown(shown)
    return build(Quirks, f"{where} quirks", given, converted=("warnings", "mode_shown"))


def _pdos(where: str, given: dict[str, Any]) -> None:
    """Turn the tables of the PDOs into process data; what is not given is packed by itself."""
    for key, plural in (("rpdo", "rpdos"), ("tpdo", "tpdos")):
        if key in given:
            usual = {"deadline_ms": RPDO.deadline_ms} if key == "rpdo" else {}
            pdos = _list(key, given.pop(key))
            with at(f"{where}: {key}"):
                given[plural] = tuple(_pdo(where, entry, usual) for entry in pdos)
    target = given.get("target_object", TARGET_POSITION)
    given.setdefault("rpdos", packed((CONTROLWORD, target), RPDO.deadline_ms))
    answers = [STATUSWORD, given.get("motor_object", POSITION_ACTUAL)]
    if given["link"] is not None:
        answers.append(given.get("link_object", LINK_POSITION_SHORT))
    if "torque_object" in given:
        answers.append(given["torque_object"])
    given.setdefault("tpdos", packed(answers))


def _pdo(where: str, table: object, usual: Mapping[str, int]) -> PdoConfig:
    given = dict(usual) | _table("PDO", table)
    objects = _list("objects", given.get("objects", []))
    given["objects"] = tuple(parse_object(text) for text in objects)
    return build(PdoConfig, f"{where} PDO", given, converted=("objects",))


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
    low, high = (float(finite("range", name, number)) for number in numbers)
    return (low, high)
