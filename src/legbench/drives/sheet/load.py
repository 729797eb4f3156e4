"""Reading an electronic data sheet (EDS) or device configuration file (DCF) into a `DataSheet`."""

import io
import struct
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from legbench.drives.protocol.datatypes import FORMATS, DataType, Value, range_of, size_of
from legbench.drives.protocol.objects import Access, Key, ObjectEntry
from legbench.drives.setup.eds import BAUD_RATES
from legbench.drives.sheet.clean import clean_text
from legbench.drives.sheet.data_sheet import DataSheet, profile_default
from legbench.drives.sheet.plausible import (
    BASES,
    are_limits,
    in_type,
    mapped_keys,
    meant_type,
    without_node,
)
from legbench.drives.sheet.text import LARGEST_EDS, Sections, decode, number, split, words
from legbench.errors import ConfigError
from legbench.reading import UnreadableError, read_file

if TYPE_CHECKING:
    from legbench.drives.sheet._canopen import ODVariable

BYTES = {0x0C: 6, 0x0D: 6, 0x10: 3, 0x11: 8, 0x12: 5, 0x13: 6, 0x14: 7}
BYTES |= {0x16: 3, 0x18: 5, 0x19: 6, 0x1A: 7}
"""Lengths of the basic types that are no whole numbers of 1, 2, 4 or 8 bytes [bytes]."""
REAL64 = 0x11
KINDS = frozenset(DataType) - BYTES.keys()
MOST_NAMED = 4
"""Number of objects that a remark names."""
NEVER_ZERO = ((0x1000, 0), (0x6502, 0))
"""Device type and supported modes, which are not 0 on any drive: there 0 says nothing."""
ACCESS = {"ro": Access.RO, "wo": Access.WO, "const": Access.CONST}


def load_sheet(path: Path) -> DataSheet:
    """Read an EDS or DCF.

    Raises:
        ConfigError: it is missing, is no data sheet, or describes nothing; the message starts with
            the path.
        MissingExtraError: canopen is not installed.
    """
    try:
        return sheet_of(read_file(path, LARGEST_EDS), path.name)
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file; the maker of a drive hands out its EDS") from None
    except UnreadableError as error:
        raise ConfigError(f"{path}: {error}") from None


@lru_cache(maxsize=4)
def sheet_of(content: bytes, name: str) -> DataSheet:
    """Return the data sheet of a file's content; raises UnreadableError, MissingExtraError.

    A proposed bus file is checked, and may be emulated, on the sheet that it was proposed from.
    """
    sections = split(decode(content))
    variables = list(_variables(clean_text(sections)))
    if not variables:
        raise UnreadableError("describes no object; is it a data sheet?")
    node_id = number(_commissioning(sections).get("nodeid"))
    found = _Found()
    mapped = mapped_keys(((one.index, one.subindex), _typed(one)[1]) for one in variables)
    for variable in variables:
        found.add(variable, node_id, mapped)
    sections.remarks += [_remark(what, keys) for what, keys in sorted(found.guessed.items())]
    return _described(sections, name, found)


@dataclass(slots=True)
class _Found:
    """Objects as they are found, one after the other."""

    objects: dict[Key, ObjectEntry] = field(default_factory=dict)
    given: set[Key] = field(default_factory=set)
    relative: set[Key] = field(default_factory=set)
    limits: dict[Key, tuple[int, int]] = field(default_factory=dict)
    guessed: dict[str, list[Key]] = field(default_factory=lambda: defaultdict(list))

    def add(self, variable: "ODVariable", node_id: int | None, mapped: Collection[Key]) -> None:
        """Add an object, of a configured device with a node id; some are mapped at power-on."""
        key = (variable.index, variable.subindex)
        kind, default = _typed(variable)
        if kind != variable.data_type and kind in FORMATS:
            self.guessed["objects have the profile's type instead of their own"].append(key)
        if key in NEVER_ZERO and default == 0:
            default = None
        if variable.relative:
            self.relative.add(key)
        else:
            default = self._less_the_node(key, default, node_id)
        self._limit(key, kind, variable, default)
        self.objects[key] = ObjectEntry(
            *key,
            variable.name,
            kind,
            ACCESS.get(variable.access_type, Access.RW),
            _profile(key, kind, variable.data_type or 0) if default is None else default,
            variable.pdo_mappable or key in mapped,
        )
        if default is not None:
            self.given.add(key)

    def _less_the_node(self, key: Key, default: Value | None, node_id: int | None) -> Value | None:
        """Default of an identifier that is told without $NODEID, less the node id."""
        if key not in BASES:
            return default
        if default is None:
            self.relative.add(key)
            return None
        own = without_node(key, default, node_id) if isinstance(default, int) else None
        if own is None:
            return default
        self.relative.add(key)
        self.guessed["identifiers count from the node id, though they do not say so"].append(key)
        return own

    def _limit(
        self, key: Key, kind: DataType, variable: "ODVariable", default: Value | None
    ) -> None:
        low, high = variable.min, variable.max
        if low is None or high is None or low >= high:
            return
        if are_limits(key, kind, (low, high), default if isinstance(default, int) else None):
            self.limits[key] = low, high
        else:
            self.guessed["objects have limits that cannot be meant, which were left out"].append(
                key
            )


