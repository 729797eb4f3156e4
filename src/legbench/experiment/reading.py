"""Strict reading of the tables of a file into dataclasses; every mistake is told at once."""

import difflib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass
from enum import Enum
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Final, Literal, Union, get_args, get_origin, get_type_hints

from legbench.errors import ConfigError, LegbenchError
from legbench.guests import Registry
from legbench.shipped import locate

REGISTRY: Final = "registry"
"""Metadata of a field that holds the settings of a guest: the `Registry` that finds its class."""
TAGS: Final = ("kind", "family")
"""Class variables that tell the members of a union of dataclasses apart."""
NUMBER_TEXTS: Final = ("nan", "inf", "-inf")
"""Floats that JSON has to spell out."""
BAD: Final = object()
"""Placeholder of a value that was refused; the reason is among the problems."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Special:
    """Codec of a class whose tables have words of their own, or which may be given as a file."""

    load: Callable[[Path], Any]
    """Function that reads a file which stands for the value."""
    decode: Callable[[Mapping[str, Any]], Any] | None = None
    """Function that reads its tables; by default they are its fields."""
    structure: Mapping[str, Any] | None = None
    """Example of all tables that it may have, to name misspelt keys by."""


@dataclass(slots=True, kw_only=True)
class Reader:
    """Reader that builds values and collects what is wrong with their tables."""

    folder: Path
    """Folder to which paths are relative."""
    specials: Mapping[type, Special]
    json: bool = False
    """Whether floats may be the texts that JSON needs for those it lacks."""
    problems: list[str] = field(default_factory=list)

    def read(self, kind: type[Any], tables: Mapping[str, Any]) -> Any:
        """Return a dataclass from its tables.

        Raises:
            ConfigError: something is wrong with them; all of it is told, with its dotted key.
        """
        value = self.table(kind, tables, "")
        if self.problems:
            raise ConfigError("; ".join(self.problems))
        return value

    def refuse(self, at: str, why: str) -> Any:
        """Add a problem to those that are told in the end."""
        self.problems.append(f"{at}: {why}" if at else why)
        return BAD

    def table(self, kind: type[Any], raw: object, at: str) -> Any:
        """Return a dataclass from one table."""
        if not isinstance(raw, Mapping):
            return self.refuse(at, f"is {raw!r}; it must be a table")
        known = {entry.name: entry for entry in fields(kind) if entry.init}
        self.unknown(raw, known, at)
        hints = get_type_hints(kind)
        values = {
            name: self._field(entry, hints[name], raw[name], joined(at, name))
            for name, entry in known.items()
            if name in raw
        }
        for name in (name for name in known if name not in raw):
            if known[name].default is MISSING and known[name].default_factory is MISSING:
                self.refuse(joined(at, name), "is missing")
                values[name] = BAD
        if any(value is BAD for value in values.values()):
            return BAD
        try:
            return kind(**values)
        except LegbenchError as error:
            return self.refuse(at, str(error))

    def _field(self, entry: Field[Any], hint: Any, raw: object, at: str) -> Any:
        registry = entry.metadata.get(REGISTRY)
        return self.value(hint, raw, at) if registry is None else self.guest(registry, raw, at)

    def unknown(self, raw: Mapping[str, Any], known: Iterable[str], at: str) -> None:
        """Add the keys that are not known to the problems, each with the nearest that is."""
        names = list(known)
        for key in raw:
            if key in names:
                continue
            near = difflib.get_close_matches(str(key), names, n=1, cutoff=0.5)
            hint = f"did you mean '{near[0]}'? " if near else ""
            self.refuse(joined(at, str(key)), f"unknown key; {hint}known are {', '.join(names)}")

    def guest(self, registry: Registry, raw: object, at: str) -> Any:
        """Return the settings of a controller or plant from a table with `kind` and `settings`."""
        if not isinstance(raw, Mapping):
            return self.refuse(at, f"is {raw!r}; it must be a table with kind and settings")
        self.unknown(raw, ("kind", "settings"), at)
        name = raw.get("kind")
        if not isinstance(name, str):
            return self.refuse(f"{at}.kind", f"is missing; there are {', '.join(registry.names())}")
        try:
            kind = registry.find(placed(name, self.folder))
        except ConfigError as error:
            return self.refuse(f"{at}.kind", str(error))
        return self.table(kind, raw.get("settings", {}), f"{at}.settings")

    def value(self, hint: Any, raw: object, at: str) -> Any:
        """Return a value of a type."""
        origin = get_origin(hint)
        if origin in (Union, UnionType):
            return self._union(get_args(hint), raw, at)
        if origin is tuple:
            return self._tuple(get_args(hint), raw, at)
        if origin is Literal:
            return self._choice(get_args(hint), raw, at)
        special = self.specials.get(hint)
        if special is not None:
            return self._special(hint, special, raw, at)
        if is_dataclass(hint):
            return self.table(hint, raw, at)
        if isinstance(hint, type) and issubclass(hint, Enum):
            return self._enum(hint, raw, at)
        return self._plain(hint, raw, at)

    def _plain(self, hint: Any, raw: object, at: str) -> Any:
        if hint is float:
            if self.json and raw in NUMBER_TEXTS:
                return float(str(raw))
            if isinstance(raw, int | float) and not isinstance(raw, bool):
                return float(raw) if abs(raw) < 1e308 or isinstance(raw, float) else self._huge(at)
            return self.refuse(at, f"is {raw!r}; it must be a number")
        if hint is int:
            if isinstance(raw, int) and not isinstance(raw, bool):
                return raw
            return self.refuse(at, f"is {raw!r}; it must be a whole number")
        if hint is bool:
            return raw if isinstance(raw, bool) else self.refuse(at, f"is {raw!r}; true or false?")
        if not isinstance(raw, str):
            return self.refuse(at, f"is {raw!r}; it must be a text")
        if hint is Path:
            return self.folder / raw
        if hint is bytes:
            try:
                return bytes.fromhex(raw)
            except ValueError:
                return self.refuse(at, f"is {raw!r}; it must be bytes in hexadecimal")
        return raw if hint is str else self.refuse(at, f"cannot be read from a file ({hint})")

    def _huge(self, at: str) -> Any:
        return self.refuse(at, "is too large for a number")

    def _enum(self, hint: type[Enum], raw: object, at: str) -> Any:
        chosen = self._choice(tuple(member.value for member in hint), raw, at)
        return chosen if chosen is BAD else hint(chosen)

    def _choice(self, known: tuple[Any, ...], raw: object, at: str) -> Any:
        if isinstance(raw, str) and raw in known:
            return raw
        return self.refuse(at, f"is {raw!r}; known are {', '.join(map(str, known))}")

    def _tuple(self, hints: tuple[Any, ...], raw: object, at: str) -> Any:
        if not isinstance(raw, list | tuple):
            return self.refuse(at, f"is {raw!r}; it must be a list")
        if hints[-1] is Ellipsis:
            hints = (hints[0],) * len(raw)
        if len(raw) != len(hints):
            return self.refuse(at, f"has {len(raw)} entries; it must have {len(hints)}")
        pairs = enumerate(zip(hints, raw, strict=True))
        values = tuple(self.value(hint, entry, f"{at}.{index}") for index, (hint, entry) in pairs)
        return BAD if any(value is BAD for value in values) else values

    def _union(self, hints: tuple[Any, ...], raw: object, at: str) -> Any:
        members = [hint for hint in hints if hint is not NoneType]
        if len(members) == 1:
            return self.value(members[0], raw, at)
        tag, classes = tagged(members)
        if not isinstance(raw, Mapping) or raw.get(tag) not in classes:
            found = raw.get(tag) if isinstance(raw, Mapping) else raw
            return self.refuse(f"{at}.{tag}", f"is {found!r}; known are {', '.join(classes)}")
        rest = {key: value for key, value in raw.items() if key != tag}
        return self.table(classes[raw[tag]], rest, at)

    def _special(self, hint: type, special: Special, raw: object, at: str) -> Any:
        try:
            if isinstance(raw, str):
                return special.load(locate(Path(raw), self.folder))
            if special.decode is None:
                return self.table(hint, raw, at)
            if not isinstance(raw, Mapping):
                return self.refuse(at, f"is {raw!r}; it must be a table or the path of a file")
            if special.structure is not None and self._misspelt(raw, special.structure, at):
                return BAD
            return special.decode(raw)
        except LegbenchError as error:
            return self.refuse(at, str(error))

    def _misspelt(self, raw: Mapping[str, Any], known: Mapping[str, Any], at: str) -> bool:
        before = len(self.problems)
        self.unknown(raw, known, at)
        for name, inner in known.items():
            if isinstance(inner, Mapping) and isinstance(raw.get(name), Mapping):
                self.unknown(raw[name], inner, joined(at, name))
        return len(self.problems) > before


def joined(at: str, name: str) -> str:
    """A dotted key."""
    return f"{at}.{name}" if at else name


def placed(name: str, folder: Path) -> str:
    """The name of a guest whose file is told relative to `folder`."""
    place, _, _ = name.rpartition(":")
    return str(folder / name) if place.endswith(".py") or name.endswith(".py") else name


def tagged(members: Iterable[Any]) -> tuple[str, dict[str, type[Any]]]:
    """The class variable that tells the members of a union apart, and its values."""
    classes = list(members)
    for tag in TAGS:
        values = [vars(member).get(tag) for member in classes]
        if all(isinstance(value, str) for value in values):
            return tag, dict(zip(map(str, values), classes, strict=True))
    raise TypeError(f"nothing tells {classes} apart; each needs one of {TAGS} as a ClassVar[str]")
