"""A bus file held against data sheets: each object that is there, fixed or missing, by its name."""

from collections.abc import Sequence
from dataclasses import replace

import pytest
from drives_rig import config
from test_sheet_proposals import I16, I32, U8, U16, U32, drive, entry, with_objects

from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.objects import Access, Key
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.protocol.sdo import Abort
from legbench.drives.setup.config import (
    LINK_POSITION,
    POSITION_ACTUAL,
    STATUSWORD,
    NodeConfig,
    Parameter,
    PdoConfig,
)
from legbench.drives.sheet.assess import Assessment, State, assess, short_name
from legbench.drives.sheet.data_sheet import DataSheet
from legbench.drives.sheet.predict import predict

TPDOS = (
    PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL)),
    PdoConfig(number=2, objects=(LINK_POSITION,)),
)


def node(**changes: object) -> NodeConfig:
    """The rig's first node, its link shown by 60E4h."""
    one = config().nodes[0]
    assert one.link is not None
    usual = {"link": replace(one.link, bits=32), "link_object": LINK_POSITION, "tpdos": TPDOS}
    return replace(one, **(usual | changes))  # pyrefly: ignore[bad-argument-type]


def assessed(sheet: DataSheet, **changes: object) -> Assessment:
    return assess(sheet, config(), node(**changes))


def table(found: Assessment) -> dict[str, tuple[str, str, str]]:
    """Object, by its number -> need, state and remark."""
    rows = [(one.object[:8], (one.need, one.state.value, one.remark)) for one in found.findings]
    assert len(dict(rows)) == len(rows)
    return dict(rows)


CYCLE = ["6040h:00", "6041h:00", "6061h:00", "6064h:00", "607Ah:00"]
READ = {
    "1000h:00": "required",
    "1018h:01": "required",
    "1018h:02": "optional",
    "1018h:04": "optional",
    "603Fh:00": "optional",
}
NO_VALUE = ["6065h:00", "6072h:00", "607Dh:01", "6085h:00"]
"""Protections of which the bus file of the rig says nothing."""


def test_a_complete_drive_has_all_that_a_run_needs() -> None:
    found = assessed(drive())
    shown = table(found)
    assert found.node == "hip"
    assert found.problems == ()
    assert list(shown)[:10] == [*CYCLE, *READ]
    assert {name: shown[name][0] for name in CYCLE} == dict.fromkeys(CYCLE, "required")
    assert {name: shown[name][0] for name in READ} == READ
    assert {state for _, state, _ in shown.values()} == {"has"}
    assert [name for name, row in shown.items() if row[2]] == NO_VALUE == list(shown)[-4:]
    window = "the bus file gives no value; not protected by the drive's own following error window"
    assert shown["6065h:00"] == (
        "protection",
        "has",
        f"{window}; instead: following_error of the limits file, in the master",
    )
    # Mappings are told with their PDO, and not an object at a time.
    assert not [name for name in shown if name[:2] in ("16", "1A")]
    assert {"1400h:01", "1400h:02", "1400h:05", "1800h:01", "1801h:02"} <= shown.keys()
    assert [line[:8] for line in found.unprotected] == NO_VALUE
    assert found.unprotected[0] == f"6065h:00 Following error window: {shown['6065h:00'][2]}"
    # A period and the 20 ms of the deadline, or the 30 ms of the consumer.
    assert [(one.name.split()[0], one.time_ms) for one in found.means] == [
        ("deadline", 21.0),
        ("heartbeat", 31.0),
    ]


@pytest.mark.parametrize("name", CYCLE)
def test_an_object_of_every_cycle_is_there_or_the_drive_is_no_use(name: str) -> None:
    found = assessed(drive((int(name[:4], 16), 0)))
    assert table(found)[name] == ("required", "lacks", "")
    mine = [line for line in found.problems if line.startswith(name)]
    assert any(line.endswith("is missing; no drive runs without it") for line in mine)


@pytest.mark.parametrize(
    ("key", "unknown"),
    [
        ((0x1000, 0), "the device type"),
        ((0x1018, 1), "the vendor"),
        ((0x1018, 2), "the product"),
        (
            (0x1018, 4),
            "the serial number: two drives of a kind that are swapped are not told apart",
        ),
        ((0x603F, 0), "the reason of a fault, but for what an emergency message says"),
    ],
)
def test_what_is_read_and_is_not_there_is_not_known(key: Key, unknown: str) -> None:
    name = f"{key[0]:04X}h:{key[1]:02X}"
    found = assessed(drive(key))
    assert table(found)[name] == (READ[name], "lacks", f"not known is {unknown}")
    assert found.unprotected[0].startswith(f"{name} ")
    assert found.unprotected[0].endswith(f": not known is {unknown}")
    needed = key in ((0x1000, 0), (0x1018, 1))
    assert [line.startswith(name) for line in found.problems] == [True] * needed
    if needed:
        assert found.problems[0].endswith(" is missing; no drive runs without it")


