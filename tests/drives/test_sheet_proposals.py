"""Bus files proposed from data sheets, to the letter, and the process data that they choose."""

import math
from dataclasses import replace

import pytest

from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.objects import OBJECTS, Access, Key, ObjectEntry
from legbench.drives.sheet.bus_text import bus_text, marked_lines, waivers_for
from legbench.drives.sheet.data_sheet import DataSheet
from legbench.drives.sheet.propose import ONE_ENCODER, propose

I8, I16, I32 = DataType.INTEGER8, DataType.INTEGER16, DataType.INTEGER32
U8, U16, U32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32


def drive(*without: Key, **changes: object) -> DataSheet:
    """Data sheet of the usual drive, without some objects."""
    objects = {key: entry for key, entry in OBJECTS.items() if key not in without}
    relative = [key for key in objects if key[1] == 1 and 0x1400 <= key[0] < 0x1A00]
    usual = DataSheet(
        name="it.eds",
        objects=objects,
        given=frozenset(objects),
        relative=frozenset(key for key in relative if key[0] & 0x1FF < 4),
        limits={},
        vendor=0xABCDEF,
        product=0x77,
        vendor_name="Werk",
        product_name="Antrieb",
        bitrates=frozenset({500_000, 250_000}),
    )
    return replace(usual, **changes)  # pyrefly: ignore[bad-argument-type]


def with_objects(sheet: DataSheet, *entries: ObjectEntry) -> DataSheet:
    """A data sheet with some objects more, or otherwise; their defaults are told."""
    added = {entry.key: entry for entry in entries}
    return replace(sheet, objects={**sheet.objects, **added}, given=sheet.given | added.keys())


def entry(
    key: Key,
    kind: DataType = I32,
    access: Access = Access.RO,
    default: int = 0,
    *,
    name: str = "thing",
    mappable: bool = True,
) -> ObjectEntry:
    return ObjectEntry(*key, name, kind, access, default, mappable)


HEAD = """\
# A leg on drives of the kind Antrieb of Werk.
# Proposed from the data sheet. A line with MEASURE is a guess: measure it, correct it,
# and take MEASURE out. Serial numbers: `legbench drives scan`; offsets:
# `legbench drives zero`; the rest: the drive manual, and hardware/bring-up.md.

eds = "it.eds"
interface = "socketcan"
channel = "can0"
bitrate = 500_000
period_us = 1000
reply_delay_us = 250  # MEASURE: from SYNC to the first answer, by the drive manual
master_id = 126
heartbeat_ms = 20
master_heartbeat_ms = 10
start_speed = 0.5
"""
LINK = """\
link_object = "60E4:01 i32"  # MEASURE: whether it is the link's; else 2064:00 i16
"""
NODE = """
[[node]]
name = "motor{place}"
id = {id}
vendor = 0x00ABCDEF
product = 0x00000077
# serial = 0  # MEASURE: two drives of a kind are told apart by it alone
{objects}# temperature_object = "2070:00 i16"  # MEASURE: its scale and its place
# temperature_scale = 1.0  # MEASURE [deg C a count]
{soft}
[node.motor]
counts_per_rev = 65536  # MEASURE: counts a turn of the encoder's shaft
gear = 6.0  # MEASURE: turns of that shaft for one turn of the motor
sign = {sign}  # MEASURE: 1 if counts grow forward
offset_counts = 0  # MEASURE: legbench drives zero
bits = 32
{link}
[node.parameters]
"6065:00 u32" = 25033  # MEASURE: following error window [counts]: 0.4 rad
"6066:00 u16" = 10  # MEASURE: for so long [ms]
"6072:00 u16" = 800  # MEASURE: max torque [permille of rated]
"6085:00 u32" = 1251645402  # MEASURE: quick stop: 20000 rad/s2, in the drive's own unit

[[node.rpdo]]
number = 1
objects = ["6040:00 u16", "607A:00 i32"]
deadline_ms = 20
{tpdos}"""
# 0.4 rad and 20000 rad/s2 are 25 033 and 1 251 645 402 of 65536 x 6 counts a turn.
LINK_AXIS = """
[node.link]
counts_per_rev = 65536  # MEASURE: counts a turn of the encoder's shaft
gear = 1.0  # MEASURE: turns of that shaft for one turn of the link
sign = {sign}  # MEASURE: 1 if counts grow forward
offset_counts = 0  # MEASURE: legbench drives zero
bits = 32
"""
SOFT = "soft_limits = [{}, {}]  # MEASURE: of the motor, in the drive itself [rad]\n"
TWO_TPDOS = """
[[node.tpdo]]
number = 1
objects = ["6041:00 u16", "6064:00 i32"]

[[node.tpdo]]
number = 2
objects = ["60E4:01 i32"]
"""
ONE_TPDO = """
[[node.tpdo]]
number = 1
objects = ["6041:00 u16", "6064:00 i32", "6077:00 i16"]
"""


