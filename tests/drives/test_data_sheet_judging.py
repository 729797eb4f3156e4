"""What a data sheet says of a drive against what that drive, worn by an emulated one, does."""

import random
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from drives_rig import config
from eds_texts import Sheet, stranger

from legbench.commissioning.learn import check, learn, write_bus
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.errors import DriveError
from legbench.drives.master.session import Session
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.objects import Key
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.config import (
    CONTROLWORD,
    LINK_POSITION,
    POSITION_ACTUAL,
    STATUSWORD,
    TARGET_POSITION,
    BusConfig,
    NodeConfig,
    PdoConfig,
)
from legbench.drives.setup.outcome import ObjectOutcome
from legbench.drives.setup.taken import check_taken
from legbench.drives.sheet.bus_text import marked_lines
from legbench.drives.sheet.candidates import link_candidates, temperature_candidates
from legbench.drives.sheet.data_sheet import DataSheet
from legbench.drives.sheet.load import sheet_of
from legbench.drives.sheet.mapping import choose
from legbench.drives.sheet.predict import predict
from legbench.errors import ConfigError

U8, U32, I32 = DataType.UNSIGNED8, DataType.UNSIGNED32, DataType.INTEGER32
TPDOS = (
    PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL)),
    PdoConfig(number=2, objects=(LINK_POSITION,)),
)


def read(sheet: Sheet) -> DataSheet:
    return sheet_of(sheet.text().encode(), "it.eds")


def bus_of(eds: Path) -> BusConfig:
    """The rig's bus on drives of a data sheet."""
    return config(nodes=tuple(_on(one, eds) for one in config().nodes))


def _on(one: NodeConfig, eds: Path) -> NodeConfig:
    assert one.link is not None
    link = replace(one.link, bits=32)
    return replace(one, eds=eds, link=link, link_object=LINK_POSITION, tpdos=TPDOS)


def really(bus: BusConfig) -> tuple[ObjectOutcome, ...]:
    """What an emulated drive makes of its configuration, by SDO on the wire."""
    with Session(LockstepBus("it", network=emulate(bus)), bus) as session:
        up = session.bring_up()
        up.identify()
        up.pre_operational()
        return up.configure(bus.nodes[0])


def same(outcomes: tuple[ObjectOutcome, ...]) -> list[tuple[object, ...]]:
    return [(one.parameter.key, one.agrees, one.there, one.code) for one in outcomes]


QUIRKS: dict[str, Callable[[Sheet], object]] = {
    "nothing": lambda it: it,
    "no SYNC objects": lambda it: it.without(0x1005, 0x1006, 0x1007),
    "SYNC is constant": lambda it: it.fixed({(0x1005, 0): "0x80"}),
    "no heartbeat consumer": lambda it: it.without(0x1016),
    "no heartbeat": lambda it: it.without(0x1017),
    "no deadline": lambda it: it.without((0x1400, 5)),
    "no error behaviour": lambda it: it.without(0x1029),
    "no reaction": lambda it: it.without(0x6007),
    "reaction is a fault": lambda it: it.fixed({(0x6007, 0): "1"}, "ro"),
    "no stop options": lambda it: it.without(0x605A, 0x605B, 0x605C, 0x605D, 0x605E),
    "stays in quick stop": lambda it: it.fixed({(0x605A, 0): "6"}),
    "no offsets": lambda it: it.without(0x60B0, 0x60B1, 0x60B2, 0x607E),
    "no ramp": lambda it: it.without(0x6085),
    "no interpolation": lambda it: it.without(0x60C2),
    "fixed power of ten": lambda it: it.fixed({(0x60C2, 2): "-4"}),
    "one PDO each way more": lambda it: _pdo(it, 5),
    "three PDOs": lambda it: it.without(0x1403, 0x1603, 0x1803, 0x1A03),
    "two PDOs": lambda it: it.without(
        *(base + place for base in (0x1400, 0x1600, 0x1800, 0x1A00) for place in (2, 3))
    ),
    "fixed mapping that is right": lambda it: it.fixed(
        {
            (0x1600, 0): "2",
            (0x1600, 1): "0x60400010",
            (0x1600, 2): "0x607A0020",
            (0x1A00, 0): "2",
            (0x1A00, 1): "0x60410010",
            (0x1A00, 2): "0x60640020",
        },
        "ro",
    ),
    "constant COB-IDs, mapped right": lambda it: it.fixed(
        {(0x1400, 1): "$NODEID+0x200", (0x1800, 1): "$NODEID+0x40000180"}
    ).fixed(
        {
            (0x1600, 0): "2",
            (0x1600, 1): "0x60400010",
            (0x1600, 2): "0x607A0020",
            (0x1A00, 0): "2",
            (0x1A00, 1): "0x60410010",
            (0x1A00, 2): "0x60640020",
        },
        "rw",
    ),
    "numbers longer than the profile's": lambda it: _sized(
        it,
        {
            DataType.INTEGER16: ((0x6060, 0), (0x6061, 0), (0x60C2, 2)),
            DataType.UNSIGNED16: ((0x60C2, 1), (0x607E, 0), (0x1029, 1), (0x1400, 2)),
            U32: ((0x1017, 0), (0x1400, 5), (0x1018, 1)),
            I32: ((0x60B2, 0), (0x605A, 0)),
        },
    ),
    "numbers shorter than the profile's": lambda it: _sized(
        it,
        {
            DataType.INTEGER8: ((0x605A, 0), (0x6007, 0), (0x60B0, 0)),
            DataType.UNSIGNED16: ((0x1006, 0), (0x6065, 0), (0x1018, 2)),
        },
    ),
    "signs that are wrong": lambda it: _sized(
        it, {U8: ((0x6060, 0), (0x6061, 0)), DataType.UNSIGNED16: ((0x605E, 0), (0x6007, 0))}
    ),
    "fixed times": lambda it: it.fixed({(0x1017, 0): "30", (0x1006, 0): "0"}),
}