def test_a_protection_that_is_not_there_is_told_with_what_takes_its_place() -> None:
    found = assessed(drive((0x6072, 0)))
    remark = "the drive has no such object; not protected by the limit of torque; instead: "
    assert table(found)["6072h:00"][1] == "lacks"
    assert table(found)["6072h:00"][2].startswith(remark)
    # What is written and refused or missing, in the words of its outcome.
    lacking = table(assessed(drive((0x1029, 0), (0x1029, 1))))["1029h:01"]
    assert lacking[:2] == ("optional", "lacks")
    reaction = assessed(with_objects(drive(), entry((0x6007, 0), I16, default=1)))
    assert table(reaction)["6007h:00"][1] == "fixed"
    assert reaction.problems == ()
    lines = [line for line in reaction.unprotected if line.startswith("6007h:00")]
    assert [line.partition(": ")[2] for line in lines] == [table(reaction)["6007h:00"][2]]
    required = assessed(with_objects(drive(), entry((0x6060, 0), DataType.INTEGER8, default=1)))
    assert table(required)["6060h:00"][1] == "fixed"
    assert [line[:8] for line in required.problems] == ["6060h:00"]
    # What has to be refused is a problem, and no mere loss.
    assert not [line for line in required.unprotected if line.startswith("6060h:00")]
    may_lack = table(assessed(drive((0x60B0, 0))))["60B0h:00"]
    assert may_lack == ("if present", "lacks", "where it is missing nothing is lost")


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        # CiA 402: profile 0192h in the low word; bit 7 of 6502h is the cyclic position mode.
        ((0x1000, 0), 0x0002_0192, None),
        ((0x1000, 0), 0xFFFF_0192, None),
        ((0x1000, 0), 0x0002_0191, "1000h:00 is 00020191h: it is no CiA 402 drive"),
        ((0x6502, 0), 0x80, None),
        ((0x6502, 0), 0xFFFF_FF7F, "6502h:00 is 0xffffff7f: it knows no cyclic synchronous"),
    ],
)
def test_a_drive_of_another_profile_or_without_the_mode_is_no_use(
    key: Key, value: int, told: str | None
) -> None:
    problems = assessed(with_objects(drive(), entry(key, U32, default=value))).problems
    assert len(problems) == (told is not None)
    assert told is None or problems[0].startswith(told)
    # Where the data sheet does not tell it, it is not held against it.
    silent = drive()
    assert assessed(replace(silent, given=silent.given - {key})).problems == ()


def refused(sheet: DataSheet, **changes: object) -> list[str]:
    return list(assessed(sheet, **changes).problems)


def pdos(*objects: Sequence[Mapped]) -> tuple[PdoConfig, ...]:
    return tuple(
        PdoConfig(number=place, objects=tuple(each)) for place, each in enumerate(objects, 1)
    )


@pytest.mark.parametrize(
    ("shown", "told"),
    [
        (Mapped(0x3000, 2, I32), "3000h:02 cannot be mapped; map another object in the bus file"),
        (Mapped(0x3000, 3, I32), "3000h:03 is missing; name another object in the bus file"),
        (
            Mapped(0x60E4, 1, U32),
            "60E4h:01 Additional position actual value 1 (link) is of type i32, the bus file says "
            'u32: write "60E4:01 i32"',
        ),
    ],
)
def test_process_data_is_there_in_its_type_and_can_be_mapped(shown: Mapped, told: str) -> None:
    sheet = with_objects(drive(), entry((0x3000, 2), I32, mappable=False))
    usual = node().link
    assert usual is not None
    link = replace(usual, lowest_count=0) if shown.kind is U32 else usual
    for answers in (
        pdos((STATUSWORD, POSITION_ACTUAL), (shown,)),
        pdos((STATUSWORD, shown), (POSITION_ACTUAL,)),
    ):
        assert refused(sheet, tpdos=answers, link=link, link_object=shown) == [told]


def test_a_fixed_mapping_may_carry_what_cannot_be_mapped_otherwise() -> None:
    sheet = with_objects(drive(), entry((0x60E4, 1), I32, mappable=False))
    assert len(refused(sheet)) == 1
    mapped = with_objects(
        sheet,
        entry((0x1A01, 0), U8, Access.RW, default=1),
        entry((0x1A01, 1), U32, Access.RW, default=0x60E40120),
    )
    assert refused(mapped) == []


def test_a_command_frame_carries_what_can_be_written() -> None:
    for access, told in ((Access.RW, 0), (Access.WO, 0), (Access.RO, 1), (Access.CONST, 1)):
        sheet = with_objects(drive(), entry((0x607A, 0), I32, access))
        found = [line for line in refused(sheet) if "read-only; a command frame" in line]
        assert [line[:8] for line in found] == ["607Ah:00"] * told


