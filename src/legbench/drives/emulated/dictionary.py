"""Objects of an emulated drive: those of the profile, or those that a data sheet gives it."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.objects import LINK_SHORT, OBJECTS, TEMPERATURE, Key, ObjectEntry
from legbench.drives.protocol.sdo import Abort
from legbench.drives.setup.config import NodeConfig
from legbench.drives.sheet.data_sheet import DataSheet

USUAL_LINKS: tuple[Key, ...] = ((0x60E4, 1), (LINK_SHORT, 0))
"""Objects in which the usual drive shows the position of its link, in 32 and in 16 bits."""
RELATIVE = {(base + number, 1) for base in (0x1400, 0x1800) for number in range(4)}
"""Objects of the usual drive whose default is added to its node id, besides that of EMCY."""
EMCY = (0x1014, 0)
OWN_WAY: Mapping[Key, int] = {(0x60C2, 1): 1, (0x60C2, 2): -3}
"""What a drive works with that lacks the object: it interpolates over the usual cycle of 1 ms."""
MODE_OF_ITS_OWN: Mapping[Key, int] = {(0x6060, 0): 8, (0x6061, 0): 8}
"""Mode of a drive whose mode cannot be chosen (6060h): cyclic synchronous position."""


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
        low, high = self.limits.get(key, (value, value))
        if low <= value <= high:
            return None
        return Abort.TOO_LOW if value < low else Abort.TOO_HIGH


def dictionary_of(node: NodeConfig, sheet: DataSheet | None = None) -> Dictionary:
    """Return the objects of one node: those of a data sheet, else those of the usual drive."""
    own = dict(_identity(node))
    if sheet is None:
        own |= {key: _number(OBJECTS[key]) + node.node_id for key in (*RELATIVE, EMCY)}
        return Dictionary(
            entries=tuple(_with(OBJECTS.values(), own)), relative=frozenset((*RELATIVE, EMCY))
        )
    for key in sheet.relative:
        entry = sheet.objects[key]
        own.setdefault(key, _number(entry) + node.node_id)
    entries = tuple(_with(sheet.objects.values(), own))
    shown = {entry.key for entry in entries if isinstance(entry.default, int)}
    hidden = {key: _number(entry) for key, entry in OBJECTS.items() if key not in shown}
    for other in (OWN_WAY, {} if (0x6060, 0) in shown else MODE_OF_ITS_OWN):
        hidden |= {key: value for key, value in other.items() if key not in shown}
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
        number = entry.kind not in (DataType.VISIBLE_STRING, DataType.OCTET_STRING)
        yield replace(entry, default=own[entry.key]) if number and entry.key in own else entry


def _number(entry: ObjectEntry) -> int:
    return entry.default if isinstance(entry.default, int) else 0
