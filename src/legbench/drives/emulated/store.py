"""The object dictionary inside a drive: values, and access to them by SDO."""

from collections.abc import Callable, Container, Iterable
from typing import final

from legbench.drives.errors import CodecError
from legbench.drives.protocol.datatypes import Value, pack, range_of, size_of, unpack
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

    def __init__(self, entries: Iterable[ObjectEntry], check: Check, written: Written) -> None:
        self._entries = {entry.key: entry for entry in entries}
        self._indices = {index for index, _ in self._entries}
        self._check, self._written = check, written
        self.values: dict[Key, int] = {}
        self._texts: dict[Key, Value] = {}
        self.load_defaults()

    def load_defaults(self, indices: Container[int] = range(0x10000)) -> None:
        """Set every object among some indices, by default all, to its power-on default."""
        for key, entry in self._entries.items():
            if entry.index not in indices:
                continue
            if isinstance(entry.default, int):
                self.values[key] = entry.default
            else:
                self._texts[key] = entry.default

    def entry(self, key: Key) -> ObjectEntry | None:
        """Description of an object, if there is one."""
        return self._entries.get(key)

    def read(self, index: int, sub: int) -> bytes:
        """Bytes of an object, as an SDO server reads them; raises SdoAbortError."""
        entry = self._known(index, sub)
        if entry.access is Access.WO:
            raise abort_error(Abort.WRITE_ONLY, index, sub)
        key = entry.key
        return pack(entry.kind, self.values[key] if key in self.values else self._texts[key])

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
        self.put(entry, value)

    def put(self, entry: ObjectEntry, value: int) -> None:
        """Write as the bus does, by SDO or PDO; raises SdoAbortError."""
        refusal = self._check(entry.key, value)
        if refusal is not None:
            raise abort_error(refusal, entry.index, entry.sub)
        self.values[entry.key] = value
        self._written(entry.key)

    def show(self, key: Key, value: int) -> None:
        """Publish an actual value, saturated to what its object holds."""
        low, high = range_of(self._entries[key].kind)
        self.values[key] = min(max(value, low), high)

    def _known(self, index: int, sub: int) -> ObjectEntry:
        entry = self._entries.get((index, sub))
        if entry is None:
            known = index in self._indices
            raise abort_error(Abort.NO_SUB_INDEX if known else Abort.NO_OBJECT, index, sub)
        return entry