def _sized(it: Sheet, kinds: dict[DataType, tuple[Key, ...]]) -> Sheet:
    """Objects of other types."""
    for kind, keys in kinds.items():
        for key in keys:
            it.entries[key].kind = int(kind)
    return it


def _pdo(it: Sheet, number: int) -> Sheet:
    """One more PDO each way, both switched on."""
    for base, first in ((0x1400, 0x4F0), (0x1800, 0x4D0)):
        comm = base + number - 1
        it.add((comm, 0), U8, "const", default="2", mappable=False)
        it.add((comm, 1), U32, "rw", default=f"$NODEID+0x{first:X}", mappable=False)
        it.add((comm, 2), U8, "rw", default="255", mappable=False)
        it.add((comm + 0x200, 0), U8, "rw", default="0", mappable=False)
        it.add((comm + 0x200, 1), U32, "rw", default="0", mappable=False)
    return it


@pytest.mark.parametrize("name", list(QUIRKS))
def test_what_is_predicted_is_what_the_drive_makes_of_it(name: str, tmp_path: Path) -> None:
    sheet = stranger()
    QUIRKS[name](sheet)
    (tmp_path / "it.eds").write_text(sheet.text(), encoding="utf-8")
    bus = bus_of(tmp_path / "it.eds")
    assert same(predict(read(sheet), bus, bus.nodes[0])) == same(really(bus))


REFUSED: dict[str, tuple[Callable[[Sheet], object], str]] = {
    "fixed mapping that is another": (
        lambda it: it.fixed({(0x1600, 0): "1", (0x1600, 1): "0x60400010"}, "ro"),
        "1600h:00 .*read only object.*holds 1, wanted 2; it is required: process data",
    ),
    "an offset that stays": (
        lambda it: it.fixed({(0x60B0, 0): "100"}),
        "60B0h:00 Position offset: .*holds 100, wanted 0; .*must be 0",
    ),
    "another cycle": (lambda it: it.fixed({(0x60C2, 2): "-2"}), "60C2h:02"),
    "constant COB-ID, mapped otherwise": (
        lambda it: it.fixed({(0x1400, 1): "$NODEID+0x200"}),
        "1600h:00 .*present device state.*it is required: process data",
    ),
    "commands at once": (lambda it: it.fixed({(0x1400, 2): "255"}), "1400h:02 .*act at SYNC"),
    "drops at quick stop": (lambda it: it.fixed({(0x605A, 0): "0"}), "605Ah:00 .*braking by quick"),
    "no command frame": (lambda it: it.without(0x1400, 0x1600), "1400h:01"),
}


