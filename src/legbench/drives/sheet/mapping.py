"""Choice of process data that a drive can carry, by free and by fixed mappings; pure."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations

from legbench.drives.errors import CodecError
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import COB_NO_REMOTE, RPDO_BASES, TPDO_BASES
from legbench.drives.protocol.pdo import DUMMIES, MAX_BYTES, Mapped, split_word
from legbench.drives.setup.config import PdoConfig
from legbench.drives.setup.configuration import EVERY_SYNC
from legbench.drives.setup.needs import LAST_SYNCHRONOUS
from legbench.drives.sheet.data_sheet import DataSheet

MOST_TRIED = 8
"""Number of PDOs among which a choice is made."""
MOST_USED = 3
"""Largest number of PDOs that carry the process data of one drive each way."""
MOST_TOLD = 4
"""Number of PDOs of which a refusal speaks."""
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
        if _obstacle(sheet, number, commands=commands) is None
    ]
    rooms = {number: sheet.room(number, commands=commands) for number in numbers}
    fixed = {
        number: entries
        for number in numbers
        if not rooms[number]
        and (entries := _fixed(sheet, number, needed, commands=commands)) is not None
        and any(entry in needed for entry in entries)
    }
    usable = [number for number in numbers if rooms[number] or number in fixed]
    for size in range(1, MOST_USED + 1):
        for subset in combinations(usable, size):
            chosen = _packed(needed, subset, fixed, rooms)
            if chosen is not None:
                if not commands:
                    chosen |= _always_on(sheet, numbers, needed, chosen)
                return tuple(
                    _pdo(sheet, number, entries, commands=commands)
                    for number, entries in sorted(chosen.items())
                )
    return None


def obstacles(sheet: DataSheet, *, commands: bool) -> tuple[str, ...]:
    """Return why each PDO cannot be chosen freely, a few words each; empty for none at all."""
    return tuple(
        f"{'RPDO' if commands else 'TPDO'}{number}: "
        + (_obstacle(sheet, number, commands=commands) or _carries(sheet, number, commands))
        for number in sheet.pdos(commands=commands)[:MOST_TOLD]
    )


def _carries(sheet: DataSheet, number: int, commands: bool) -> str:
    room = sheet.room(number, commands=commands)
    if room:
        return f"room for {room} objects"
    words = sheet.mapped(number, commands=commands)
    return f"fixed to {', '.join(name_of_word(word) for word in words) or 'nothing'}"


def name_of_word(word: int) -> str:
    """Name of a mapping entry in messages, without its length."""
    index, sub, _ = split_word(word)
    return f"{index:04X}h:{sub:02X}"


def _pdo(
    sheet: DataSheet, number: int, entries: tuple[Mapped, ...], *, commands: bool
) -> PdoConfig:
    index = (0x1400 if commands else 0x1800) + number - 1
    deadline_ms = 20 if commands and sheet.writable((index, 5)) else 0
    return PdoConfig(number=number, objects=entries, deadline_ms=deadline_ms)


def _obstacle(sheet: DataSheet, number: int, *, commands: bool) -> str | None:
    """Return why identifier or transmission type of a PDO cannot be what they have to be."""
    base, comm = (RPDO_BASES, 0x1400) if commands else (TPDO_BASES, 0x1800)
    comm += number - 1
    if number > len(base):
        return "has no identifier by the standard"
    cob = sheet.default((comm, 1), 0)
    if not sheet.writable((comm, 1)) and cob is not None:
        own = (comm, 1) in sheet.relative
        if not own or cob & ~COB_NO_REMOTE != base[number - 1]:
            return f"{comm:04X}h:01 is fixed to {cob:08X}h{' and the node id' if own else ''}"
    if not sheet.has((comm, 2)):
        return f"{comm:04X}h:02 is missing, the transmission type"
    kind = sheet.default((comm, 2), 0)
    low, high = sheet.limits.get((comm, 2), (EVERY_SYNC, EVERY_SYNC))
    if kind is None or (sheet.writable((comm, 2)) and low <= EVERY_SYNC <= high):
        return None
    if kind <= LAST_SYNCHRONOUS if commands else kind == EVERY_SYNC:
        return None
    if sheet.writable((comm, 2)):
        return f"{comm:04X}h:02 takes {low} to {high}, not {EVERY_SYNC}, which follows every SYNC"
    return f"{comm:04X}h:02 is fixed to {kind}, it does not follow every SYNC"


def _fixed(
    sheet: DataSheet, number: int, needed: Sequence[Mapped], *, commands: bool
) -> tuple[Mapped, ...] | None:
    """Return what a PDO is fixed to; none where it carries what is not known, or does harm."""
    entries: list[Mapped] = []
    wanted = {entry.key: entry for entry in needed}
    for word in sheet.mapped(number, commands=commands):
        index, sub, bits = split_word(word)
        kind = _kind_of(sheet, index, sub)
        if kind is None:
            return None
        try:
            entry = wanted.get((index, sub)) or Mapped(index, sub, kind)
        except CodecError:
            return None
        harmless = index in HARMLESS or index in DUMMIES
        if entry.bits != bits or (commands and not (entry in needed or harmless)):
            return None
        entries.append(entry)
    return tuple(entries)


def _kind_of(sheet: DataSheet, index: int, sub: int) -> DataType | None:
    """Type of an object that is mapped; none where the drive has no such object."""
    if index in DUMMIES:
        return None if sub else DataType(index)
    known = sheet.objects.get((index, sub))
    return None if known is None else known.kind


def _always_on(
    sheet: DataSheet,
    numbers: Iterable[int],
    needed: Sequence[Mapped],
    chosen: Mapping[int, tuple[Mapped, ...]],
) -> dict[int, tuple[Mapped, ...]]:
    """Return the other TPDOs that cannot be switched off, and what they are fixed to.

    They are sent in any case, so the bus file has to name them; one that repeats what is needed
    would leave open which of the two counts.
    """
    return {
        number: entries
        for number in numbers
        if number not in chosen
        and sheet.stays_on(0x1800 + number - 1)
        and (entries := _fixed(sheet, number, needed, commands=False))
        and not any(entry in needed for entry in entries)
    }


def _packed(
    needed: Sequence[Mapped],
    subset: Sequence[int],
    fixed: Mapping[int, tuple[Mapped, ...]],
    rooms: Mapping[int, int],
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
        taken = _fill(rest, rooms[number])
        if not taken:
            return None
        chosen[number] = taken
        rest = [entry for entry in rest if entry not in taken]
    return None if rest else chosen


def _fill(entries: Iterable[Mapped], room: int) -> tuple[Mapped, ...]:
    """Take objects in order as long as they fit a frame and its mapping."""
    taken: list[Mapped] = []
    for entry in entries:
        if len(taken) < room and sum(one.bits for one in (*taken, entry)) <= 8 * MAX_BYTES:
            taken.append(entry)
    return tuple(taken)
