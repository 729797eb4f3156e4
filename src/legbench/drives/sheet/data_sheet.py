"""A drive as its electronic data sheet describes it: objects, limits, maker; a frozen value."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import COB_INVALID
from legbench.drives.protocol.objects import OBJECTS, Access, Key, ObjectEntry
from legbench.drives.setup.needs import RPDOS, TPDOS

WRITABLE = (Access.RW, Access.WO)


@dataclass(frozen=True, slots=True, kw_only=True)
class DataSheet:
    """Object dictionary of a device, with what its maker says of the device itself."""

    name: str
    """Name of the file."""
    objects: Mapping[Key, ObjectEntry]
    """Every object and sub-object; one without a default has that of the profile, or 0."""
    given: frozenset[Key]
    """Objects whose default the data sheet tells."""
    relative: frozenset[Key]
    """Objects whose default is added to the node id."""
    limits: Mapping[Key, tuple[int, int]]
    """Lowest and highest value of the objects that have both."""
    vendor: int | None = None
    product: int | None = None
    revision: int | None = None
    vendor_name: str = ""
    product_name: str = ""
    bitrates: frozenset[int] = frozenset()
    """Bitrates that the device knows; none where the data sheet tells none [bit/s]."""
    node_id: int | None = None
    """Node id of a configured device (DCF)."""
    remarks: tuple[str, ...] = ()
    """What was left out or guessed while the file was read, a line each."""

    def has(self, key: Key) -> bool:
        """Whether the device has an object."""
        return key in self.objects

    def writable(self, key: Key) -> bool:
        """Whether an object can be written."""
        entry = self.objects.get(key)
        return entry is not None and entry.access in WRITABLE

    def default(self, key: Key, node_id: int) -> int | None:
        """Number that an object holds at power-on, as far as the data sheet tells."""
        entry = self.objects.get(key)
        if entry is None or key not in self.given or not isinstance(entry.default, int):
            return None
        return entry.default + node_id if key in self.relative else entry.default

    def pdos(self, *, commands: bool) -> tuple[int, ...]:
        """Numbers of the RPDOs (commands) or TPDOs that the device has."""
        indices = RPDOS if commands else TPDOS
        return tuple(
            place
            for place, index in enumerate(indices, start=1)
            if (index, 1) in self.objects and (index + 0x200, 0) in self.objects
        )

    def mapped(self, number: int, *, commands: bool) -> tuple[int, ...]:
        """Mapping entries that a PDO has at power-on."""
        mapping = (0x1600 if commands else 0x1A00) + number - 1
        count = self.default((mapping, 0), 0) or 0
        words = [self.default((mapping, sub), 0) for sub in range(1, min(count, 64) + 1)]
        return tuple(word for word in words if word)

    def room(self, number: int, *, commands: bool) -> int:
        """Number of entries that a PDO can be mapped anew with; 0 where its mapping is fixed.

        It has to be switched off for that, by its COB-ID (CiA 301, 7.5.2.36).
        """
        mapping = (0x1600 if commands else 0x1A00) + number - 1
        if not (self.writable((mapping - 0x200, 1)) and self.writable((mapping, 0))):
            return 0
        entries = 0
        while self.writable((mapping, entries + 1)):
            entries += 1
        return min(entries, self.limits.get((mapping, 0), (0, entries))[1])

    def stays_on(self, comm: int) -> bool:
        """Whether a PDO is on at power-on, by its communication object, and cannot be let off."""
        return (
            not self.writable((comm, 1))
            and not (self.default((comm, 1), 0) or COB_INVALID) & COB_INVALID
        )


def profile_default(key: Key, kind: DataType) -> int | None:
    """Default that the profile has for an object that a data sheet gives none; none for texts."""
    known = OBJECTS.get(key)
    if known is not None and isinstance(known.default, int):
        return known.default & ~COB_INVALID if key[1] == 1 and key[0] < 0x1A00 else known.default
    return None if kind in (DataType.VISIBLE_STRING, DataType.OCTET_STRING) else 0


def positions(sheet: DataSheet) -> Iterator[ObjectEntry]:
    """Yield the objects that can be mapped and show a number of 16 or 32 bits."""
    kinds = (
        DataType.INTEGER16,
        DataType.INTEGER32,
        DataType.UNSIGNED16,
        DataType.UNSIGNED32,
    )
    for entry in sheet.objects.values():
        if entry.mappable and entry.access is not Access.WO and entry.kind in kinds:
            yield entry
