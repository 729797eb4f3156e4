"""Small data sheets in full: what is made of each line, and what of each default."""

import struct

import pytest

from legbench.drives.protocol.datatypes import DataType
from legbench.drives.sheet import clean
from legbench.drives.sheet.clean import clean_text
from legbench.drives.sheet.data_sheet import DataSheet
from legbench.drives.sheet.load import sheet_of
from legbench.drives.sheet.text import node_number, number, split
from legbench.reading import UnreadableError

SHEET = """\
[2000]
ParameterName=wide
DataType=0x1B
AccessType=wo
DefaultValue=$NODEID+0
LowLimit=1
HighLimit=0x10
PDOMapping=1
[2001]
ParameterName=real
DataType=0x08
AccessType=odd
DefaultValue=1.5
LowLimit=0
[2002]
DataType=1
AccessType=ro
DefaultValue=maybe
[2003]
ParameterName=of no type
DataType=0
[2004]
ParameterName=of a type that is not there
DataType=0x1C
[2005]
ParameterName=record
[2005sub0]
ParameterName=count
DataType=5
AccessType=const
DefaultValue=1
[2005sub1]
ParameterName=text
DataType=9
AccessType=rw
DefaultValue=words
HighLimit=7
[2006sub2]
ParameterName=alone
DataType=0x02
AccessType=ro
DefaultValue=-1
"""
CLEAN = """\
[DeviceInfo]
[2000]
ParameterName=wide
ObjectType=0x7
DataType=0x001B
AccessType=wo
PDOMapping=1
DefaultValue=$NODEID+0x0
LowLimit=1
HighLimit=16
[2001]
ParameterName=real
ObjectType=0x7
DataType=0x0008
AccessType=rw
PDOMapping=0
DefaultValue=1.5
[2002]
ParameterName=object
ObjectType=0x7
DataType=0x0001
AccessType=ro
PDOMapping=0
[2005]
ParameterName=record
ObjectType=0x9
[2005sub0]
ParameterName=count
ObjectType=0x7
DataType=0x0005
AccessType=const
PDOMapping=0
DefaultValue=1
[2005sub1]
ParameterName=text
ObjectType=0x7
DataType=0x0009
AccessType=rw
PDOMapping=0
DefaultValue=words
[2006]
ParameterName=object 2006h
ObjectType=0x9
[2006sub0]
ParameterName=count
ObjectType=0x7
DataType=0x0005
AccessType=ro
PDOMapping=0
DefaultValue=2
[2006sub2]
ParameterName=alone
ObjectType=0x7
DataType=0x0002
AccessType=ro
PDOMapping=0
DefaultValue=-1
"""


def test_every_object_has_the_lines_of_the_standard_and_what_is_left_out_is_counted() -> None:
    found = split(SHEET)
    assert clean_text(found) == CLEAN
    assert found.remarks == [
        "1 objects have a default that is no value; it was left out",
        "2 objects without a data type were left out",
        "1 objects without a known access type have the profile's, else can be written",
        "1 objects without their sub-index 0 have got one",
    ]


@pytest.mark.parametrize(
    ("kind", "kept"),
    # CiA 301: visible, octet and Unicode strings and domains have words, a time of day has none.
    [(0x09, True), (0x0A, True), (0x0B, True), (0x0F, True), (0x0C, False), (0x10, False)],
)
def test_words_are_a_default_of_texts_alone(kind: int, kept: bool) -> None:
    text = clean_text(split(f"[2000]\nDataType={kind}\nDefaultValue=words ; and a comment\n"))
    assert ("DefaultValue=words\n" in text) is kept
    assert ("DefaultValue" in text) is kept


def test_a_compact_array_has_254_sub_objects_at_most() -> None:
    for count, last in ((3, 3), (254, 254), (255, 254), (1000, 254)):
        text = clean_text(split(f"[2000]\nDataType=5\nCompactSubObj={count}\n"))
        # The count itself is one more.
        assert text.count("DataType") == last + 1


def test_sub_objects_count_as_objects_up_to_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clean, "MOST_OBJECTS", 6)
    array = "[2000]\nParameterName=x\nDataType=5\nCompactSubObj=3\n"
    for single, fits in ((1, True), (2, True), (3, False)):
        # An array of three and its count are four.
        text = array + "".join(f"[30{n:02d}]\nDataType=5\n" for n in range(single))
        if fits:
            assert clean_text(split(text)).count("DataType") == 4 + single
        else:
            with pytest.raises(UnreadableError, match="more than 6 objects, the limit"):
                clean_text(split(text))


HEAD = "[DeviceInfo]\nVendorNumber={}\nProductNumber=0x22\nRevisionNumber=0x33\n"
OBJECT = "[{}]\nParameterName=x\nDataType={}\nAccessType=ro\n"


