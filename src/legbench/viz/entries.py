"""Numbers from a run's manifest, which somebody else may have written."""

from collections.abc import Mapping
from typing import Any

from legbench.errors import FormatError

BEYOND = 1e6
"""No dimension of a leg is so large, in whatever SI unit."""


def number_of(manifest: Mapping[str, Any], table: str, key: str, default: float) -> float:
    """Return the number at `key` of a table of the manifest, `default` where it has none.

    Raises:
        FormatError: it is no number, or one that no leg has.
    """
    value = manifest.get(table, {}).get(key, default)
    number = isinstance(value, int | float) and not isinstance(value, bool)
    # Compared, not converted: a whole number of 400 digits is no float.
    if not (number and abs(value) < BEYOND):
        raise FormatError(
            f"manifest {table}.{key} is {value!s:.60}; it must be a number below {BEYOND:g}"
        )
    return float(value)