def test_a_pdo_that_is_not_there_is_told_with_those_that_are() -> None:
    gone = drive((0x1801, 1))
    assert refused(gone)[0] == "it has no TPDO2; it has 1, 3, 4: give one of these in the bus file"
    gone = drive(*[(0x1400 + place, 1) for place in range(4)])
    assert refused(gone)[0] == "it has no RPDO1; it has none: give one of these in the bus file"


def test_a_temperature_that_is_polled_is_an_object_of_its_type() -> None:
    for asked, told in (
        (Mapped(0x2070, 0, I16), None),
        (Mapped(0x2070, 0, U8), "is of type i16, the bus file says u8"),
        (Mapped(0x2071, 0, I16), "2071h:00 is missing"),
    ):
        found = refused(drive(), temperature_object=asked, temperature_scale=1.0)
        assert len(found) == (told is not None)
        assert told is None or told in found[0]


def test_a_joint_with_one_encoder_is_told_with_what_is_not_known() -> None:
    one = pdos((STATUSWORD, POSITION_ACTUAL, Mapped(0x6077, 0, I16)))
    found = {}
    for torque in (None, Mapped(0x6077, 0, I16)):
        changes = {"link": None, "link_object": None, "tpdos": one}
        if torque is not None:
            changes |= {"torque_object": torque, "torque_scale": 0.01}
        found[torque] = table(assessed(drive(), **changes))["second p"]
    assert "second p" not in table(assessed(drive()))
    first, second = found.values()
    assert first[:2] == second[:2] == ("optional", "lacks")
    assert first[2].startswith("not known are the torque of the spring and the position of the")
    assert second[2] == (
        "the spring's torque is the drive's own (6077h:00), inertia and friction in it"
    )


def test_types_have_the_names_of_bus_files() -> None:
    names = {I16: "i16", I32: "i32", U8: "u8", U16: "u16", U32: "u32"}
    assert {kind: short_name(kind) for kind in names} == names
    assert [state.value for state in State] == ["has", "fixed", "lacks"]


# --- what becomes of what is written ---------------------------------------------------------


def test_a_value_beyond_a_limit_of_the_data_sheet_is_refused_on_its_side() -> None:
    sheet = drive(limits={(0x6065, 0): (10, 40_000)})
    for value, code in ((9, Abort.TOO_LOW), (10, None), (40_000, None), (40_001, Abort.TOO_HIGH)):
        given = Parameter(index=0x6065, sub=0, kind=U32, value=value)
        (found,) = [
            one
            for one in predict(sheet, config(), node(parameters=(given,)))
            if one.parameter.key == (0x6065, 0)
        ]
        assert found.code == code
        assert found.there == (value if code is None else sheet.default((0x6065, 0), 1))


def test_pdos_beyond_the_fourth_that_are_on_are_switched_off() -> None:
    more = []
    for comm, cobs in ((0x1400, (0x4F0, 0x8000_04F1, 0)), (0x1800, (0x4000_04D0, 0x4D1))):
        for place, cob in enumerate(cobs, start=4):
            more += [
                entry((comm + place, 1), U32, Access.RW, cob, mappable=False),
                entry((comm + place + 0x200, 0), U8, Access.RW, mappable=False),
            ]
    sheet = with_objects(drive(), *more)
    written = {one.parameter.key: one.parameter.value for one in predict(sheet, config(), node())}
    # Bit 31 says that a PDO is not there (CiA 301); 29 bits below are its identifier.
    beyond = {key: value for key, value in written.items() if key[0] & 0x1FF >= 4 and key[1] == 1}
    beyond = {key: value for key, value in beyond.items() if 0x1400 <= key[0] < 0x1A00}
    assert beyond == {
        (0x1404, 1): 0x8000_04F0,
        (0x1406, 1): 0x8000_0000,
        (0x1804, 1): 0x8000_04D0,
        (0x1805, 1): 0x8000_04D1,
    }


def test_what_is_refused_at_first_may_be_taken_later_or_as_another_value() -> None:
    def outcome(key: Key, limits: tuple[int, int]) -> tuple[int | None, int | None]:
        found = predict(drive(limits={key: limits}), config(), node())
        return next((one.code, one.there) for one in found if one.parameter.key == key)

    # A PDO that cannot be switched off is mapped as it is, and its identifier written in the end.
    assert outcome((0x1400, 1), (0, 0x7FFF_FFFF)) == (None, 0x201)
    # CiA 402: 3 is a quick stop by 6007h, and 1 a fault; 2 and 6 are a quick stop on its ramp.
    assert outcome((0x6007, 0), (0, 3)) == (None, 3)
    assert outcome((0x6007, 0), (0, 2)) == (None, 1)
    assert outcome((0x605A, 0), (5, 8)) == (None, 6)
    assert outcome((0x605A, 0), (7, 8)) == (Abort.TOO_LOW, 2)