def read(*objects: tuple[str, str, str | None], vendor: str = "0x11", more: str = "") -> DataSheet:
    text = HEAD.format(vendor)
    for where, kind, default in objects:
        text += OBJECT.format(where, kind, *())
        text += "" if default is None else f"DefaultValue={default}\n"
    return sheet_of((text + more).encode(), "small.eds")


def test_an_identity_is_that_of_1018_where_it_tells_one_and_else_that_of_the_head() -> None:
    one = ("2000", "5", "0")
    head = read(one)
    assert (head.vendor, head.product, head.revision) == (0x11, 0x22, 0x33)
    own = read(*[(f"1018sub{sub}", "7", f"0xA{sub}") for sub in (1, 2, 3, 4)])
    assert (own.vendor, own.product, own.revision) == (0xA1, 0xA2, 0xA3)
    zero = read(*[(f"1018sub{sub}", "7", "0") for sub in (1, 2, 3)])
    assert (zero.vendor, zero.product, zero.revision) == (0x11, 0x22, 0x33)
    for text, value in (("0xFFFFFFFF", 0xFFFFFFFF), ("0x100000000", None), ("-1", None)):
        assert read(one, vendor=text).vendor == value


def test_defaults_are_kept_in_the_type_of_their_object() -> None:
    sheet = read(
        ("2000", "0x11", "1.5"),
        ("2001", "0x11", None),
        ("2002", "0x0A", None),
        ("2003", "0x0F", None),
        ("2004", "0x03", "0xFFFE"),
        ("2005", "0x06", "0x10000"),
        ("2006", "0x03", "0x10000"),
        ("2007", "0x1B", "7"),
        ("2008", "0x08", None),
        ("2009", "0x09", None),
    )
    shown = {key[0]: entry.default for key, entry in sheet.objects.items()}
    assert shown == {
        # Double precision has 8 bytes, its lowest first.
        0x2000: struct.pack("<d", 1.5),
        0x2001: bytes(8),
        0x2002: b"",
        0x2003: b"",
        0x2004: -2,
        0x2005: 0,
        0x2006: 0,
        0x2007: 7,
        0x2008: 0.0,
        0x2009: "",
    }
    assert sheet.given == {(index, 0) for index in (0x2000, 0x2004, 0x2007)}
    assert sheet.objects[0x2007, 0].kind is DataType.UNSIGNED64


@pytest.mark.parametrize(
    ("kind", "length"),
    # CiA 301, table of data types: times of day, odd whole numbers, double precision.
    [
        *((0x0C, 6), (0x0D, 6), (0x10, 3), (0x11, 8), (0x12, 5), (0x13, 6), (0x14, 7)),
        *((0x16, 3), (0x18, 5), (0x19, 6), (0x1A, 7)),
    ],
)
def test_a_number_of_another_length_is_as_many_bytes(kind: int, length: int) -> None:
    sheet = read(("2000", f"0x{kind:02X}", None))
    assert sheet.objects[0x2000, 0].kind is DataType.OCTET_STRING
    assert sheet.objects[0x2000, 0].default == bytes(length)


def test_a_configured_device_has_a_node_id_from_1_to_127() -> None:
    one = ("2000", "5", "0")
    for name in ("DeviceComissioning", "DeviceCommissioning"):
        for text, node_id in (("0", None), ("1", 1), ("127", 127), ("128", None)):
            assert read(one, more=f"[{name}]\nNodeID={text}\n").node_id == node_id


def test_limits_are_those_between_which_there_is_something() -> None:
    def limits(low: str, high: str) -> object:
        more = f"[2000]\nParameterName=x\nDataType=3\nLowLimit={low}\nHighLimit={high}\n"
        return dict(read(more=more).limits)

    assert limits("-5", "5") == {(0x2000, 0): (-5, 5)}
    assert limits("5", "6") == {(0x2000, 0): (5, 6)}
    assert limits("5", "5") == limits("6", "5") == limits("x", "5") == limits("5", "x") == {}


def test_sub_indices_are_hexadecimal_and_of_two_sections_the_first_counts() -> None:
    found = split("[2006sub1A]\nDataType=5\n[2006sub1a]\nDataType=6\n")
    assert found.objects == {(0x2006, 0x1A): {"datatype": "5"}}
    assert found.remarks == ["1 sections stand twice; the first of each counts"]
    assert split("[2006sub1A]\nDataType=5\n").remarks == []


def test_a_section_has_512_keys_and_a_number_40_characters_at_most() -> None:
    keys = "".join(f"k{n}=1\n" for n in range(512))
    (section,) = split(f"[2000]\n{keys}").objects.values()
    assert len(section) == 512
    with pytest.raises(UnreadableError, match="more than 512 keys, the limit"):
        split(f"[2000]\n{keys}one=more\n")
    assert number("7".rjust(40, "0")) == 7
    assert number("7".rjust(41, "0")) is None
    # It is added to the node id once.
    assert node_number("$NODEID+$NODEID") is None