@pytest.mark.parametrize("name", list(REFUSED))
def test_what_cannot_be_used_is_refused_by_both_in_one_line(name: str, tmp_path: Path) -> None:
    quirk, words = REFUSED[name]
    sheet = stranger()
    quirk(sheet)
    (tmp_path / "it.eds").write_text(sheet.text(), encoding="utf-8")
    bus = bus_of(tmp_path / "it.eds")
    with pytest.raises(DriveError, match=words) as caught:
        really(bus)
    assert "\n" not in str(caught.value)
    failed = [one for one in predict(read(sheet), bus, bus.nodes[0]) if not one.passes]
    assert failed
    assert failed[0].name in str(caught.value)


def test_random_combinations_are_predicted_or_refused_alike(tmp_path: Path) -> None:
    chance = random.Random(11)
    refused = 0
    for _ in range(25):
        names = chance.sample(list(QUIRKS) + list(REFUSED), 4)
        sheet = stranger()
        for name in names:
            quirk = QUIRKS[name] if name in QUIRKS else REFUSED[name][0]
            try:
                quirk(sheet)
            except KeyError:  # Another quirk has taken the object away.
                continue
        (tmp_path / "it.eds").write_text(sheet.text(), encoding="utf-8")
        bus = bus_of(tmp_path / "it.eds")
        found = predict(read(sheet), bus, bus.nodes[0])
        if all(one.passes for one in found):
            assert same(found) == same(really(bus)), names
        else:
            refused += 1
            with pytest.raises(DriveError):
                really(bus)
    assert 5 < refused < 20


# --- proposing -------------------------------------------------------------------------------


def learned_by(tmp_path: Path, sheet: Sheet, **more: Any) -> BusConfig:
    (tmp_path / "it.eds").write_text(sheet.text(), encoding="utf-8")
    out = tmp_path / "leg.toml"
    found = learn(tmp_path / "it.eds", out, **more)
    assert found.problems == ()
    write_bus(found, out)
    assert check(out).problems == ()
    return load_bus(out)


def test_a_proposed_bus_is_what_the_drive_can_do(tmp_path: Path) -> None:
    sheet = stranger().without(0x1016, 0x6085, 0x6066).fixed({(0x6072, 0): "500"})
    bus = learned_by(tmp_path, sheet, node_ids=(5, 9))
    assert [one.node_id for one in bus.nodes] == [5, 9]
    for one in bus.nodes:
        assert (one.identity.vendor, one.identity.product) == (0xABCDEF, 0x77)
        assert one.identity.serial is None
        assert one.link_object == LINK_POSITION
        assert [pdo.objects for pdo in one.rpdos] == [(CONTROLWORD, TARGET_POSITION)]
        assert one.rpdos[0].deadline_ms == 20
        assert [hex(entry.index) for entry in one.parameters] == ["0x6065", "0x6084"]
        assert one.eds == tmp_path / "it.eds"
    assert bus.waive == ()
    text = (tmp_path / "leg.toml").read_text(encoding="utf-8")
    lines = text.splitlines()
    marked = [lines[number - 1] for number in marked_lines(text)]
    for word in ("serial", "counts_per_rev", "gear", "sign", "offset_counts", "link_object"):
        assert sum(line.lstrip("# ").startswith(word) for line in marked) >= 2, word
    check_taken(bus, {one.name: predict(read(sheet), bus, one) for one in bus.nodes})


def test_a_drive_with_one_encoder_leads_a_leg_by_its_torque_or_tells_none(tmp_path: Path) -> None:
    bus = learned_by(tmp_path, stranger().without(0x60E4))
    assert bus.period_us == 1000
    assert all(one.link is None for one in bus.nodes)
    assert {str(one.torque_object) for one in bus.nodes} == {"6077h:00"}
    (tmp_path / "leg.toml").unlink()
    bus = learned_by(tmp_path, stranger().without(0x60E4, 0x6077))
    assert {one.torque_object for one in bus.nodes} == {None}
    assert bus.waive == ("spring watch",)
    findings = {one.object: one for one in check(tmp_path / "leg.toml").assessments[0].findings}
    assert "controllers that need them are refused" in findings["second position"].remark
    # Two encoders of 32 bits need two answers of each drive, and so a longer period.
    (tmp_path / "leg.toml").unlink()
    assert learned_by(tmp_path, stranger()).period_us == 2000


def test_the_period_is_one_that_the_drive_takes(tmp_path: Path) -> None:
    for exponent, value, period_us in ((-3, 4, 4000), (-4, 20, 2000), (-3, 1, 1000)):
        sheet = (
            stranger().without(0x60E4).fixed({(0x60C2, 1): str(value), (0x60C2, 2): str(exponent)})
        )
        assert learned_by(tmp_path, sheet).period_us == period_us
        (tmp_path / "leg.toml").unlink()


