"""Data sheets in every spelling: the same drive comes out, or one line says why none does."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from eds_texts import stranger

from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.objects import OBJECTS, Access
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.eds import dcf_text, eds_text
from legbench.drives.sheet.data_sheet import DataSheet
from legbench.drives.sheet.load import load_sheet, sheet_of
from legbench.drives.sheet.text import MOST_SECTIONS, node_number, number
from legbench.errors import ConfigError, MissingExtraError
from legbench.reading import UnreadableError

ROOT = Path(__file__).parents[2]
TEXT = stranger().text()
PLAIN = sheet_of(TEXT.encode(), "it.eds")


def lowered(text: str) -> str:
    """Section names and keys in lower case, access types in capitals."""
    lines = []
    for line in text.splitlines():
        key, mark, value = line.partition("=")
        value = value.upper() if key == "AccessType" else value
        lines.append(key.lower() + mark + value)
    return "\n".join(lines)


SPELLINGS: dict[str, Callable[[str], bytes]] = {
    "CRLF": lambda text: text.replace("\n", "\r\n").encode(),
    "CR alone": lambda text: text.replace("\n", "\r").encode(),
    "UTF-8 with a mark": lambda text: text.encode("utf-8-sig"),
    "UTF-16": lambda text: text.encode("utf-16"),
    "UTF-16 without a mark": lambda text: text.encode("utf-16-le"),
    "UTF-16, high bytes first": lambda text: text.encode("utf-16-be"),
    "Latin-1": lambda text: text.replace("Fremdwerk", "Fremdw\xe4rme").encode("latin-1"),
    "cases turned round": lambda text: lowered(text).encode(),
    "Sub": lambda text: text.replace("sub", "Sub").encode(),
    "capital X": lambda text: text.replace("=0x", "=0X").encode(),
    "h behind": lambda text: text.replace("DataType=0x", "DataType=0").encode(),
    "spaces": lambda text: re.sub(
        r"(?m)^\[(.*)\]$", r"  [ \1 ] ", text.replace("=", " =  ")
    ).encode(),
    "comments": lambda text: text.replace("\n[", "\n; [9999]\n\n[").encode(),
    "no head": lambda text: text[text.index("[1000]") :].encode(),
    "$NODEID behind": lambda text: text.replace(
        "$NODEID+0x80000200", "0x80000200 + $nodeid"
    ).encode(),
    "sections turned round": lambda text: (
        "\n[".join(reversed(("\n" + text).split("\n[")[1:])).join(("[", "\n")).encode()
    ),
    "comments behind": lambda text: re.sub(
        r"(?m)^((DataType|AccessType|DefaultValue)=[r0-9$].*)$", r"\1 // that # it ; is", text
    ).encode(),
    "access in words": lambda text: (
        text.replace("Type=ro", "Type=Read Only")
        .replace("Type=rw", "Type=R/W")
        .replace("Type=const", "Type=Constant")
        .encode()
    ),
    "parents left out": lambda text: text.replace("ObjectType=0x9\n", "").encode(),
}


@pytest.mark.parametrize("name", list(SPELLINGS))
def test_every_spelling_is_the_same_drive(name: str) -> None:
    sheet = sheet_of(SPELLINGS[name](TEXT), "it.eds")
    assert dict(sheet.objects) == dict(PLAIN.objects)
    assert (sheet.given, sheet.relative, sheet.limits) == (
        PLAIN.given,
        PLAIN.relative,
        PLAIN.limits,
    )
    if name == "Latin-1":
        assert sheet.vendor_name == "Fremdw\xe4rme"
    if name != "no head":
        assert (sheet.vendor, sheet.product) == (0xABCDEF, 0x77)


def test_our_own_sheet_comes_back_as_the_table_that_it_was_made_from() -> None:
    sheet = sheet_of(eds_text().encode(), "own.eds")
    assert (
        dict(sheet.objects) == {key: known for key, known in OBJECTS.items()}
        or _differing(sheet) == set()
    )
    assert sheet.default((0x1014, 0), 5) == 0x85
    assert sheet.default((0x1402, 1), 5) == 0x80000405
    bus = load_bus(ROOT / "hardware" / "leg.toml")
    configured = sheet_of(dcf_text(bus, bus.nodes[1]).encode(), "own.dcf")
    assert configured.node_id == 2
    assert configured.default((0x6085, 0), 2) == 1_250_000_000


def _differing(sheet: DataSheet) -> set[tuple[int, int]]:
    """Objects that differ in more than a default which is relative to the node id."""
    return {
        key
        for key, known in OBJECTS.items()
        for found in [sheet.objects[key]]
        if (found.name, found.kind, found.access, found.mappable)
        != (known.name, known.kind, known.access, known.mappable)
        or (found.default != known.default and key not in sheet.relative)
    }


def test_compact_arrays_are_written_out() -> None:
    text = """[1003]
