"""Typed reading of the tables of `run.json`: what is there has its type, or is named and refused.

Unknown keys are left alone: a later version may add some without raising the format.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, TypeVar

from legbench.errors import FormatError

Choice = TypeVar("Choice", bound=StrEnum)


@dataclass(frozen=True, slots=True, kw_only=True)
class ManifestTable:
    """One table of a manifest, and what error messages call it."""

    entries: Mapping[str, Any]
    path: str = ""

    def table(self, key: str) -> "ManifestTable":
        """Table below a key, empty where there is none.

        Raises:
            FormatError: there is something else.
        """
        found = self.entries.get(key)
        if found is None:
            found = {}
        if not isinstance(found, Mapping):
            raise self.refusal(key, found, "a table")
        return ManifestTable(entries=found, path=self.name(key))

    def tables(self, key: str) -> tuple["ManifestTable", ...]:
        """Tables of the list below a key, none where there is no list.

        Raises:
            FormatError: there is something else.
        """
        found = self.entries.get(key)
        if found is None:
            return ()
        if not isinstance(found, list | tuple):
            raise self.refusal(key, found, "a list of tables")
        tables: list[ManifestTable] = []
        for place, each in enumerate(found):
            if not isinstance(each, Mapping):
                raise self.refusal(f"{key}[{place}]", each, "a table")
            tables.append(ManifestTable(entries=each, path=self.name(f"{key}[{place}]")))
        return tuple(tables)

    def text(self, key: str) -> str | None:
        """Text below a key; raises FormatError where there is something else."""
        found = self.entries.get(key)
        if found is None or isinstance(found, str):
            return found
        raise self.refusal(key, found, "a text")

    def texts(self, key: str) -> tuple[str, ...]:
        """List of texts below a key, empty where there is none.

        Raises:
            FormatError: there is something else.
        """
        found = self.entries.get(key)
        if found is None:
            return ()
        if not isinstance(found, list | tuple) or not all(isinstance(each, str) for each in found):
            raise self.refusal(key, found, "a list of texts")
        return tuple(found)

    def number(self, key: str) -> float | None:
        """Number below a key, finite or written as "nan", "inf" or "-inf".

        Raises:
            FormatError: there is something else.
        """
        found = self.entries.get(key)
        if found is None:
            return None
        if found in ("nan", "inf", "-inf"):
            return float(found)
        if isinstance(found, bool) or not isinstance(found, int | float):
            raise self.refusal(key, found, "a number")
        try:
            return float(found)
        except OverflowError:
            raise self.refusal(key, "a whole number of too many digits", "a number") from None

    def whole(self, key: str) -> int | None:
        """Whole number below a key; raises FormatError where there is something else."""
        found = self.number(key)
        if found is None:
            return None
        if not math.isfinite(found) or found != int(found):
            raise self.refusal(key, found, "a whole number")
        return int(found)

    def pair(self, key: str) -> tuple[float, float] | None:
        """Two numbers below a key; raises FormatError where there is something else."""
        found = self.entries.get(key)
        if found is None:
            return None
        if not isinstance(found, list | tuple) or len(found) != 2:
            raise self.refusal(key, found, "two numbers")
        both = ManifestTable(entries={"0": found[0], "1": found[1]}, path=self.name(key))
        first, second = both.number("0"), both.number("1")
        if first is None or second is None:
            raise self.refusal(key, found, "two numbers")
        return (first, second)

    def choice(self, key: str, kinds: type[Choice], default: Choice | None = None) -> Choice:
        """Member of `kinds` that a key names, the default where there is no such key.

        Raises:
            FormatError: no member has that name, or none is named and there is no default.
        """
        found = self.entries.get(key, default)
        try:
            return kinds(found)
        except ValueError:
            known = ", ".join(kind.value for kind in kinds)
            raise FormatError(
                f"manifest {self.name(key)} is {found!r}; known are {known}"
            ) from None

    def name(self, key: str) -> str:
        """Dotted name of a key in messages."""
        return f"{self.path}.{key}" if self.path else key

    def refusal(self, key: str, found: object, wanted: str) -> FormatError:
        """Error that says what stands below a key and what should."""
        return FormatError(f"manifest {self.name(key)} is {found!r}; it must be {wanted}")
