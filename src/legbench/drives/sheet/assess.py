"""Assessment of the objects that a drive has, has fixed, or lacks, by its data sheet; pure."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum

from legbench.drives.protocol.datatypes import FORMATS, SHORT_NAMES, DataType, size_of
from legbench.drives.protocol.objects import Access, Key, name_of
from legbench.drives.protocol.pdo import DUMMIES, Mapped
from legbench.drives.setup.config import (
    CONTROLWORD,
    STATUSWORD,
    BusConfig,
    NodeConfig,
    PdoConfig,
)
from legbench.drives.setup.master_watch import Means, means_of
from legbench.drives.setup.needs import MAPPINGS, Need
from legbench.drives.setup.outcome import ObjectOutcome, held_by
from legbench.drives.setup.taken import RAMPS, not_given
from legbench.drives.sheet.data_sheet import DataSheet
from legbench.drives.sheet.predict import predict

PROFILE_402, CSP_BIT = 0x0192, 1 << 7
"""Device profile in the low word of 1000h, and the bit of the cyclic mode in 6502h (CiA 402-2)."""
CYCLIC = (0x6040, 0x6041, 0x6061, 0x6064, 0x607A)
"""Objects of every cycle, and the display of the mode."""
SHOWN = (0x6041, 0x6061, 0x6064)
"""Those of them that are read."""
WRONG = "another drive, or a data sheet that is right"
"""Way out where a data sheet says what no drive can be."""
READ = {
    (0x1000, 0): "the device type",
    (0x1018, 1): "the vendor",
    (0x1018, 2): "the product",
    (0x1018, 4): "the serial number: two drives of a kind that are swapped are not told apart",
    (0x603F, 0): "the reason of a fault, but for what an emergency message says",
}
"""Objects that are read, and what is not known without them."""
NOT_TOLD = "fixed to a value that the data sheet does not tell"
"""What a drive holds that only the drive itself can show."""
IF_PRESENT = "if present"
"""Need of an object that may be missing, but has to agree where it is there."""
NEEDED_READS = ((0x1000, 0), (0x1018, 1))


class State(Enum):
    """Ways in which a drive has an object."""

    HAS = "has"
    FIXED = "fixed"
    LACKS = "lacks"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """Object that a run needs, and whether the drive has it, has it fixed, or lacks it."""

    object: str
    need: str
    state: State
    remark: str = ""
    """What is not protected or known without it, and what takes its place."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Assessment:
    """Assessment of a drive for a node of a bus file."""

    node: str
    findings: tuple[Finding, ...]
    problems: tuple[str, ...]
    """Reasons for which the drive cannot be used as the bus file says, a line each."""
    unprotected: tuple[str, ...]
    """What is not protected, and what takes its place, a line each."""
    means: tuple[Means, ...]
    """Ways in which the drive notices that its master is gone."""
    outcomes: tuple[ObjectOutcome, ...]


def assess(
    sheet: DataSheet, bus: BusConfig, node: NodeConfig, *, speed: float = float("inf")
) -> Assessment:
    """Hold a node of a bus file against the data sheet of its drive.

    Args:
        sheet: the drive.
        bus: the bus.
        node: one of its nodes.
        speed: highest speed of the motor [rad/s].
    """
    outcomes = predict(sheet, bus, node)
    written = [entry for entry in outcomes if not _is_mapping(entry)]
    given = {entry.parameter.key for entry in outcomes}
    unused = tuple(_unused(sheet, given))
    lost = [entry.line for entry in outcomes if entry.passes and entry.line is not None]
    found = [_finding(entry, sheet, node) for entry in written]
    untold = [one for one in found if one.need == Need.PROTECTION.value and NOT_TOLD in one.remark]
    reads = [finding for finding in _reads(sheet) if finding.state is State.LACKS]
    return Assessment(
        node=node.name,
        findings=(
            *_cyclic(sheet),
            *_encoders(node),
            *_reads(sheet),
            *found,
            *unused,
            *_replaced(sheet, given),
        ),
        problems=tuple(_problems(sheet, node, outcomes)),
        unprotected=(*lost, *(f"{one.object}: {one.remark}" for one in (*untold, *reads, *unused))),
        means=means_of(bus, node, speed=speed, held=held_by(outcomes)),
        outcomes=outcomes,
    )


