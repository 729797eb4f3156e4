"""Fields of a dataclass whose value is one of a few words."""

from enum import StrEnum
from typing import Any

from legbench.errors import ConfigError


def choose(settings: Any, **kinds: type[StrEnum]) -> None:
    """Make members of the fields that were given as plain words, in a frozen dataclass.

    A plain word is equal to the member that it names, but is not the member: a comparison with `is`
    would take it for another one.

    Args:
        settings: a dataclass in its `__post_init__`.
        kinds: field -> its enumeration.

    Raises:
        ConfigError: a word that names no member; lists those that there are.
    """
    for name, kind in kinds.items():
        value = getattr(settings, name)
        try:
            object.__setattr__(settings, name, kind(value))
        except ValueError:
            known = ", ".join(kind)
            raise ConfigError(f"{name} is {value!r}; choose from {known}") from None