def node_text(place: int, node_id: int) -> str:
    sign = (1, -1)[(place - 1) % 2]
    return NODE.format(
        place=place,
        id=node_id,
        objects=LINK,
        soft={1: SOFT.format(-1.2, 1.0), 2: SOFT.format(-1.0, 1.2)}.get(place, ""),
        sign=sign,
        link=LINK_AXIS.format(sign=sign),
        tpdos=TWO_TPDOS,
    )


def test_a_bus_file_for_three_drives_is_this_text() -> None:
    text = bus_text(propose(drive(), "it.eds"), (5, 9, 12))
    assert text == HEAD + node_text(1, 5) + node_text(2, 9) + node_text(3, 12)
    marked = [n for n, line in enumerate(text.split("\n"), 1) if "# MEASURE" in line]
    assert list(marked_lines(text)) == marked


def changed(text: str, *pairs: tuple[str, str]) -> str:
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    return text


def test_what_a_data_sheet_does_not_tell_is_marked_or_left_out() -> None:
    usual = HEAD + node_text(1, 1)
    serial = "# serial = 0  # MEASURE: two drives of a kind are told apart by it alone\n"
    nameless = "# No serial number: the drive tells none, so look at the labels before each run.\n"
    temperature = usual[usual.index("# temperature_object") : usual.index("soft_limits")]
    for sheet, *pairs in (
        (drive(vendor=None), ("0x00ABCDEF\n", "0x00000000  # MEASURE\n")),
        (drive(product=None), ("0x00000077\n", "0x00000000  # MEASURE\n")),
        (drive((0x1018, 2)), ("product = 0x00000077\n", "")),
        (drive((0x1018, 4)), (serial, nameless)),
        (drive((0x2070, 0)), (temperature, "")),
        (drive((0x2064, 0)), ("; else 2064:00 i16", "")),
        (drive((0x607D, 1)), (SOFT.format(-1.2, 1.0), "")),
        (drive((0x607D, 2)), (SOFT.format(-1.2, 1.0), "")),
        (drive(bitrates=frozenset()), ("500_000", "1_000_000")),
        (drive(vendor_name=""), ("of Werk", "of an unknown maker")),
        (drive(product_name=""), ("kind Antrieb", "kind it.eds")),
    ):
        assert bus_text(propose(sheet, "it.eds"), (1,)) == changed(usual, *pairs)
    waived = "# These drives lack what these protections need; every run says so. Do without them\n"
    waived += "# only after you have seen what the drives do, by steps 4 and 5 of the bring-up.\n"
    text = bus_text(propose(drive(), "it.eds"), (1,), ("master watch",), period_us=2000)
    slow = changed(usual, ("period_us = 1000", "period_us = 2000"))
    assert text == changed(slow, ("0.5\n", f'0.5\n{waived}waive = ["master watch"]\n'))


def test_a_drive_with_one_encoder_shows_its_torque_if_it_can() -> None:
    usual = changed(
        HEAD + node_text(1, 1), (LINK_AXIS.format(sign=1), ""), (TWO_TPDOS, ONE_TPDO), (LINK, "{}")
    )
    one = "# One encoder, at the motor: name a second one, if there is one, as link_object.\n"
    torque = 'torque_object = "6077:00 i16"\n'
    torque += "torque_scale = 0.01  # MEASURE: torque at the joint of one count [N m]\n"
    text = bus_text(propose(drive(), "it.eds", ONE_ENCODER), (1,))
    assert text == changed(usual, ("{}", one + torque))
    for sheet in (
        drive((0x6077, 0)),
        with_objects(drive(), entry((0x6077, 0), I16, mappable=False)),
        with_objects(drive(), entry((0x6077, 0), DataType.REAL32)),
    ):
        text = bus_text(propose(sheet, "it.eds", ONE_ENCODER), (1,))
        assert text == changed(usual, ("{}", one), (', "6077:00 i16"', ""))