def short_name(kind: DataType) -> str:
    """Name of a type in bus files."""
    return next(name for name, known in SHORT_NAMES.items() if known is kind)


def _is_mapping(entry: ObjectOutcome) -> bool:
    return any(entry.parameter.index in mapping for mapping in MAPPINGS)


def _finding(entry: ObjectOutcome, sheet: DataSheet, node: NodeConfig) -> Finding:
    told = sheet.default(entry.parameter.key, node.node_id) is not None
    state = State.LACKS if entry.missing else State.HAS if entry.code is None else State.FIXED
    return Finding(
        object=entry.name,
        need=IF_PRESENT if entry.row.may_lack else entry.row.need.value,
        state=state,
        remark=(entry.line or "").removeprefix(f"{entry.name}: ")
        or _nothing_lost(entry, told=told),
    )


def _nothing_lost(entry: ObjectOutcome, *, told: bool) -> str:
    if entry.code is None or not entry.passes:
        return ""
    if entry.missing:
        return "where it is missing nothing is lost"
    taken = f"{NOT_TOLD}, taken to be {entry.parameter.value}; `legbench drives configure` reads it"
    return "as it is wanted" if told else taken


def _unused(sheet: DataSheet, written: set[Key]) -> Iterator[Finding]:
    """Yield the protections that the bus file gives no value for: whether the drive has them."""
    for key, row in not_given(written):
        has = sheet.has(key)
        why = "the bus file gives no value" if has else "the drive has no such object"
        yield Finding(
            object=name_of(*key),
            need=row.need.value,
            state=State.HAS if has else State.LACKS,
            remark=f"{why}; {row.loss}",
        )


def _replaced(sheet: DataSheet, written: set[Key]) -> Iterator[Finding]:
    """Yield the usual ramp of a quick stop, for which the bus file gives the other one."""
    usual, other = RAMPS
    if other in written and not sheet.has(usual):
        yield Finding(
            object=name_of(*usual),
            need=Need.PROTECTION.value,
            state=State.LACKS,
            remark=f"the drive has no such object; instead: {name_of(*other)}, by 605Ah = 1",
        )


def _cyclic(sheet: DataSheet) -> Iterator[Finding]:
    for index in CYCLIC:
        has = sheet.has((index, 0))
        state = State.HAS if has else State.LACKS
        yield Finding(object=name_of(index), need=Need.REQUIRED.value, state=state)


def _encoders(node: NodeConfig) -> Iterator[Finding]:
    """Yield what is not known of a joint with one encoder."""
    if node.link is None:
        known = node.torque_object
        remark = (
            "not known are the torque of the spring and the position of the link; controllers that "
            "need them are refused"
            if known is None
            else f"the spring's torque is the drive's own ({known}), inertia and friction in it"
        )
        optional = Need.OPTIONAL.value
        yield Finding(object="second position", need=optional, state=State.LACKS, remark=remark)


def _reads(sheet: DataSheet) -> Iterator[Finding]:
    for key, purpose in READ.items():
        need = Need.REQUIRED if key in NEEDED_READS else Need.OPTIONAL
        has = sheet.has(key)
        yield Finding(
            object=name_of(*key),
            need=need.value,
            state=State.HAS if has else State.LACKS,
            remark="" if has else f"not known is {purpose}",
        )