ParameterName=history
ObjectType=0x8
DataType=0x0007
AccessType=ro
CompactSubObj=3
[1003Name]
NrOfEntries=1
2=the second
[1003Value]
NrOfEntries=1
3=0x30
[2000]
ParameterName=other
DataType=0x3
AccessType=RWR
DefaultValue=0xFFFE
PDOMapping=1
"""
    sheet = sheet_of(text.encode(), "it.eds")
    assert sorted(sheet.objects) == [
        (0x1003, 0),
        (0x1003, 1),
        (0x1003, 2),
        (0x1003, 3),
        (0x2000, 0),
    ]
    assert sheet.objects[0x1003, 0].default == 3
    assert sheet.objects[0x1003, 2].name == "the second"
    assert sheet.default((0x1003, 3), 0) == 0x30
    assert sheet.objects[0x2000, 0].default == -2
    assert sheet.objects[0x2000, 0].access is Access.RW


def test_types_beyond_whole_numbers_keep_their_length() -> None:
    sheet = stranger()
    sheet.add((0x2001, 0), 0x08, default="1.5").add((0x2002, 0), 0x11, default="nonsense")
    sheet.add((0x2003, 0), 0x16).add((0x2004, 0), 0x09, default="g\u00fct").add((0x2005, 0), 0xA0)
    sheet.add((0x00A0, 1), 0x05, default="0x06").add((0x2006, 0), 0x99)
    found = sheet_of(sheet.text().encode(), "it.eds")
    assert found.objects[0x2001, 0].default == 1.5
    assert found.objects[0x2002, 0].default == bytes(8)
    assert found.objects[0x2003, 0].default == bytes(3)
    assert found.objects[0x2004, 0].default == "gt"
    assert found.objects[0x2005, 0].kind is DataType.UNSIGNED16
    assert (0x2006, 0) not in found.objects
    assert "1 objects without a data type were left out" in found.remarks


def test_an_object_without_a_default_has_that_of_the_profile() -> None:
    sheet = stranger()
    for key in ((0x1000, 0), (0x6502, 0), (0x6065, 0)):
        sheet.entries[key].default = None
    found = sheet_of(sheet.text().encode(), "it.eds")
    assert found.objects[0x1000, 0].default == 0x00020192
    assert found.default((0x1000, 0), 1) is None
    assert found.objects[0x6502, 0].default == 0xA0
    # No drive has these numbers: a maker's tool has written 0 for nothing.
    sheet.entries[0x1000, 0].default = sheet.entries[0x6502, 0].default = "0"
    found = sheet_of(sheet.text().encode(), "it.eds")
    assert found.default((0x6502, 0), 1) is None
    assert found.objects[0x1000, 0].default == 0x00020192


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0x1F", 31),
        ("0X1f", 31),
        ("1Fh", 31),
        ("031", 31),
        ("-5", -5),
        ("+7", 7),
        (" 12 ; counts", 12),
        ('"8"', 8),
        ("", None),
        ("0x", None),
        ("1.5", None),
        ("ten", None),
        (None, None),
        ("9" * 60, None),
    ],
)
def test_numbers_are_read_as_makers_write_them(text: str | None, value: int | None) -> None:
    assert number(text) == value


def test_numbers_may_be_added_to_the_node_id() -> None:
    for text in ("$NODEID+0x180", "0x180+$NODEID", " $nodeid + 0x180 ", "$NODEID+180h"):
        assert node_number(text) == (0x180, True)
    assert node_number("$NODEID") == (0, True)
    assert node_number("0x80") == (0x80, False)
    assert node_number("$NODEID*2") is None


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "has no section such as"),
        (b"\x7fELF\0\0\0", "is no text"),
        (b"\xef\xbb\xbf <?xml version='1.0'?>\n<x>[1]</x>", "is XML, as XDD, .*ask the maker for"),
        (b"[FileInfo]\nFileName=x\n", "describes no object"),
        (b"[1000]\nParameterName=x\n", "describes no object"),
        (b"[1000]\nDataType=7\n" * (MOST_SECTIONS + 1), "sections, the limit"),
        (b"[1000]\n" + b"".join(b"k%d=1\n" % i for i in range(600)), "512 keys, the limit"),
        (
            b"".join(b"[%04X]\nDataType=7\nCompactSubObj=254\n" % i for i in range(100)),
            "describes more than 16384 objects, the limit",
        ),
    ],
)
def test_what_is_no_data_sheet_is_refused_in_one_line(content: bytes, words: str) -> None:
    with pytest.raises(UnreadableError, match=words) as caught:
        sheet_of(content, "it.eds")
    assert "\n" not in str(caught.value)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    missing, fifo, large = tmp_path / "no.eds", tmp_path / "fifo.eds", tmp_path / "large.eds"
    os.mkfifo(fifo)
    large.write_bytes(b"[1000]\n" + b" " * (1 << 22))
    for path, words in (
        (missing, "no such file; the maker of a drive"),
        (tmp_path, "it is a directory"),
        (fifo, "it is a FIFO"),
        (large, "has more than 4194304 bytes"),
    ):
        with pytest.raises(ConfigError, match=words) as caught:
            load_sheet(path)
        assert str(caught.value).startswith(f"{path}: ")


def test_a_missing_library_is_said_with_the_way_to_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "legbench.drives.sheet._canopen", raising=False)
    monkeypatch.setitem(sys.modules, "canopen.objectdictionary", None)
    # By a name of its own, as one that has been read is remembered.
    with pytest.raises(MissingExtraError, match=r"pip install 'legbench\[eds\]'"):
        sheet_of(TEXT.encode(), "without a library.eds")


@pytest.mark.long
def test_mutated_sheets_are_proposed_from_or_refused_in_one_line() -> None:
    command = [sys.executable, "-W", "error", str(ROOT / "scripts" / "fuzz_sheets.py")]
    done = subprocess.run(
        [*command, "--mutations", "60", "--seed", "3"],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("60 mutations: ")
    assert "refused" in done.stdout
    assert "proposed" in done.stdout
