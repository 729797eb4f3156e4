"""Experiment files of format 1, in which step, bars and rating reference had fixed defaults."""

from collections.abc import Mapping
from typing import Any, Final

DEFAULTS: Final = {
    "numerics": {"timestep": 0.00025, "loop_solref": [0.00025, 1.0]},
    "linkage": {"bar_density": 0.006},
    "conventions": {"rating_reference": "motor"},
}
"""Values that format 1 meant by an entry that is not there; format 2 fits them to leg and setup."""


def upgraded(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables of format 1 as format 2 has them: what format 1 left unsaid is written out.

    A table that is none is left as it is, for the reader to refuse.
    """
    said = dict(tables)
    for name, defaults in DEFAULTS.items():
        table = said.get(name, {})
        if isinstance(table, Mapping):
            said[name] = {**defaults, **table}
    return said
