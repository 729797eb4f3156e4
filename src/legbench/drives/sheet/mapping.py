"""Choice of process data that a drive can carry, by free and by fixed mappings; pure."""

from collections.abc import Iterable, Sequence
from itertools import combinations

from legbench.drives.errors import CodecError
from legbench.drives.protocol.frame import COB_NO_REMOTE, RPDO_BASES, TPDO_BASES
from legbench.drives.protocol.pdo import MAX_BYTES, Mapped, split_word
from legbench.drives.setup.config import PdoConfig
from legbench.drives.setup.configuration import EVERY_SYNC
from legbench.drives.setup.needs import LAST_SYNCHRONOUS
from legbench.drives.sheet.data_sheet import DataSheet

MOST_TRIED = 8
"""Number of PDOs among which a choice is made."""
MOST_USED = 3
"""Largest number of PDOs that carry the process data of one drive each way."""
HARMLESS = {0x6060, 0x6071, 0x60B0, 0x60B1, 0x60B2, 0x60FF}
"""Objects that a fixed command frame may carry besides: 0, or the mode, changes nothing there."""


def choose(
    sheet: DataSheet, needed: Sequence[Mapped], *, commands: bool
) -> tuple[PdoConfig, ...] | None:
    """Return the fewest PDOs that carry all objects that are needed, each once; none if none do.

    Args:
        sheet: the drive.
        needed: objects to carry.
        commands: RPDOs, else TPDOs.
    """
    numbers = [
        number
        for number in sheet.pdos(commands=commands)[:MOST_TRIED]
        if _is_usable(sheet, number, commands=commands)
    ]
    free = [number for number in numbers if _is_free(sheet, number, commands=commands)]
    fixed = {
        number: entries
        for number in numbers
        if number not in free
        and (entries := _fixed(sheet, number, needed, commands=commands)) is not None
    }
    usable = [number for number in numbers if number in free or number in fixed]
    for size in range(1, MOST_USED + 1):
        for subset in combinations(usable, size):
            chosen = _packed(needed, subset, fixed)
            if chosen is not None:
                return tuple(
                    _pdo(sheet, number, entries, commands=commands)
                    for number, entries in sorted(chosen.items())
                )
    return None


def _pdo(
    sheet: DataSheet, number: int, entries: tuple[Mapped, ...], *, commands: bool
) -> PdoConfig:
    index = (0x1400 if commands else 0x1800) + number - 1
    deadline_ms = 20 if commands and sheet.writable((index, 5)) else 0
    return PdoConfig(number=number, objects=entries, deadline_ms=deadline_ms)


def _is_usable(sheet: DataSheet, number: int, *, commands: bool) -> bool:
    """Whether identifier and transmission type of a PDO are what they have to be, or can be."""
    base, comm = (RPDO_BASES, 0x1400) if commands else (TPDO_BASES, 0x1800)
    comm += number - 1
    if number > len(base):
        return False
    if not sheet.writable((comm, 1)):
        cob = sheet.default((comm, 1), 0)
        own = (comm, 1) in sheet.relative and cob is not None
        if not own or (cob or 0) & ~COB_NO_REMOTE != base[number - 1]:
            return False
    kind = sheet.default((comm, 2), 0)
    if sheet.writable((comm, 2)) or kind is None:
        return True
    return kind <= LAST_SYNCHRONOUS if commands else kind == EVERY_SYNC


def _is_free(sheet: DataSheet, number: int, *, commands: bool) -> bool:
    return sheet.mappable(number, 2, commands=commands)


def _fixed(
    sheet: DataSheet, number: int, needed: Sequence[Mapped], *, commands: bool
) -> tuple[Mapped, ...] | None:
    """Return what a PDO is fixed to; none where it carries what is not known, or does harm."""
    entries: list[Mapped] = []
    wanted = {entry.key: entry for entry in needed}
    for word in sheet.mapped(number, commands=commands):
        index, sub, bits = split_word(word)
        known = sheet.objects.get((index, sub))
        if known is None:
            return None
        try:
            entry = wanted.get(known.key) or Mapped(index, sub, known.kind)
        except CodecError:
            return None
        if entry.bits != bits or (commands and not (entry in needed or index in HARMLESS)):
            return None
        entries.append(entry)
    carries = any(entry in needed for entry in entries)
    return tuple(entries) if carries else None


def _packed(
    needed: Sequence[Mapped], subset: Sequence[int], fixed: dict[int, tuple[Mapped, ...]]
) -> dict[int, tuple[Mapped, ...]] | None:
    """Put what is needed into some PDOs, all of which are used; none if it does not fit."""
    chosen = {number: fixed[number] for number in subset if number in fixed}
    carried = [entry for entries in chosen.values() for entry in entries if entry in needed]
    if len(set(carried)) < len(carried):
        return None
    rest = [entry for entry in needed if entry not in carried]
    for number in subset:
        if number in fixed:
            continue
        taken = _fill(rest)
        if not taken:
            return None
        chosen[number] = taken
        rest = [entry for entry in rest if entry not in taken]
    return None if rest else chosen


def _fill(entries: Iterable[Mapped]) -> tuple[Mapped, ...]:
    """Take objects in order as long as they fit a frame."""
    taken: list[Mapped] = []
    for entry in entries:
        if sum(one.bits for one in taken) + entry.bits <= 8 * MAX_BYTES:
            taken.append(entry)
    return tuple(taken)
