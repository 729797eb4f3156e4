"""The object dictionary inside a drive: values, and access to them by SDO."""

from collections.abc import Callable, Container, Iterable, Mapping
from typing import final

from legbench.drives.errors import CodecError
from legbench.drives.protocol.datatypes import (
    FORMATS,
    DataType,
    Value,
    pack,
    range_of,
    size_of,
    unpack,
)
from legbench.drives.protocol.objects import Access, Key, ObjectEntry
from legbench.drives.protocol.sdo import Abort, abort_error

Check = Callable[[Key, int], Abort | None]
"""Abort code that refuses a value for an object; none if it is accepted."""
Written = Callable[[Key], None]


@final
class ObjectStore:
    """Values by index and sub-index.

    Attributes:
        values: the numbers, for the drive's own use.
    """

    def __init__(
        self,
        entries: Iterable[ObjectEntry],
        check: Check,
        written: Written,
        hidden: Mapping[Key, int] | None = None,
        *,
        lacking: Abort = Abort.NO_OBJECT,
    ) -> None:
        """Hold the power-on values.

        Args:
            entries: objects that there are.
            check: asked before a value is taken.
            written: told of every value that was taken.
            hidden: numbers for the drive's own use that no SDO reaches.
            lacking: code that refuses what is not there; that of the standard by default.
        """
        self._hidden = hidden or {}
        self._entries = {entry.key: entry for entry in entries}
        self._lacking = lacking
        self._indices = {index for index, _ in self._entries}
        self._check, self._written = check, written
        self.values: dict[Key, int] = {}
        self._texts: dict[Key, Value] = {}
        self.load_defaults()

    def load_defaults(self, indices: Container[int] = range(0x10000)) -> None:
        """Set every object among some indices, by default all, to its power-on default."""
        self.values |= {key: value for key, value in self._hidden.items() if key[0] in indices}
        for key, entry in self._entries.items():
            if entry.index not in indices:
                continue
            if isinstance(entry.default, int):
                self.values[key] = entry.default
            else:
                self._texts[key] = entry.default

    @property
    def keys(self) -> tuple[Key, ...]:
        """Index and sub-index of every object that an SDO reaches, in order."""
        return tuple(self._entries)

    def entry(self, key: Key) -> ObjectEntry | None:
        """Description of an object, if there is one."""
        return self._entries.get(key)

    def read(self, index: int, sub: int) -> bytes:
        """Bytes of an object, as an SDO server reads them; raises SdoAbortError."""
        entry = self._known(index, sub)
        if entry.access is Access.WO:
            raise abort_error(Abort.WRITE_ONLY, index, sub)
        if entry.kind not in FORMATS:
            there = self._texts.get(entry.key)
            return pack(entry.kind, self.values[entry.key] if there is None else there)
        return pack(entry.kind, fit(entry.kind, self.values[entry.key]))

    def write(self, index: int, sub: int, data: bytes) -> None:
        """Take the bytes of an object, all or nothing; raises SdoAbortError."""
        entry = self._known(index, sub)
        if entry.access in (Access.RO, Access.CONST):
            raise abort_error(Abort.READ_ONLY, index, sub)
        size = size_of(entry.kind)
        if size is not None and len(data) != size:
            code = Abort.TOO_LONG if len(data) > size else Abort.TOO_SHORT
            raise abort_error(code, index, sub)
        try:
            value = unpack(entry.kind, data)
        except CodecError:
            raise abort_error(Abort.INVALID_VALUE, index, sub) from None
        if not isinstance(value, int):
            self._texts[entry.key] = value
            return
        self.put((index, sub), value)

    def put(self, key: Key, value: int) -> None:
        """Write an object that there is as the bus does, by SDO or PDO; raises SdoAbortError."""
        refusal = self._check(key, value)
        if refusal is not None:
            raise abort_error(refusal, *key)
        self.values[key] = value
        self._written(key)

    def show(self, key: Key, value: float) -> None:
        """Publish a measured value, rounded and saturated to what its object holds."""
        kind = self._entries[key].kind
        if kind is DataType.REAL32:
            self._texts[key] = float(value)
            return
        low, high = range_of(kind)
        self.values[key] = min(max(round(value), low), high)

    def _known(self, index: int, sub: int) -> ObjectEntry:
        entry = self._entries.get((index, sub))
        if entry is None:
            known = index in self._indices
            usual = known and self._lacking is Abort.NO_OBJECT
            raise abort_error(Abort.NO_SUB_INDEX if usual else self._lacking, index, sub)
        return entry


def fit(kind: DataType, value: int) -> int:
    """Return a number as an object of a type shows it, wrapped as its bits are."""
    low, high = range_of(kind)
    return value if low <= value <= high else (value - low) % (high - low + 1) + low
