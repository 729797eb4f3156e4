"""Data sheets of drives that nobody builds: the usual drive, changed as a test says."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.objects import OBJECTS, Key

HEAD = """[FileInfo]
FileName=stranger.eds
EDSVersion=4.0

[DeviceInfo]
VendorName=Fremdwerk
VendorNumber=0x00ABCDEF
ProductName=Fremd 7
ProductNumber=0x00000077
RevisionNumber=0x00010002
BaudRate_1000=1
"""
VENDOR_OBJECTS = {(0x2064, 0), (0x2070, 0)}


@dataclass(kw_only=True)
class Entry:
    """Lines of one object."""

    name: str
    kind: int
    access: str
    default: str | None
    mappable: bool = False
    limits: tuple[str, str] | None = None


@dataclass(kw_only=True)
class Sheet:
    """Data sheet of the usual drive, without the objects of its maker, with what is changed."""

    entries: dict[Key, Entry] = field(default_factory=dict)
    head: str = HEAD

    def without(self, *keys: int | Key) -> "Sheet":
        """Leave out whole objects, or sub-objects."""
        for key in keys:
            for known in list(self.entries):
                if known == key or known[0] == key:
                    del self.entries[known]
        return self

    def fixed(self, values: Mapping[Key, str], access: str = "const") -> "Sheet":
        """Let objects not be written."""
        for key, value in values.items():
            self.entries[key].access, self.entries[key].default = access, value
        return self

    def add(self, key: Key, kind: DataType | int, access: str = "ro", **more: Any) -> "Sheet":
        """Add an object."""
        usual = {"name": "thing", "default": "0", "mappable": access != "const"}
        # pyrefly: ignore[bad-argument-type]
        self.entries[key] = Entry(kind=int(kind), access=access, **(usual | more))
        return self

    def text(self, spell: Callable[[int], str] = lambda number: f"0x{number:X}") -> str:
        """The file, its numbers spelled as asked."""
        lines = [self.head]
        for index in sorted({index for index, _ in self.entries}):
            subs = {sub: one for (at, sub), one in sorted(self.entries.items()) if at == index}
            if set(subs) == {0}:
                lines += [f"[{index:04X}]", *self._lines(subs[0], spell), ""]
                continue
            lines += [
                f"[{index:04X}]",
                f"ParameterName=object {index:04X}",
                "ObjectType=0x9",
                f"SubNumber={len(subs)}",
                "",
            ]
            for sub, one in subs.items():
                lines += [f"[{index:04X}sub{sub:X}]", *self._lines(one, spell), ""]
        return "\n".join(lines)

    @staticmethod
    def _lines(one: Entry, spell: Callable[[int], str]) -> Iterable[str]:
        yield f"ParameterName={one.name}"
        yield "ObjectType=0x7"
        yield f"DataType={spell(one.kind)}"
        yield f"AccessType={one.access}"
        if one.default is not None:
            yield f"DefaultValue={one.default}"
        if one.limits is not None:
            yield f"LowLimit={one.limits[0]}"
            yield f"HighLimit={one.limits[1]}"
        yield f"PDOMapping={int(one.mappable)}"


def stranger() -> Sheet:
    """A complete drive of another maker, whose second encoder is 60E4h:01."""
    sheet = Sheet()
    for key, known in OBJECTS.items():
        if key in VENDOR_OBJECTS:
            continue
        default = str(known.default)
        if key == (0x1014, 0):
            default = "$NODEID+0x80"
        if key[1] == 1 and (0x1400 <= key[0] < 0x1404 or 0x1800 <= key[0] < 0x1804):
            default = f"$NODEID+0x{known.default:X}"
        sheet.entries[key] = Entry(
            name=known.name,
            kind=int(known.kind),
            access=known.access.value,
            default=default,
            mappable=known.mappable,
        )
    return sheet


def fremd_7() -> Sheet:
    """The incomplete drive of the documents, whose second encoder is an object of its maker."""
    sheet = stranger().without(0x1006, 0x1016, (0x1018, 4), 0x605E, 0x60E4)
    sheet.fixed({(0x1005, 0): "0x80", (0x1017, 0): "30"})
    return sheet.add((0x2100, 0), DataType.INTEGER32, name="second encoder value")
