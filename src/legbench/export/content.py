"""The parts of a run that an export carries beside its rows."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from legbench.errors import FormatError
from legbench.phases import PhaseInfo
from legbench.recording.layout import TIME
from legbench.recording.reader import Recording
from legbench.signals import Ints

Progress = Callable[[int, int], None]
"""Callback with the number of rows that have been written, and of all."""


def no_progress(done: int, total: int) -> None:
    """Tell nobody."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """One column of a run: its name on disk, its unit and what it is."""

    name: str
    unit: str
    doc: str

    @property
    def titled(self) -> str:
        """Name with the unit in brackets."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


def fields_of(recording: Recording) -> tuple[Field, ...]:
    """Columns that a run has, in their order on disk; one that it does not declare has no unit."""
    docs = {column.name: column.signal.doc for column in recording.layout.columns}
    docs[TIME] = "plant time since reset"
    units = recording.layout.units
    return tuple(
        Field(name=name, unit=units.get(name, ""), doc=docs.get(name, ""))
        for name in recording.columns
    )


def phases_of(recording: Recording) -> tuple[PhaseInfo, ...]:
    """Phases that the controller of a run declared; none where its description is not readable."""
    described = recording.described
    return () if isinstance(described, FormatError) else described.phases


def phase_names(phases: tuple[PhaseInfo, ...], codes: Ints) -> list[str]:
    """Name of the phase of each row (n,); a code that was not declared is its own name."""
    names = {phase.code: phase.name for phase in phases}
    found, places = np.unique(codes, return_inverse=True)
    texts = [names.get(code, str(code)) for code in found.tolist()]
    return [texts[place] for place in places.tolist()]


def described(recording: Recording) -> Mapping[str, Any]:
    """Units by column and name by code of a phase, as every export carries them."""
    return {
        "units": {field.name: field.unit for field in fields_of(recording)},
        "phases": {str(phase.code): phase.name for phase in phases_of(recording)},
    }


def as_json(content: Mapping[str, Any]) -> bytes:
    """Content as JSON text in UTF-8."""
    return json.dumps(content, ensure_ascii=False, allow_nan=False).encode()
