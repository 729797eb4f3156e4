"""Entries in which the experiments of two runs differ."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

from legbench.recording.description import RunDescription

COMPARED: Final = ("design", "setup", "controller", "conventions", "servo", "ground")
"""Tables in which two runs of the same experiment agree: plant, linkage and numerics are what such
runs are compared for."""


def unlike(ours: RunDescription, theirs: RunDescription) -> list[str]:
    """Dotted entries in which two experiments differ, of the tables that both have."""
    a, b = ours.experiment, theirs.experiment
    both = [name for name in COMPARED if name in a and name in b]
    return [entry for name in both for entry in _unlike(name, a[name], b[name])]


def _unlike(path: str, ours: Any, theirs: Any) -> Iterator[str]:
    if isinstance(ours, Mapping) and isinstance(theirs, Mapping):
        for key in sorted(ours.keys() | theirs.keys()):
            yield from _unlike(f"{path}.{key}", ours.get(key), theirs.get(key))
    elif ours != theirs:
        yield path
