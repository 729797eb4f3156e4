"""Frozen values from the tables of a file: keys and types are checked, errors name their place."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, Field, fields
from typing import Any, TypeVar

from legbench.drives.setup.config import NOT_IN_FILES
from legbench.errors import ConfigError

Built = TypeVar("Built")
_PLAIN_TYPES: dict[str, tuple[type, ...]] = {
    "str": (str,),
    "float": (int, float),
    "bool": (bool,),
}
KEYS: Mapping[str, tuple[str, ...]] = {
    "nodes": ("node", "eds"),
    "node_id": ("id",),
    "identity": ("vendor", "product", "serial"),
    "side": (),
    "rpdos": ("rpdo",),
    "tpdos": ("tpdo",),
}
"""Keys of a file from which a field of another name is made."""
LARGEST = 1e18
"""Bound that the magnitude of every number of a file stays below."""


@contextmanager
def at(where: str) -> Iterator[None]:
    """Put a place of the file in front of an error that does not begin with it yet."""
    try:
        yield
    except ConfigError as error:
        if str(error).startswith(where):
            raise
        raise ConfigError(f"{where}: {error}") from None


def build(
    kind: Callable[..., Built],
    where: str,
    given: Mapping[str, Any],
    converted: tuple[str, ...] = (),
) -> Built:
    """A dataclass from keys: unknown and missing ones are named, plain types checked."""
    known = _fields(kind)
    _refuse_unknown(where, given, known)
    for name, value in given.items():
        if name in converted:
            continue
        words = str(getattr(known[name].type, "__name__", known[name].type)).split(" | ")[0]
        allowed = _PLAIN_TYPES.get(words, (int,))
        if (isinstance(value, bool) and words != "bool") or not isinstance(value, allowed):
            raise ConfigError(f"{where}: {name} is {value!r}; it must be of type {words}")
    plain = {
        name: finite(where, name, value)
        for name, value in given.items()
        if name not in converted and isinstance(value, int | float)
    }
    lacking = [
        ", ".join(KEYS.get(name, (name,)))
        for name, field in known.items()
        if name not in given and field.default is MISSING
    ]
    if lacking:
        raise ConfigError(f"{where}: {', '.join(lacking)} must be given")
    return kind(**(dict(given) | plain))


def check_keys(kind: Callable[..., object], where: str, given: Mapping[str, Any]) -> None:
    """Refuse a table with keys that files do not have, fields of other names included.

    Raises:
        ConfigError: a key is unknown; the message names all that are known.
    """
    known = [key for name in _fields(kind) for key in KEYS.get(name, (name,))]
    _refuse_unknown(where, given, known)


def _fields(kind: Callable[..., object]) -> "dict[str, Field[Any]]":
    return {
        field.name: field
        for field in fields(kind)  # pyrefly: ignore[bad-argument-type]
        if field.init and NOT_IN_FILES not in field.metadata
    }


def _refuse_unknown(where: str, given: Iterable[str], known: Collection[str]) -> None:
    unknown = sorted(set(given) - set(known))
    if unknown:
        raise ConfigError(
            f"{where} has unknown keys: {', '.join(unknown)}; it knows {', '.join(known)}"
        )


def finite(where: str, name: str, value: float) -> float:
    """Return a number of a file, refusing one that is infinite, not a number or too large."""
    if not abs(value) < LARGEST:
        text = f"{value}" if isinstance(value, float) else "too large"
        raise ConfigError(
            f"{where}: {name} is {text}; it must be a number below {LARGEST:g}: a limit that is "
            "not to act is left out"
        )
    return value