def unfit(sheet: DataSheet) -> tuple[str, ...]:
    """Return why a device cannot lead a leg, whatever a bus file says, each with the way out."""
    device = sheet.default((0x1000, 0), 0)
    if device is not None and device & 0xFFFF != PROFILE_402:
        return (
            f"1000h:00 is {device:08X}h: it is no CiA 402 drive, whose type ends with 0192h; "
            "another drive",
        )
    lacking = [(index, 0) for index in CYCLIC if not sheet.has((index, 0))]
    if len(lacking) == len(CYCLIC):
        names = ", ".join(f"{index:04X}h" for index in CYCLIC)
        return (f"{names} are missing: it is no CiA 402 drive; another data sheet, or drive",)
    modes = sheet.default((0x6502, 0), 0)
    told = [
        f"{name_of(*key)} is missing; no drive runs without it: another drive, or a complete data "
        "sheet"
        for key in (*lacking, *(key for key in NEEDED_READS if not sheet.has(key)))
    ]
    told += [
        f"{name_of(*key)} cannot be read; no drive runs without it: {WRONG}"
        for key in (*((index, 0) for index in SHOWN), *NEEDED_READS)
        if sheet.has(key) and sheet.objects[key].access is Access.WO
    ]
    if modes is not None and not modes & CSP_BIT:
        told.insert(
            0,
            f"6502h:00 is {modes:#x}: it knows no cyclic synchronous position mode; another drive",
        )
    return tuple(told)


def _problems(
    sheet: DataSheet, node: NodeConfig, outcomes: Iterable[ObjectOutcome]
) -> Iterator[str]:
    """Yield reasons for which the drive cannot be used, each with its object and the way out."""
    yield from unfit(sheet)
    for pdos, commands in ((node.rpdos, True), (node.tpdos, False)):
        for pdo in pdos:
            yield from _pdo_problems(sheet, pdo, commands=commands)
    if node.temperature_object is not None:
        yield from _object_problems(sheet, node.temperature_object)
    for entry in outcomes:
        if not entry.passes:
            yield f"{entry.name}: {entry.why}; {entry.demand}"


def _pdo_problems(sheet: DataSheet, pdo: PdoConfig, *, commands: bool) -> Iterator[str]:
    numbers = sheet.pdos(commands=commands)
    words = "RPDO" if commands else "TPDO"
    if pdo.number not in numbers:
        there = ", ".join(map(str, numbers)) or "none"
        yield f"it has no {words}{pdo.number}; it has {there}: give one of these in the bus file"
    for entry in pdo.objects:
        yield from _object_problems(sheet, entry)
        known = sheet.objects.get(entry.key)
        fixed = sheet.mapped(pdo.number, commands=commands)
        if known is None or known.mappable or entry.word in fixed:
            continue
        yield f"{name_of(*entry.key)} cannot be mapped; map another object in the bus file"
    if commands:
        for entry in pdo.objects:
            known = sheet.objects.get(entry.key)
            if known is not None and known.access in (Access.RO, Access.CONST):
                yield (
                    f"{name_of(*entry.key)} is read-only; a command frame cannot carry it: {WRONG}"
                )


def _object_problems(sheet: DataSheet, entry: Mapped) -> Iterator[str]:
    known = sheet.objects.get(entry.key)
    if known is None:
        # Objects of every cycle that are missing are told for all drives alike.
        if entry.key not in [(index, 0) for index in CYCLIC] and entry.index not in DUMMIES:
            yield f"{name_of(*entry.key)} is missing; name another object in the bus file"
    elif known.kind is entry.kind or (entry.index in CYCLIC and _as_long(known.kind, entry)):
        return
    elif entry in (CONTROLWORD, STATUSWORD):
        kind = short_name(known.kind)
        yield f"{name_of(*entry.key)} is of type {kind}, not u16; {WRONG}"
    elif entry.index in CYCLIC and known.kind not in FORMATS:
        kind = short_name(known.kind)
        yield f"{name_of(*entry.key)} is of type {kind}, no whole number; {WRONG}"
    else:
        yield (
            f"{name_of(*entry.key)} is of type {short_name(known.kind)}, the bus file says "
            f'{short_name(entry.kind)}: write "{entry.index:04X}:{entry.sub:02X} '
            f'{short_name(known.kind)}"'
        )


def _as_long(kind: DataType, entry: Mapped) -> bool:
    """Whether a type is a whole number as long as an entry, and so the same bits on the wire."""
    return kind in FORMATS and 8 * (size_of(kind) or 0) == entry.bits
