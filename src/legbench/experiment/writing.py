"""Writing of dataclasses as the tables of a file."""

import os
from collections.abc import Callable, Mapping
from dataclasses import Field, dataclass, fields, is_dataclass
from enum import Enum
from functools import lru_cache
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from legbench.experiment.reading import REGISTRY, joined, tagged
from legbench.guests import Registry


@lru_cache(maxsize=256)
def _hints(kind: type[Any]) -> dict[str, Any]:
    """Types of the fields of a class; finding them out takes longer than writing them."""
    return get_type_hints(kind)


@dataclass(frozen=True, slots=True, kw_only=True)
class Writer:
    """Writer that makes tables of plain values; None and tables without entries are left out."""

    tables_of: Mapping[type, Callable[[Any], dict[str, Any]]]
    """Classes whose tables have words of their own."""
    folder: Path | None = None
    """Folder that paths are made relative to; without it they are written as they are."""
    where: bool = True
    """Whether to write what says where something is, not what."""

    def write(self, value: Any) -> dict[str, Any]:
        """Return the tables of a dataclass."""
        kind = type(value)
        own = self.tables_of.get(kind)
        if own is not None:
            return own(value)
        hints = _hints(kind)
        found = {}
        for entry in fields(kind):
            if entry.init and (self.where or not entry.metadata.get("where")):
                content = self._field(entry, hints[entry.name], getattr(value, entry.name))
                if content is not None and content != {}:
                    found[entry.name] = content
        return found

    def _field(self, entry: Field[Any], hint: Any, value: Any) -> Any:
        registry = entry.metadata.get(REGISTRY)
        return self.plain(hint, value) if registry is None else self.guest(registry, value)

    def guest(self, registry: Registry, settings: Any) -> dict[str, Any]:
        """Return kind and settings of a controller or plant as tables."""
        kind = registry.reference(type(settings)) if self.where else str(settings.kind)
        place, colon, name = kind.rpartition(":")
        if place.endswith(".py"):
            kind = f"{self._path(Path(place))}{colon}{name}"
        found: dict[str, Any] = {"kind": kind}
        content = self.write(settings)
        return found | {"settings": content} if content else found

    def plain(self, hint: Any, value: Any) -> Any:
        """Return a value of a type, as a file has it."""
        if value is None:
            return None
        origin, inner = get_origin(hint), get_args(hint)
        if origin in (Union, UnionType):
            members = [member for member in inner if member is not NoneType]
            if len(members) == 1:
                return self.plain(members[0], value)
            tag, _ = tagged(members)
            return {tag: getattr(type(value), tag)} | self.write(value)
        if origin is tuple:
            hints = (inner[0],) * len(value) if inner[-1] is Ellipsis else inner
            return [self.plain(each, item) for each, item in zip(hints, value, strict=True)]
        if is_dataclass(value):
            return self.write(value)
        if isinstance(value, Enum):
            return value.value
        if hint is float:
            return float(value)
        if isinstance(value, Path):
            return self._path(value)
        return value.hex() if isinstance(value, bytes) else value

    def _path(self, path: Path) -> str:
        return str(path) if self.folder is None else os.path.relpath(path, self.folder)


def flat(tables: Mapping[str, Any], at: str = "") -> dict[str, Any]:
    """Dotted key -> value; entries of lists of tables by their index."""
    found: dict[str, Any] = {}
    for key, value in tables.items():
        name = joined(at, key)
        if isinstance(value, Mapping):
            found |= flat(value, name)
        elif isinstance(value, list) and value and isinstance(value[0], Mapping):
            for index, entry in enumerate(value):
                found |= flat(entry, f"{name}.{index}")
        else:
            found[name] = value
    return found