def test_positions_of_other_types_are_named_and_unsigned_ones_begin_at_zero() -> None:
    sheet = with_objects(
        drive(),
        entry((0x6064, 0), U16),
        entry((0x607A, 0), U16, Access.RW),
        entry((0x60E4, 1), U32),
    )
    text = bus_text(propose(sheet, "it.eds"), (1,))
    assert 'motor_object = "6064:00 u16"\ntarget_object = "607A:00 u16"\nlink_object = ' in text
    lowest = "lowest_count = 0  # an unsigned object\n"
    assert text.count(f"bits = 16\n{lowest}") == text.count(f"bits = 32\n{lowest}") == 1
    assert text.count(lowest) == 2
    # Somewhere within the range, so that the leg can be rehearsed before it is measured.
    for bits in (16, 32):
        assert f"offset_counts = {1 << bits - 2}  # MEASURE" in text


def test_a_position_of_another_sign_than_its_target_counts_as_the_target_does() -> None:
    for shown, taken in ((U16, I16), (I16, U16)):
        sheet = with_objects(
            drive(), entry((0x6064, 0), shown), entry((0x607A, 0), taken, Access.RW)
        )
        assert propose(sheet, "it.eds").motor.kind is taken


def test_parameters_are_those_that_a_drive_takes_within_its_limits() -> None:
    def parameters(sheet: DataSheet) -> list[str]:
        text = bus_text(propose(sheet, "it.eds"), (1,))
        _, _, after = text.partition("[node.parameters]\n")
        return [line.partition("  #")[0] for line in after.partition("\n\n")[0].splitlines()]

    window, time, torque = '"6065:00 u32" = 25033', '"6066:00 u16" = 10', '"6072:00 u16" = 800'
    ramp = '"6085:00 u32" = 1251645402'
    assert parameters(drive()) == [window, time, torque, ramp]
    assert parameters(drive((0x6065, 0), (0x6072, 0))) == [time, ramp]
    for key, line in (((0x6065, 0), window), ((0x6066, 0), time), ((0x6072, 0), torque)):
        fixed = with_objects(drive(), entry(key, OBJECTS[key].kind, Access.RO))
        assert parameters(fixed) == [each for each in (window, time, torque, ramp) if each != line]
    limited = drive(limits={(0x6065, 0): (30_000, 40_000), (0x6072, 0): (0, 500)})
    assert parameters(limited)[:3] == ['"6065:00 u32" = 30000', time, '"6072:00 u16" = 500']
    nothing = drive(limits={(0x6066, 0): (-5, 0)})
    assert parameters(nothing)[1] == '"6066:00 u16" = 0'
    # A motor stops within 0.2 rad from 40 rad/s at 4000 rad/s2, in counts of the emulated leg.
    least = math.ceil(4000.0 * 65536 * 6.0 / (2.0 * math.pi))
    for most, key in ((least, (0x6085, 0)), (least - 1, (0x6084, 0))):
        sheet = drive(limits={(0x6085, 0): (0, most)})
        found = parameters(sheet)[3:]
        assert [line[1:8] for line in found] == [f"{key[0]:04X}:00"]
    text = bus_text(
        propose(
            drive(*[(i, 0) for i in (0x6065, 0x6066, 0x6072, 0x6083, 0x6084, 0x6085)]), "it.eds"
        ),
        (1,),
    )
    assert "[node.parameters]" not in text


@pytest.mark.parametrize("watched", [True, False])
@pytest.mark.parametrize("braked", [True, False])
def test_protections_that_drives_lack_are_waived_by_name(*, watched: bool, braked: bool) -> None:
    for sheet, link, sprung in (
        (drive(), None, True),
        (drive(), ONE_ENCODER, True),
        (drive((0x6077, 0)), ONE_ENCODER, False),
    ):
        found = waivers_for(propose(sheet, "it.eds", link), watched=watched, braked=braked)
        names = {"master watch": watched, "quick-stop ramp": braked, "spring watch": sprung}
        assert list(found) == [name for name, has in names.items() if not has]