def test_a_ramp_in_a_unit_of_the_makers_own_is_no_ramp(tmp_path: Path) -> None:
    sheet = stranger()
    sheet.entries[0x6085, 0].limits = ("0", "60000")
    bus = learned_by(tmp_path, sheet)
    given = {entry.index for entry in bus.nodes[0].parameters}
    assert 0x6084 in given
    assert 0x6085 not in given
    # Without 605Ah, or where it stays, a quick stop brakes on 6085h (CiA 402-2).
    bare = sheet.without(0x605A).text()
    (tmp_path / "it.eds").write_text(bare, encoding="utf-8")
    assert "does not brake on 6084h:00" in check(tmp_path / "leg.toml").problems[0]
    (tmp_path / "leg.toml").unlink()
    assert learned_by(tmp_path, sheet).waive == ("quick-stop ramp",)
    (tmp_path / "leg.toml").unlink()
    for option, waived in (("6", True), ("1", False), ("5", False)):
        sheet.add((0x605A, 0), DataType.INTEGER16, default=option)
        assert (learned_by(tmp_path, sheet).waive == ("quick-stop ramp",)) is waived
        (tmp_path / "leg.toml").unlink()
    sheet.add((0x605A, 0), DataType.INTEGER16, "rw", default="2")
    sheet.entries[0x6084, 0].limits = ("0", "60000")
    assert learned_by(tmp_path, sheet).waive == ("quick-stop ramp",)


def test_what_nothing_replaces_is_waived_by_name_and_said(tmp_path: Path) -> None:
    bus = learned_by(tmp_path, stranger().without(0x6007, 0x6084, 0x6085))
    assert bus.waive == ("master watch", "quick-stop ramp")
    assert "These drives lack" in (tmp_path / "leg.toml").read_text(encoding="utf-8")


def test_a_file_that_is_there_is_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "it.eds").write_text(stranger().text(), encoding="utf-8")
    out = tmp_path / "leg.toml"
    out.write_text("mine", encoding="utf-8")
    with pytest.raises(ConfigError, match="is there already, and is left as it is"):
        write_bus(learn(tmp_path / "it.eds", out), out)
    assert out.read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda it: it.fixed({(0x6502, 0): "0x41"}, "ro"), "6502h:00 is 0x41: .*no cyclic synch"),
        (lambda it: it.fixed({(0x1000, 0): "0x00020191"}), "1000h:00 is 00020191h: it is no CiA"),
        (lambda it: it.without(0x6041), "6041h:00 Statusword is missing"),
        (
            lambda it: it.without(0x1400, 0x1401, 0x1402, 0x1403),
            "its RPDOs cannot carry 6040h:00, 607Ah:00 .*it has no RPDO",
        ),
        (lambda it: it.without(0x1018), "1018h:01 Vendor-ID is missing"),
    ],
)
def test_a_drive_that_cannot_lead_a_leg_is_refused_by_object(
    change: Callable[[Sheet], Sheet], words: str, tmp_path: Path
) -> None:
    (tmp_path / "it.eds").write_text(change(stranger()).text(), encoding="utf-8")
    try:
        found = learn(tmp_path / "it.eds", tmp_path / "leg.toml")
    except ConfigError as error:
        problems = [str(error)]
    else:
        problems = list(found.problems)
    assert any(re.search(words, line) for line in problems), problems


def test_types_of_the_bus_file_follow_the_sheet(tmp_path: Path) -> None:
    sheet = stranger().add((0x60E4, 1), DataType.UNSIGNED32)
    (tmp_path / "it.eds").write_text(sheet.text(), encoding="utf-8")
    bus = learned_by(tmp_path, sheet)
    assert bus.nodes[0].link_object.kind is DataType.UNSIGNED32
    out = tmp_path / "leg.toml"
    text = out.read_text(encoding="utf-8")
    changed = text.replace("60E4:01 u32", "60E4:01 i32").replace("lowest_count = 0", "")
    out.write_text(changed, encoding="utf-8")
    (problem, *_) = check(out).problems
    assert (
        "60E4h:01 Additional position actual value 1 (link) is of type u32, the bus file" in problem
    )
    assert problem.endswith('write "60E4:01 u32"')
    # A value is written in the drive's own length, if it fits.
    sheet.entries[0x6065, 0].kind = DataType.UNSIGNED16
    sheet.entries[0x6065, 0].default = "0"
    (tmp_path / "it.eds").write_text(sheet.text(), encoding="utf-8")
    out.write_text(text, encoding="utf-8")
    assert not check(out).problems
    out.write_text(text.replace('"6065:00 u32" = 2', '"6065:00 u32" = 92', 1), encoding="utf-8")
    (problem,) = check(out).problems
    assert "6065h:00 Following error window: data type does not match, length does not" in problem


