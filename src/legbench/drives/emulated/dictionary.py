"""Objects of an emulated drive: those of the profile, or those that a data sheet gives it."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from legbench.drives.protocol.cia402 import Mode
from legbench.drives.protocol.datatypes import FORMATS, DataType, pack, size_of
from legbench.drives.protocol.objects import LINK_SHORT, OBJECTS, TEMPERATURE, Key, ObjectEntry
from legbench.drives.protocol.sdo import Abort
from legbench.drives.setup.config import NodeConfig
from legbench.drives.setup.configuration import interpolation_time
from legbench.drives.setup.outcome import CYCLE, CYCLE_INDEX
from legbench.drives.sheet.data_sheet import DataSheet

USUAL_LINKS: tuple[Key, ...] = ((0x60E4, 1), (LINK_SHORT, 0))
"""Objects in which the usual drive shows the position of its link, in 32 and in 16 bits."""
RELATIVE = {(base + number, 1) for base in (0x1400, 0x1800) for number in range(4)}
"""Objects of the usual drive whose default is added to its node id, besides that of EMCY."""
EMCY = (0x1014, 0)
MAX_SPEED = (0x6080, 0)
"""Max motor speed, whose unit is the maker's own: a data sheet's default would stop the motor."""
MODE, MODE_DISPLAY, CYCLIC = (0x6060, 0), (0x6061, 0), int(Mode.CYCLIC_SYNCHRONOUS_POSITION)


@dataclass(frozen=True, slots=True, kw_only=True)
class Dictionary:
    """Object dictionary of one emulated drive."""

    entries: tuple[ObjectEntry, ...]
    """Objects that the bus sees, with the values that this very drive has at power-on."""
    hidden: Mapping[Key, int] = field(default_factory=dict)
    """Values that the drive works with and the bus does not see."""
    limits: Mapping[Key, tuple[int, int]] = field(default_factory=dict)
    """Lowest and highest value that an object takes."""
    links: tuple[Key, ...] = USUAL_LINKS
    """Objects that show the position of the link."""
    temperature: Key | None = (TEMPERATURE, 0)
    """Object that shows the temperature of the power stage, if any does."""
    relative: frozenset[Key] = frozenset()
    """Objects whose value at power-on moves with the node id."""

    def refusal(self, key: Key, value: int) -> Abort | None:
        """Abort code of a value beyond the limits of its object; none if it lies within."""
        limits = self.limits.get(key)
        if limits is None:
            return None
        low, high = limits
        if low <= value <= high:
            return None
        return Abort.TOO_LOW if value < low else Abort.TOO_HIGH


def dictionary_of(
    node: NodeConfig,
    sheet: DataSheet | None = None,
    period_us: int = 1000,
    wanted: Mapping[Key, int] = MappingProxyType({}),
) -> Dictionary:
    """Return the objects of one node: those of a data sheet, else those of the usual drive.

    A drive that lacks 60C2h interpolates over the period of SYNC [us], and one whose mode cannot be
    chosen (6060h) has cyclic synchronous position mode alone. An object that is fixed to what its
    data sheet does not tell holds what the bus file wants of it.
    """
    own = dict(_identity(node))
    if sheet is None:
        own |= {key: _number(OBJECTS[key]) + node.node_id for key in (*RELATIVE, EMCY)}
        return Dictionary(
            entries=tuple(_with(OBJECTS.values(), own)), relative=frozenset((*RELATIVE, EMCY))
        )
    if not sheet.has(MODE):
        own[MODE_DISPLAY] = CYCLIC
    own |= {
        key: value
        for key, value in wanted.items()
        if sheet.has(key) and not sheet.writable(key) and key not in sheet.given
    }
    for key in sheet.relative:
        entry = sheet.objects[key]
        own.setdefault(key, _number(entry) + node.node_id)
    written = {parameter.key for parameter in node.parameters}
    entries = tuple(
        _shown_only(entry) if entry.key == MAX_SPEED and MAX_SPEED not in written else entry
        for entry in _with(sheet.objects.values(), own)
    )
    shown = {entry.key for entry in entries if isinstance(entry.default, int)}
    hidden = {key: _number(entry) for key, entry in OBJECTS.items() if key not in shown}
    value, exponent = interpolation_time(period_us)
    own_way = {CYCLE: value, CYCLE_INDEX: exponent, MODE: CYCLIC, MODE_DISPLAY: CYCLIC}
    hidden |= {key: own_way[key] for key in own_way if key not in shown}
    warmth = node.temperature_object
    return Dictionary(
        entries=entries,
        hidden=hidden,
        limits=sheet.limits,
        links=(node.link_object.key,),
        relative=frozenset(sheet.relative),
        temperature=None if warmth is None else warmth.key,
    )


def _identity(node: NodeConfig) -> Iterator[tuple[Key, int]]:
    """Yield the numbers of the identity (1018h) that the bus file gives."""
    one = node.identity
    for sub, value in enumerate((one.vendor, one.product, one.revision, one.serial), start=1):
        if value is not None:
            yield (0x1018, sub), value


def _with(entries: Iterable[ObjectEntry], own: Mapping[Key, int]) -> Iterator[ObjectEntry]:
    for entry in entries:
        number = entry.kind in FORMATS and entry.key in own
        yield replace(entry, default=own[entry.key]) if number else entry


def _shown_only(entry: ObjectEntry) -> ObjectEntry:
    """Return an object that holds its value for the bus, and acts on nothing."""
    if size_of(entry.kind) is None or isinstance(entry.default, bytes):
        return entry
    return replace(entry, kind=DataType.OCTET_STRING, default=pack(entry.kind, entry.default))


def _number(entry: ObjectEntry) -> int:
    return entry.default if isinstance(entry.default, int) else 0
