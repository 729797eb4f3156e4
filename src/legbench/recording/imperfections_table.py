"""Imperfections that a run says it had, read from its manifest."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, Final

from legbench.errors import ConfigError, FormatError
from legbench.imperfections import Imperfections

SHAPES: Final = {
    "trunk_mass_error": (),
    "mass_error": (3,),
    "com_error": (3,),
    "inertia_error": (3,),
    "motor_range": (2, 2),
}
"""How many numbers an entry has; the others are pairs."""


def parse_imperfections(table: Mapping[str, Any]) -> Imperfections:
    """Imperfections of a run; an older run, and one on the bench, says none.

    Raises:
        FormatError: no leg can have what it says.
    """
    known = [entry.name for entry in fields(Imperfections)]
    if unknown := sorted(set(table).difference(known)):
        raise FormatError(
            f"manifest imperfections: unknown {', '.join(unknown)}; known are {', '.join(known)}"
        )
    for name, value in table.items():
        if _shape(value) != SHAPES.get(name, (2,)):
            raise FormatError(
                f"manifest imperfections.{name} is {value!r}; it must be numbers of shape "
                f"{SHAPES.get(name, (2,))}"
            )
    try:
        return Imperfections(**{name: _tuples(value) for name, value in table.items()})
    except (ConfigError, TypeError, ValueError) as error:
        raise FormatError(f"manifest imperfections: {error}") from None


def _shape(value: Any) -> tuple[int, ...] | None:
    """Lengths of nested lists of numbers; None where they are uneven or hold something else."""
    if isinstance(value, list):
        inner = {_shape(entry) for entry in value}
        (each,) = inner if len(inner) == 1 else (None,)
        return None if each is None else (len(value), *each)
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return () if number else None


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