def _remark(what: str, keys: Sequence[Key]) -> str:
    """Return a line that says of how many objects something was guessed, and names the first."""
    names = ", ".join(f"{index:04X}h:{sub:02X}" for index, sub in keys[:MOST_NAMED])
    more = f" and {len(keys) - MOST_NAMED} more" if len(keys) > MOST_NAMED else ""
    return f"{len(keys)} {what}: {names}{more}"


def _commissioning(sections: Sections) -> dict[str, str]:
    # The first spelling is that of CiA 306.
    return sections.others.get("devicecomissioning") or sections.others.get(
        "devicecommissioning", {}
    )


def _described(sections: Sections, name: str, found: _Found) -> DataSheet:
    device = sections.others.get("deviceinfo", {})
    node_id = number(_commissioning(sections).get("nodeid"))
    objects, given = found.objects, frozenset(found.given)
    return DataSheet(
        name=name,
        objects=objects,
        given=given,
        relative=frozenset(found.relative),
        limits=found.limits,
        vendor=_identity(device, "vendornumber", objects, given, 1),
        product=_identity(device, "productnumber", objects, given, 2),
        revision=_identity(device, "revisionnumber", objects, given, 3),
        vendor_name=words(device, "vendorname"),
        product_name=words(device, "productname"),
        bitrates=frozenset(
            1000 * rate for rate in BAUD_RATES if number(device.get(f"baudrate_{rate}"))
        ),
        node_id=node_id if node_id is not None and 1 <= node_id <= 127 else None,
        remarks=tuple(sections.remarks),
    )


def _identity(
    device: dict[str, str],
    key: str,
    objects: dict[Key, ObjectEntry],
    given: frozenset[Key],
    sub: int,
) -> int | None:
    """Return a number of the identity: that of 1018h if it tells one, else of the file's head."""
    entry = objects.get((0x1018, sub))
    if (
        entry is not None
        and entry.key in given
        and entry.default
        and isinstance(entry.default, int)
    ):
        return entry.default
    value = number(device.get(key))
    return value if value is not None and 0 <= value < 1 << 32 else None


def _variables(text: str) -> "Iterator[ODVariable]":
    """Yield every variable of a clean text in order, as canopen reads it."""
    from legbench.drives.sheet._canopen import ODVariable, import_od  # noqa: PLC0415

    file = io.StringIO(text)
    file.name = "sheet.eds"
    # Defaults that are relative to the node id are told for node 0, and marked.
    for item in import_od(file, node_id=0).values():
        if isinstance(item, ODVariable):
            yield item
        else:
            yield from item.values()


def _typed(variable: "ODVariable") -> tuple[DataType, Value | None]:
    """Type of an object and its default, none if it has none that fits.

    A type that is no whole number and no text is taken for bytes of its length.
    """
    default = variable.default
    if variable.data_type not in KINDS:
        return DataType.OCTET_STRING, _bytes(variable.data_type or 0, default)
    kind = DataType(variable.data_type)
    if size_of(kind) is None:
        if kind is DataType.VISIBLE_STRING:
            return kind, None if default is None else str(default).encode(
                "ascii", "ignore"
            ).decode()
        return kind, default if isinstance(default, bytes) else None
    if kind is DataType.REAL32:
        return kind, float(default) if isinstance(default, int | float) else None
    number_of = default if isinstance(default, int) else None
    kind = meant_type((variable.index, variable.subindex), kind, number_of)
    return kind, None if number_of is None else in_type(kind, number_of)


def _bytes(number_of: int, default: object) -> bytes | None:
    """Bytes of a default of double precision; no other type of `BYTES` has a default here."""
    if number_of != REAL64 or not isinstance(default, int | float):
        return None
    return struct.pack("<d", default)


def _profile(key: Key, kind: DataType, number_of: int) -> Value:
    """Return what an object holds whose data sheet tells no default."""
    if kind is DataType.REAL32:
        return 0.0
    known = profile_default(key, kind)
    if known is not None and kind in FORMATS:
        low, high = range_of(kind)
        return known if low <= known <= high else 0
    return "" if kind is DataType.VISIBLE_STRING else bytes(BYTES.get(number_of, 0))
