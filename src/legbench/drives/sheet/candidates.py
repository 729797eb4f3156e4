"""Objects of a data sheet that may show the link's position or the drive's temperature; pure."""

import re
from collections.abc import Iterable

from legbench.drives.protocol.datatypes import FORMATS, DataType, size_of
from legbench.drives.protocol.objects import Access, ObjectEntry
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.sheet.data_sheet import DataSheet, positions

ADDITIONAL_POSITIONS = 0x60E4
"""Additional position actual values (CiA 402-2)."""
_SECOND = re.compile(r"second|auxil|addition|link|load|joint|output|slave 2|encoder 2|ssi", re.I)
_POSITION = re.compile(r"position|encoder|feedback|angle", re.I)
_NO_POSITION = re.compile(r"index|capture|limit|torque|current|velocity|speed|temp|offset", re.I)
_TEMPERATURE = re.compile(r"temperature", re.I)
_NO_READING = re.compile(r"limit|max|min|time|option|level|count|error", re.I)
MANUFACTURER = range(0x2000, 0x6000)


def link_candidates(sheet: DataSheet) -> tuple[Mapped, ...]:
    """Objects that may show a second position, the likeliest first.

    Those of the profile come first. What a maker's own object shows is told by its name alone.
    """
    found = [entry for entry in positions(sheet) if entry.index == ADDITIONAL_POSITIONS]
    found += [
        entry
        for entry in positions(sheet)
        if entry.index in MANUFACTURER
        and entry.access in (Access.RO, Access.CONST)
        and _SECOND.search(entry.name)
        and _POSITION.search(entry.name)
        and not _NO_POSITION.search(entry.name)
    ]
    return _mapped(found)


def temperature_candidates(sheet: DataSheet) -> tuple[Mapped, ...]:
    """Numbers whose name says that they show a temperature."""
    return _mapped(
        entry
        for entry in sheet.objects.values()
        if entry.access is Access.RO
        and (entry.kind in FORMATS or entry.kind is DataType.REAL32)
        and (size_of(entry.kind) or 9) <= 4
        and entry.kind is not DataType.BOOLEAN
        and _TEMPERATURE.search(entry.name)
        and not _NO_READING.search(entry.name)
    )


def _mapped(entries: Iterable[ObjectEntry]) -> tuple[Mapped, ...]:
    return tuple(Mapped(entry.index, entry.sub, entry.kind) for entry in entries)