def test_second_positions_and_temperatures_are_told_by_profile_and_name() -> None:
    sheet = stranger().without(0x60E4)
    sheet.add((0x2100, 0), I32, name="second encoder value")
    sheet.add((0x2101, 0), DataType.UNSIGNED16, name="i2t over load value")
    sheet.add((0x2102, 1), I32, name="Auxiliary feedback")
    sheet.add((0x2103, 0), I32, name="link position offset")
    sheet.add((0x2104, 0), I32, name="load position", mappable=False)
    sheet.add((0x2105, 0), DataType.INTEGER8, name="Motor Temperature")
    sheet.add((0x2106, 0), DataType.INTEGER8, name="Temperature limit")
    sheet.add((0x2107, 0), 0x08, name="Stage temperature", default="1.0")
    found = read(sheet)
    assert [str(one) for one in link_candidates(found)] == ["2100h:00", "2102h:01"]
    assert [str(one) for one in temperature_candidates(found)] == ["2105h:00", "2107h:00"]


def test_frames_whose_identifier_or_type_is_fixed_otherwise_are_left_alone() -> None:
    sheet = stranger().fixed({(0x1400, 1): "0x205", (0x1401, 2): "255"})
    sheet.fixed({(0x1402, 1): "$NODEID+0x400", (0x1402, 2): "1"}, "ro")
    commands = choose(read(sheet), (CONTROLWORD, TARGET_POSITION), commands=True)
    assert [pdo.number for pdo in commands or ()] == [4]
    fixed = {(0x1602, 0): "2", (0x1602, 1): "0x60400010", (0x1602, 2): "0x607A0020"}
    sheet.fixed(fixed, "rw").without(0x1403)
    commands = choose(read(sheet), (CONTROLWORD, TARGET_POSITION), commands=True)
    assert [pdo.number for pdo in commands or ()] == [3]


def test_the_highest_bitrate_of_the_drive_is_proposed(tmp_path: Path) -> None:
    sheet = stranger().without(0x60E4, (0x1018, 2))
    sheet.head = sheet.head.replace("BaudRate_1000=1", "Baudrate_500=1\nBaudRate_125=1")
    bus = learned_by(tmp_path, sheet)
    assert (bus.bitrate, bus.period_us) == (500_000, 2000)
    assert {one.identity.product for one in bus.nodes} == {None}


def test_process_data_is_carried_by_fixed_frames_where_nothing_is_free() -> None:
    short = Mapped(0x2100, 0, DataType.INTEGER16)
    sheet = stranger().add((0x2100, 0), DataType.INTEGER16, name="second encoder")
    fixed: dict[tuple[int, int], str] = {}
    for number, words in enumerate(
        (("60410010",), ("60410010", "60610008"), ("60410010", "60640020"), ("21000010",)), start=0
    ):
        fixed[0x1A00 + number, 0] = str(len(words))
        fixed |= {(0x1A00 + number, sub): f"0x{word}" for sub, word in enumerate(words, start=1)}
        rpdo = (("60400010",), ("60400010", "60720010"), ("60400010", "607A0020"), ())[number]
        fixed[0x1600 + number, 0] = str(len(rpdo))
        fixed |= {(0x1600 + number, sub): f"0x{word}" for sub, word in enumerate(rpdo, start=1)}
    found = read(sheet.fixed(fixed, "ro"))
    commands = choose(found, (CONTROLWORD, TARGET_POSITION), commands=True)
    answers = choose(found, (STATUSWORD, POSITION_ACTUAL, short), commands=False)
    assert [pdo.number for pdo in commands or ()] == [3]
    assert [pdo.number for pdo in answers or ()] == [3, 4]
    assert choose(found, (STATUSWORD, POSITION_ACTUAL, LINK_POSITION), commands=False) is None
