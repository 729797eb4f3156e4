"""Data sheets as makers write them: what is left out or cannot be meant costs no drive."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from eds_texts import Sheet
from eds_texts import stranger as whole_stranger
from test_data_sheet_judging import bus_of, learned_by, really

from legbench.commissioning.learn import learn
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.errors import DriveError, SdoAbortError
from legbench.drives.master.session import Session
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.objects import Key
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.protocol.sdo import Abort
from legbench.drives.setup.bus_file import parse_object
from legbench.drives.setup.config import Parameter
from legbench.drives.sheet.assess import assess
from legbench.drives.sheet.bus_text import bus_text
from legbench.drives.sheet.data_sheet import DataSheet
from legbench.drives.sheet.load import sheet_of
from legbench.drives.sheet.predict import predict
from legbench.drives.sheet.propose import propose
from legbench.errors import ConfigError

RPDO, TPDO = ("0x60400010", "0x607A0020"), ("0x60410010", "0x60640020")


UNUSED = (0x1003, 0x1007, 0x1008, 0x1010, 0x1011, 0x1015, 0x1019, 0x607C, 0x6062, 0x6081, 0x6083)
UNUSED += (0x6099, 0x609A)


def stranger() -> Sheet:
    """A complete drive without what no test here looks at, so that it is read fast."""
    pdos = (base + place for base in (0x1600, 0x1A00) for place in range(4))
    return whole_stranger().without(
        *UNUSED, *((mapping, sub) for mapping in pdos for sub in range(4, 9))
    )


def read(text: str) -> DataSheet:
    return sheet_of(text.encode(), "it.eds")


def mapped(sheet: Sheet, mapping: int, words: tuple[str, ...], access: str = "rw") -> None:
    """Map objects into a PDO at power-on."""
    sheet.entries[mapping, 0].default = str(len(words))
    for sub in range(4):
        sheet.entries[mapping, sub].access = access
    for sub, word in enumerate(words, 1):
        sheet.entries[mapping, sub].default = word


def test_identifiers_without_the_node_id_count_from_it() -> None:
    # CiA 301, 7.3.5: 200h is RPDO1 of no node; 300h is none of RPDO3.
    cases: dict[Key, tuple[str, int, bool]] = {
        (0x1014, 0): ("0x80", 0x85, True),
        (0x1400, 1): ("0x200", 0x205, True),
        (0x1401, 1): ("0x301", 0x301, False),
        (0x1402, 1): ("0x300", 0x300, False),
        (0x1403, 1): ("$NODEID+0x501", 0x506, True),
        (0x1801, 1): ("0xC0000280", 0xC0000285, True),
    }
    for access in ("rw", "const"):
        it = stranger().fixed({key: told for key, (told, _, _) in cases.items()}, access)
        sheet = read(it.text())
        for key, (_, own, relative) in cases.items():
            assert sheet.default(key, 5) == own
            assert (key in sheet.relative) is relative
        told = (
            "3 identifiers count from the node id, though they do not say so: 1014h:00, 1400h:01, "
            "1801h:01"
        )
        assert sheet.remarks == (told,)
    # Two drives whose data sheet tells no identifier do not share that of SYNC.
    it.entries[0x1014, 0].default = None
    assert (0x1014, 0) in read(it.text()).relative


def test_a_configured_device_holds_what_was_configured() -> None:
    head = "[DeviceComissioning]\nNodeID=5\n\n"
    text = stranger().text()
    for default, configured, other in (
        ("DefaultValue=$NODEID+0x80000200", "ParameterValue=0x205", 0x202),
        ("DefaultValue=0x80000200", "ParameterValue=$NODEID+0x280", 0x282),
        ("DefaultValue=$NODEID+0x80000200", "ParameterValue=", 0x80000202),
        ("DefaultValue=$NODEID+0x80000200", "ParameterValue=0x307", 0x307),
    ):
        own = text.replace("DefaultValue=$NODEID+0x80000200", f"{default}\n{configured}")
        assert own != text
        assert read(head + own).default((0x1400, 1), 2) == other


def test_limits_that_cannot_be_meant_are_none() -> None:
    cases: dict[Key, tuple[str, tuple[str, str], tuple[int, int] | None]] = {
        (0x60C2, 2): ("-3", ("-128", "63"), (-128, 63)),
        (0x6061, 0): ("-3", ("0x80", "0x3F"), (-128, 63)),
        (0x6098, 0): ("-3", ("0", "100"), None),
        (0x6060, 0): ("0", ("0", "0xFFFFFFFF"), None),
        (0x1017, 0): ("5000", ("0", "1000"), None),
        (0x1029, 1): ("0", ("-1", "2"), None),
        # Often 0 says that nothing is set.
        (0x6085, 0): ("0", ("1", "65500"), (1, 65500)),
        # An identifier is switched off by bit 31.
        (0x1400, 1): ("$NODEID+0x200", ("0x181", "0x57F"), None),
        (0x1401, 1): ("$NODEID+0x300", ("0", "0x80000000"), None),
        (0x1402, 1): ("$NODEID+0x400", ("0", "0xFFFFFFFF"), (0, 0xFFFFFFFF)),
        # These are none to begin with.
        (0x6072, 0): ("5", ("0", "0"), None),
    }
    sheet = stranger()
    for key, (default, limits, _) in cases.items():
        sheet.entries[key].default, sheet.entries[key].limits = default, limits
    found = read(sheet.text())
    assert {key: found.limits.get(key) for key in cases} == {
        key: kept for key, (_, _, kept) in cases.items()
    }
    (remark,) = found.remarks
    assert remark.startswith("6 objects have limits that cannot be meant, which were left out: ")
    assert remark.endswith(" and 2 more")


def test_types_that_cannot_be_meant_are_the_profiles() -> None:
    i8, i16, u8, u16, u32 = 0x02, 0x03, 0x05, 0x06, 0x07
    cases: dict[Key, tuple[int, str, int, int]] = {
        # The other sign, by the same bits.
        (0x60C2, 2): (u8, "0xFD", i8, -3),
        (0x6060, 0): (u8, "-1", i8, -1),
        (0x6041, 0): (0x03, "-1", u16, 0xFFFF),
        # Too short for what it holds.
        (0x1000, 0): (u16, "0x00420192", u32, 0x0042_0192),
        (0x1018, 1): (u8, "0x5A65726F", u32, 0x5A65_726F),
        (0x1400, 1): (u16, "$NODEID+0x200", u32, 0x200),
        (0x1016, 1): (u16, "0", u32, 0),
        (0x1601, 2): (u8, "0", u32, 0),
        (0x1A01, 2): (u8, "0", u32, 0),
        (0x6098, 0): (u8, "-128", i8, -128),
        (0x605B, 0): (u16, "65535", i16, -1),
        # Another length may be meant, and positions may have either sign.
        (0x6061, 0): (u16, "8", u16, 8),
        (0x6064, 0): (u32, "-1", u32, 0xFFFF_FFFF),
        (0x607A, 0): (u32, "7", u32, 7),
        (0x607D, 1): (u32, "5", u32, 5),
        (0x60E4, 1): (u32, "6", u32, 6),
        # Neither holds it.
        (0x1017, 0): (u8, "0x10000", u8, 0),
        (0x605C, 0): (i8, "-32769", i8, 1),
    }
    sheet = stranger()
    for key, (kind, default, _, _) in cases.items():
        sheet.entries[key].kind, sheet.entries[key].default = kind, default
    found = read(sheet.text())
    for key, (_, _, kind, default) in cases.items():
        assert (found.objects[key].kind, found.objects[key].default) == (kind, default)
        assert (key in found.given) is (key not in ((0x1017, 0), (0x605C, 0)))
    (remark,) = found.remarks
    assert remark == (
        "11 objects have the profile's type instead of their own: 1000h:00, 1016h:01, 1018h:01, "
        "1400h:01 and 7 more"
    )
    # What the emulated drive calls its link's position is something else to its maker.
    own = stranger().add((0x2064, 0), u16, name="x", limits=("0", "65535"), default="0x8000")
    found = read(own.text())
    assert found.objects[0x2064, 0].kind is DataType.UNSIGNED16
    assert found.limits[0x2064, 0] == (0, 65_535)
    assert not found.remarks


def test_modes_and_a_device_type_of_0_say_nothing() -> None:
    it = stranger().add((0x6502, 0), DataType.UNSIGNED32, default="0")
    assert (0x1000, 0) in read(it.text()).given
    it.entries[0x1000, 0].default = "0"
    assert not {(0x1000, 0), (0x6502, 0)} & read(it.text()).given


@pytest.mark.parametrize(("count", "more"), [(4, ""), (5, " and 1 more")])
def test_a_remark_names_four_objects(count: int, more: str) -> None:
    it = stranger()
    for number in range(count):
        key = (0x1A00 + number, 0)
        it.add(key, DataType.UNSIGNED8, default="5", limits=("9", "10"))
    (remark,) = read(it.text()).remarks
    assert remark == (
        f"{count} objects have limits that cannot be meant, which were left out: "
        f"1A00h:00, 1A01h:00, 1A02h:00, 1A03h:00{more}"
    )


def test_a_record_without_its_sub_index_0_has_got_one() -> None:
    it = stranger()
    mapped(it, 0x1600, RPDO)
    text = it.text()
    bare = re.sub(r"\[(1018|1400|1600|1A00|60C2)sub0\]\n[^\[]*", "", text)
    sheet, whole = read(bare), read(text)
    assert set(sheet.objects) == set(whole.objects)
    for number, commands in ((1, True), (1, False)):
        assert sheet.room(number, commands=commands) == whole.room(number, commands=commands)
    assert sheet.mapped(1, commands=True) == whole.mapped(1, commands=True)
    assert sheet.default((0x1018, 0), 0) == 4
    assert "5 objects without their sub-index 0 have got one" in sheet.remarks


def test_an_object_can_be_mapped_unless_its_sheet_denies_it() -> None:
    its_own = stranger().add((0x2064, 0), DataType.INTEGER16)
    mute = read(its_own.text().replace("PDOMapping=1\n", ""))
    assert mute.objects[0x607A, 0].mappable
    assert not mute.objects[0x607D, 1].mappable
    assert not mute.objects[0x2064, 0].mappable
    # What stands elsewhere is no mapping.
    other = stranger().add((0x2200, 0), DataType.UNSIGNED32, default="0x607D0120")
    assert not read(other.text()).objects[0x607D, 1].mappable
    denied = stranger()
    denied.entries[0x607A, 0].mappable = False
    assert not read(denied.text()).objects[0x607A, 0].mappable
    # It stands in a mapping, so it can be mapped.
    mapped(denied, 0x1602, RPDO)
    assert read(denied.text()).objects[0x607A, 0].mappable


def two_entries(it: Sheet) -> None:
    it.without(
        0x60E4, *((mapping, sub) for mapping in range(0x1A00, 0x1A04) for sub in range(3, 9))
    )


def no_second(it: Sheet) -> None:
    mapped(it, 0x1A00, TPDO, "ro")
    it.without(0x1801, 0x1802, 0x1803, 0x1A01, 0x1A02, 0x1A03)


def torque_alone(it: Sheet) -> None:
    no_second(it)
    mapped(it, 0x1A00, (*TPDO, "0x60770010"), "ro")


def always_on(it: Sheet) -> None:
    mapped(it, 0x1A01, ("0x606C0020",), "ro")
    it.fixed({(0x1801, 1): "$NODEID+0x280"})


@pytest.mark.parametrize(
    ("change", "tpdos"),
    [
        (two_entries, [(1, 2), (2, 1)]),
        (no_second, [(1, 2)]),
        (torque_alone, [(1, 3)]),
        (always_on, [(1, 2), (2, 1), (3, 1)]),
    ],
)
def test_process_data_are_packed_as_the_drive_can_carry_them(
    change: Callable[[Sheet], None], tpdos: list[tuple[int, int]], tmp_path: Path
) -> None:
    sheet = stranger()
    change(sheet)
    bus = learned_by(tmp_path, sheet)
    assert [(pdo.number, len(pdo.objects)) for pdo in bus.nodes[0].tpdos] == tpdos


def test_a_second_position_that_is_asked_for_is_sent_or_refused() -> None:
    sheet = stranger()
    no_second(sheet)
    asked = Mapped(0x60E4, 1, DataType.INTEGER32)
    with pytest.raises(
        ConfigError, match=r"60E4h:01 at .*TPDO1: fixed to 6041h:00, 6064h:00\); --link none"
    ):
        propose(read(sheet.text()), "it.eds", asked)
    short = stranger().add((0x607A, 0), DataType.INTEGER16, "rw")
    with pytest.raises(ConfigError, match=r"6064h:00 has 32 bits, 607Ah:00 has 16: both need"):
        propose(read(short.text()), "it.eds")
    with pytest.raises(ConfigError, match="6064h:00 is the motor's own position"):
        propose(read(stranger().text()), "it.eds", Mapped(0x6064, 0, DataType.INTEGER32))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({(0x1400 + n, 2): "255" for n in range(4)}, r"RPDO1: 1400h:02 is fixed to 255, it does"),
        ({(0x1400 + n, 1): "0x80000000" for n in range(4)}, "RPDO2: 1401h:01 is fixed to 80000000"),
        ({(0x1600 + n, 0): "0" for n in range(4)}, r"RPDO4: fixed to nothing\); map them with the"),
    ],
)
def test_a_refusal_says_what_every_pdo_is_fixed_to(changes: dict[Key, str], words: str) -> None:
    sheet = stranger().fixed(changes)
    with pytest.raises(ConfigError, match=r"^it\.eds: its RPDOs cannot carry 6040h") as caught:
        propose(read(sheet.text()), "it.eds")
    assert re.search(words, str(caught.value))
    assert "another drive" in str(caught.value)


def test_a_refusal_says_how_many_objects_a_pdo_has_room_for() -> None:
    sheet = stranger().without(0x1401, 0x1402, 0x1403).fixed({(0x1600, 2): "0"})
    with pytest.raises(ConfigError, match=r"\(RPDO1: room for 1 objects\); map them"):
        propose(read(sheet.text()), "it.eds")


def test_limits_of_the_drive_itself_are_proposed_where_it_takes_them() -> None:
    for kind, limits, proposed in (
        (DataType.INTEGER32, None, True),
        (DataType.INTEGER32, ("-75100", "75100"), True),
        (DataType.INTEGER32, ("-75000", "75100"), False),
        (DataType.INTEGER32, ("-75100", "75000"), False),
        (DataType.INTEGER16, None, False),
        (DataType.UNSIGNED32, None, False),
    ):
        sheet = stranger()
        for sub in (1, 2):
            sheet.entries[0x607D, sub].kind = int(kind)
            sheet.entries[0x607D, sub].limits = limits
        text = bus_text(propose(read(sheet.text()), "it.eds"), (1,))
        assert ("soft_limits = " in text) is proposed
    # Positions that count from 0 have no such range before they are measured.
    for key in ((0x6064, 0), (0x607A, 0), (0x607D, 1), (0x607D, 2)):
        sheet.entries[key].kind = int(DataType.UNSIGNED32 if key[0] < 0x607D else 0x04)
    assert "soft_limits" not in bus_text(propose(read(sheet.text()), "it.eds"), (1,))


def test_space_in_a_fixed_command_is_sent_as_zeros(tmp_path: Path) -> None:
    sheet = stranger()
    # CiA 301: dummy entries are named as the index of their type, here UNSIGNED16.
    mapped(sheet, 0x1600, ("0x60400010", "0x00060010", "0x607A0020"), "ro")
    sheet.without(0x1401, 0x1402, 0x1403)
    bus = learned_by(tmp_path, sheet)
    (pdo,) = bus.nodes[0].rpdos
    assert [entry.index for entry in pdo.objects] == [0x6040, 0x0006, 0x607A]
    assert all(one.passes for one in really(bus))
    for word in ("0x00060020", "0x00060110", "0x00080020", "0x30000010"):
        mapped(sheet, 0x1600, ("0x60400010", word, "0x607A0020"), "ro")
        with pytest.raises(ConfigError, match="RPDOs cannot carry"):
            propose(read(sheet.text()), "it.eds")


def test_limits_of_a_mapping_and_of_a_transmission_type_are_kept(tmp_path: Path) -> None:
    sheet = stranger()
    for place in range(4):
        sheet.entries[0x1600 + place, 0].limits = ("0", "1")
    sheet.entries[0x1401, 2].limits, sheet.entries[0x1402, 2].limits = ("254", "255"), ("0", "240")
    assert [pdo.number for pdo in learned_by(tmp_path, sheet).nodes[0].rpdos] == [1, 3]
    sheet.fixed({(0x1400, 2): "255"})
    with pytest.raises(ConfigError, match="RPDO2: 1401h:02 takes 254 to 255, not 1, which"):
        propose(read(sheet.without(0x1403).text()), "it.eds")


def test_what_is_no_drive_is_refused_as_that(tmp_path: Path) -> None:
    box = stranger()
    box.without(*(index for index, _ in list(box.entries) if index >= 0x6000 or index < 0x1000))
    for sheet, words in (
        (box, r"^'motor1', 'motor2': 6040h, 6041h, 6061h, 6064h, 607Ah are missing: it is no CiA"),
        (stranger().fixed({(0x1000, 0): "0x191"}), "1000h:00 is 00000191h: .*another drive$"),
        (stranger().without(0x6061), "6061h:00 .*: another drive, or a complete data sheet$"),
    ):
        (tmp_path / "it.eds").write_text(sheet.text(), encoding="utf-8")
        problems = learn(tmp_path / "it.eds", tmp_path / "leg.toml").problems
        assert re.search(words, problems[0])
        # One line a reason, however many drives there are.
        assert sum(problems[0][20:] in problem for problem in problems) == 1
    with pytest.raises(ConfigError, match="are missing: it is no CiA 402 drive"):
        propose(read(box.without(*range(0x1400, 0x1404)).text()), "it.eds")


def test_a_number_is_written_and_read_in_the_length_that_the_drive_has(tmp_path: Path) -> None:
    sheet = stranger()
    kinds = {(0x6085, 0): DataType.UNSIGNED16, (0x60B0, 0): DataType.INTEGER8}
    kinds |= {(0x6060, 0): DataType.INTEGER32, (0x60B2, 0): DataType.INTEGER64}
    for key, kind in kinds.items():
        sheet.entries[key].kind = int(kind)
    (tmp_path / "it.eds").write_text(sheet.text(), encoding="utf-8")
    bus = bus_of(tmp_path / "it.eds")
    with Session(LockstepBus("it", network=emulate(bus)), bus) as session:
        sdo = session.bring_up().sdo(bus.nodes[0])
        for index, kind, value, content in (
            (0x6085, DataType.UNSIGNED32, 32_767, "ff7f"),
            (0x60B0, DataType.INTEGER32, -5, "fb"),
            (0x60B0, DataType.INTEGER32, 127, "7f"),
            (0x6060, DataType.INTEGER8, 8, "08000000"),
            (0x60B2, DataType.INTEGER16, -300, "d4feffffffffffff"),
        ):
            sdo.put(index, 0, kind, value)
            assert sdo.read(index, 0).hex() == content
            assert sdo.get_int(index, 0, kind) == value
        for index, kind, value in (
            (0x6085, DataType.UNSIGNED32, 32_768),
            (0x6085, DataType.UNSIGNED32, 65_536),
            (0x60B0, DataType.INTEGER32, 128),
            (0x60B0, DataType.REAL32, 1),
        ):
            with pytest.raises(SdoAbortError) as caught:
                sdo.put(index, 0, kind, value)
            assert caught.value.code == Abort.TOO_LONG
        # What is beyond the type is no padding.
        sdo.put(0x60B2, 0, DataType.INTEGER64, 70_000)
        with pytest.raises(DriveError, match="8 bytes are no INTEGER16"):
            sdo.get_int(0x60B2, 0, DataType.INTEGER16)


def test_a_shorter_number_that_may_be_negative_protects_nothing(tmp_path: Path) -> None:
    # 40000 in two bytes is -25536 to a drive with a sign, and both read back alike.
    window = Parameter(index=0x6065, sub=0, kind=DataType.UNSIGNED32, value=40_000)
    for access, held, words in (
        ("rw", "0", "length .*holds 0, wanted 40000; .*give a value and a type"),
        ("ro", "-25536", "6065h:00 .* 40000 in 2 bytes, or -25536.*give it in the drive's type"),
    ):
        sheet = stranger()
        entry = sheet.entries[window.key]
        entry.kind, entry.access, entry.default = int(DataType.INTEGER16), access, held
        (tmp_path / "it.eds").write_text(sheet.text(), encoding="utf-8")
        bus = bus_of(tmp_path / "it.eds")
        first, *others = bus.nodes
        bus = replace(bus, nodes=(replace(first, parameters=(window,)), *others))
        with pytest.raises(DriveError, match=words):
            really(bus)


def test_words_and_positions_are_as_long_as_the_bus_file_says(tmp_path: Path) -> None:
    bus = learned_by(tmp_path, stranger())
    for key, kind, words in (
        ((0x6064, 0), DataType.UNSIGNED32, None),
        ((0x6064, 0), DataType.INTEGER64, r'is of type i64, .*: write "6064:00 i64"'),
        ((0x607A, 0), DataType.REAL32, "is of type f32, no whole number; another drive"),
        ((0x6040, 0), DataType.INTEGER16, None),
        ((0x6040, 0), DataType.UNSIGNED32, "is of type u32, not u16; another drive"),
        ((0x6041, 0), DataType.UNSIGNED8, "is of type u8, not u16; another drive"),
    ):
        sheet = stranger()
        sheet.entries[key].kind = int(kind)
        problems = assess(read(sheet.text()), bus, bus.nodes[0]).problems
        assert len(problems) == (words is not None)
        assert all(re.search(f"^{key[0]:04X}h:00 .*{words}", line) for line in problems)
    shown = ((0x6041, 0), (0x6061, 0), (0x6064, 0), (0x1000, 0), (0x1018, 1))
    sheet = stranger()
    for key in shown:
        sheet.entries[key].access = "wo"
    problems = assess(read(sheet.text()), bus, bus.nodes[0]).problems
    for key, problem in zip(shown, problems, strict=True):
        assert re.search(rf"^{key[0]:04X}h:0{key[1]} .* cannot be read; .*: another", problem)


def test_a_position_that_a_drive_has_not_is_missing_whatever_its_index(tmp_path: Path) -> None:
    bus = learned_by(tmp_path, stranger())
    first, odd = bus.nodes[0], Mapped(0x6064, 1, DataType.INTEGER32)
    tpdos = tuple(
        replace(pdo, objects=tuple(odd if one.index == 0x6064 else one for one in pdo.objects))
        for pdo in first.tpdos
    )
    node = replace(first, motor_object=odd, tpdos=tpdos)
    (problem,) = assess(read(stranger().text()), bus, node).problems
    assert problem == "6064h:01 is missing; name another object in the bus file"


def test_what_a_proposal_cannot_take_as_told_is_said(tmp_path: Path) -> None:
    late = stranger()
    for index in range(0x1400, 0x1404):
        late.entries[index, 2].default, late.entries[index, 2].limits = "255", ("254", "255")
    with pytest.raises(ConfigError, match=r"RPDO1: 1400h:02 takes 254 to 255, not 1, which foll"):
        propose(read(late.text()), "it.eds")
    for link, words in (("6064:00 i32", "motor's own position"), ("6077:00 i16", "drive's torque")):
        with pytest.raises(ConfigError, match=f"{words}; name another object with --link"):
            propose(read(stranger().text()), "it.eds", parse_object(link))
    # The sign of the position is that of its target, which is a guess.
    signs = stranger()
    signs.entries[0x607A, 0].kind = int(DataType.UNSIGNED32)
    text = bus_text(propose(read(signs.text()), "it.eds"), [1, 2])
    line = next(line for line in text.splitlines() if line.startswith("motor_object"))
    told = "# MEASURE: its sign; the data sheet says i32"
    assert line == f'motor_object = "6064:00 u32"  {told}'


def test_a_number_that_is_no_whole_one_is_not_written(tmp_path: Path) -> None:
    bus = learned_by(tmp_path, stranger())
    sheet = stranger().add((0x605D, 0), DataType.REAL32, "rw")
    sheet.add((0x605C, 0), DataType.OCTET_STRING, "rw", default="00")
    codes = {
        one.parameter.index: one.code for one in predict(read(sheet.text()), bus, bus.nodes[0])
    }
    assert codes[0x605D] == codes[0x605C] == Abort.TYPE_LENGTH
    assert codes[0x605B] is None


def test_a_value_that_is_fixed_and_not_told_is_as_wanted(tmp_path: Path) -> None:
    sheet = stranger()
    for key in ((0x60C2, 1), (0x60C2, 2), (0x1400, 2), (0x1017, 0), (0x605A, 0)):
        sheet.entries[key].access, sheet.entries[key].default = "ro", None
    (tmp_path / "it.eds").write_text(sheet.text(), encoding="utf-8")
    assert all(one.passes for one in really(bus_of(tmp_path / "it.eds")))


def test_a_value_that_is_fixed_and_not_told_is_not_called_as_wanted(tmp_path: Path) -> None:
    bus, key = learned_by(tmp_path, stranger()), (0x6007, 0)
    for default, words in (
        (None, "fixed to a value that the data sheet does not tell, taken to be 3; `legbench "),
        ("3", "as it is wanted"),
    ):
        sheet = stranger()
        sheet.entries[key].access, sheet.entries[key].default = "ro", default
        found = assess(read(sheet.text()), bus, bus.nodes[0])
        (remark,) = (one.remark for one in found.findings if one.object.startswith("6007h"))
        assert remark.startswith(words)
        told = [line for line in found.unprotected if line.startswith("6007h")]
        assert len(told) == (default is None)


def test_what_can_only_be_written_is_taken_at_its_word(tmp_path: Path) -> None:
    sheet = stranger()
    for key in ((0x607A, 0), (0x607D, 1), (0x607D, 2)):
        sheet.entries[key].access = "wo"
    bus = learned_by(tmp_path, sheet)
    network = emulate(bus)
    with Session(LockstepBus("it", network=network), bus) as session:
        up = session.bring_up()
        assert up.preload(bus.nodes[0]) == up.position(bus.nodes[0])
        assert bus.nodes[0].soft_limits_counts is not None
        assert up.soft_limits(bus.nodes[0]) == bus.nodes[0].soft_limits_counts
