"""What a data sheet tells of its objects, which may be readings, and what its PDOs can carry."""

import itertools
from dataclasses import replace

import pytest
from test_sheet_proposals import I16, I32, U8, U16, U32, drive, entry, with_objects

from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.objects import MAX_MAPPED, OBJECTS, Access, Key
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import PdoConfig
from legbench.drives.sheet.candidates import link_candidates, temperature_candidates
from legbench.drives.sheet.data_sheet import DataSheet, positions, profile_default
from legbench.drives.sheet.mapping import choose
from legbench.drives.sheet.propose import ONE_ENCODER, propose
from legbench.errors import ConfigError

STATUSWORD, POSITION = Mapped(0x6041, 0, U16), Mapped(0x6064, 0, I32)
CONTROLWORD, TARGET = Mapped(0x6040, 0, U16), Mapped(0x607A, 0, I32)
LINK = Mapped(0x60E4, 1, I32)


# --- objects ---------------------------------------------------------------------------------


def test_a_default_is_known_where_it_is_told_and_may_be_added_to_the_node_id() -> None:
    sheet = drive()
    assert sheet.default((0x1800, 1), 5) == OBJECTS[0x1800, 1].default + 5  # pyrefly: ignore
    assert sheet.default((0x6041, 0), 5) == 0
    assert replace(sheet, given=frozenset()).default((0x1800, 1), 5) is None
    assert drive((0x1800, 1)).default((0x1800, 1), 5) is None
    # A text is no number.
    assert sheet.default((0x1008, 0), 5) is None


def test_pdos_are_those_with_an_identifier_and_a_mapping() -> None:
    for commands, comm, mapping in ((True, 0x1400, 0x1600), (False, 0x1800, 0x1A00)):
        assert drive().pdos(commands=commands) == (1, 2, 3, 4)
        for missing in ((comm + 1, 1), (mapping + 1, 0)):
            assert drive(missing).pdos(commands=commands) == (1, 3, 4)
        assert drive((comm + 1, 2), (mapping + 1, 1)).pdos(commands=commands) == (1, 2, 3, 4)


def test_a_mapping_is_as_long_as_its_count_says() -> None:
    for commands, mapping in ((True, 0x1600), (False, 0x1A00)):
        for number in (1, 3):
            index = mapping + number - 1
            words = (0x60400010, 0, 0x607A0020)
            sheet = with_objects(
                drive(),
                *(entry((index, sub), U32, default=word) for sub, word in enumerate(words, 1)),
                *(entry((index, sub), U32, default=sub) for sub in range(4, 70)),
            )
            for count, mapped in ((0, ()), (1, words[:1]), (2, words[:1]), (3, words[::2])):
                it = with_objects(sheet, entry((index, 0), U8, default=count))
                assert it.mapped(number, commands=commands) == mapped
            it = with_objects(sheet, entry((index, 0), U8, default=69))
            # CiA 301: 64 objects at most.
            assert it.mapped(number, commands=commands)[-1] == 64


def test_a_pdo_can_be_mapped_anew_where_all_of_it_can_be_written() -> None:
    for commands, comm in ((True, 0x1400), (False, 0x1800)):
        for number in (1, 2):
            it, mapping = comm + number - 1, comm + 0x200 + number - 1
            for fixed, room in (
                ((it, 2), MAX_MAPPED),
                ((mapping, MAX_MAPPED), MAX_MAPPED - 1),
                ((mapping, 3), 2),
                ((mapping, 1), 0),
                ((mapping, 0), 0),
                ((it, 1), 0),
            ):
                for sheet in (drive(fixed), with_objects(drive(), entry(fixed, U32))):
                    assert sheet.room(number, commands=commands) == room
    # What can only be written can be written.
    only_written = with_objects(drive(), entry((0x1A00, 0), U8, Access.WO))
    assert only_written.room(1, commands=False) == MAX_MAPPED


def test_a_pdo_stays_on_where_its_identifier_is_valid_and_cannot_be_written() -> None:
    # CiA 301: bit 31 of the COB-ID says that the PDO does not exist.
    for cob, access, stays in (
        (0x181, Access.RO, True),
        (0x181, Access.CONST, True),
        (0x181, Access.RW, False),
        (0x8000_0181, Access.RO, False),
        (0, Access.RO, False),
    ):
        sheet = with_objects(drive(), entry((0x1800, 1), U32, access, cob))
        assert sheet.stays_on(0x1800) is stays
    assert not drive((0x1800, 1)).stays_on(0x1800)


def test_the_profile_gives_a_default_where_a_data_sheet_gives_none() -> None:
    known = OBJECTS[0x1400, 1].default
    assert isinstance(known, int)
    assert profile_default((0x1400, 1), U32) == known & 0x7FFF_FFFF
    assert profile_default((0x1400, 2), U8) == OBJECTS[0x1400, 2].default
    assert profile_default((0x6502, 0), U32) == OBJECTS[0x6502, 0].default
    assert profile_default((0x2999, 0), I32) == 0
    assert profile_default((0x2999, 0), DataType.VISIBLE_STRING) is None
    assert profile_default((0x2999, 0), DataType.OCTET_STRING) is None


# --- readings --------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", DataType)
def test_positions_are_numbers_of_16_or_32_bits_that_can_be_mapped_and_read(kind: DataType) -> None:
    key, whole = (0x3000, 1), kind in (I16, I32, U16, U32)
    for access in Access:
        for mappable in (True, False):
            thing = entry(key, kind, access, mappable=mappable)
            shown = any(one.key == key for one in positions(with_objects(drive(), thing)))
            assert shown is (whole and mappable and access is not Access.WO)


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("Second encoder position", True),
        ("LOAD POSITION", True),
        ("auxiliary feedback", True),
        ("position", False),
        ("second sensor", False),
        ("second encoder index", False),
        ("joint torque feedback", False),
    ],
)
def test_a_makers_object_is_told_by_its_name(name: str, found: bool) -> None:
    bare = drive((0x2064, 0), (0x60E4, 1))
    for index, maker in ((0x1FFF, False), (0x2000, True), (0x5FFF, True), (0x6000, False)):
        for access in (Access.RO, Access.CONST, Access.RW):
            sheet = with_objects(bare, entry((index, 3), I16, access, name=name))
            only = found and maker and access is not Access.RW
            assert link_candidates(sheet) == ((Mapped(index, 3, I16),) if only else ())
    # Those of the profile come first, whatever they are called.
    sheet = with_objects(drive((0x2064, 0)), entry((0x2000, 0), I16, name="link position"))
    assert link_candidates(sheet) == (LINK, Mapped(0x2000, 0, I16))


@pytest.mark.parametrize("kind", DataType)
def test_a_temperature_is_a_number_of_at_most_four_bytes_that_is_called_so(kind: DataType) -> None:
    numbers = [f"{sign}{bits}" for sign in ("INTEGER", "UNSIGNED") for bits in (8, 16, 32)]
    numbers.append("REAL32")
    bare = drive((0x2070, 0))
    for name, called in (
        ("Temperature of the motor", True),
        ("temperature limit", False),
        ("Warmth", False),
    ):
        for access in (Access.RO, Access.RW):
            sheet = with_objects(bare, entry((0x3001, 2), kind, access, name=name))
            shown = called and access is Access.RO and kind.name in numbers
            found = (Mapped(0x3001, 2, kind),) if shown else ()
            assert temperature_candidates(sheet) == found


# --- process data ----------------------------------------------------------------------------


def fixed(
    sheet: DataSheet, comm: int, words: tuple[int, ...], cob: int | None, kind: int = 1
) -> DataSheet:
    """A PDO whose mapping and transmission type are fixed, and its COB-ID, if one is given."""
    mapping = comm + 0x200
    subs = [entry((mapping, sub), U32, default=word) for sub, word in enumerate(words, 1)]
    sheet = with_objects(
        sheet,
        entry((mapping, 0), U8, default=len(words)),
        *subs,
        entry((comm, 2), U8, default=kind),
    )
    if cob is None:
        return sheet
    return with_objects(sheet, entry((comm, 1), U32, default=cob))


def carried(sheet: DataSheet, *needed: Mapped, commands: bool = False) -> object:
    """Number and objects of each PDO that is chosen."""
    chosen = choose(sheet, needed, commands=commands)
    return chosen and [(pdo.number, pdo.objects) for pdo in chosen]


def test_objects_fill_frames_of_eight_bytes_in_their_order() -> None:
    assert carried(drive(), STATUSWORD, POSITION) == [(1, (STATUSWORD, POSITION))]
    two = [(1, (STATUSWORD, POSITION)), (2, (LINK,))]
    assert carried(drive(), STATUSWORD, POSITION, LINK) == two
    # 4 + 4 bytes are eight.
    assert carried(drive(), POSITION, LINK) == [(1, (POSITION, LINK))]
    others = [Mapped(0x3000, sub, I32) for sub in range(7)]
    assert carried(drive(), *others[:6]) == [
        (number, tuple(others[2 * number - 2 : 2 * number])) for number in (1, 2, 3)
    ]
    # A byte more than eight goes into the next frame.
    byte = Mapped(0x3001, 0, U8)
    assert carried(drive(), POSITION, LINK, byte) == [(1, (POSITION, LINK)), (2, (byte,))]
    # Three frames are the most.
    assert carried(drive(), *others) is None
    assert carried(drive((0x1801, 1)), STATUSWORD, POSITION, LINK) == [two[0], (3, (LINK,))]


def test_commands_that_stay_out_stop_a_drive_in_20_ms_where_it_can_be_told_so() -> None:
    for sheet, deadline_ms in (
        (drive(), 20),
        (drive((0x1400, 5)), 0),
        (with_objects(drive(), entry((0x1400, 5), U16)), 0),
    ):
        chosen = choose(sheet, (CONTROLWORD, TARGET), commands=True)
        pdo = PdoConfig(number=1, objects=(CONTROLWORD, TARGET), deadline_ms=deadline_ms)
        assert chosen == (pdo,)
    assert choose(drive(), (STATUSWORD,), commands=False) == (
        PdoConfig(number=1, objects=(STATUSWORD,), deadline_ms=0),
    )


ANSWER, COMMAND = (0x60410010, 0x60640020), (0x60400010, 0x607A0020)
"""Mapping entries: statusword and position, controlword and target (CiA 301, 7.5.2.37)."""


@pytest.mark.parametrize("commands", [True, False])
def test_a_fixed_mapping_is_taken_where_it_carries_what_is_needed(commands: bool) -> None:
    comm, right = (0x1400, COMMAND) if commands else (0x1800, ANSWER)
    needed = (CONTROLWORD, TARGET) if commands else (STATUSWORD, POSITION)
    only = drive(*[(comm + place, 1) for place in (1, 2, 3)])

    def taken(words: tuple[int, ...], sheet: DataSheet = only) -> object:
        return carried(fixed(sheet, comm, words, None), *needed, commands=commands)

    assert taken(right) == [(1, needed)]
    assert taken(right[::-1]) == [(1, needed[::-1])]
    assert taken(right[:1]) is None
    assert taken((right[0], right[1] - 0x10)) is None
    assert taken((*right, 0x30000010)) is None  # What it carries is not in the data sheet.
    # The mode of operation does no harm in a command; another object may.
    mode, polarity = Mapped(0x6060, 0, DataType.INTEGER8), Mapped(0x607E, 0, U8)
    assert taken((*right, 0x60600008)) == [(1, (*needed, mode))]
    assert taken((*right, 0x607E0008)) == (None if commands else [(1, (*needed, polarity))])
    # With free ones beside it, the rest goes there.
    assert taken(right[:1], drive()) == [(2, needed)]
    other = Mapped(0x3000, 0, I32)
    both = fixed(drive(), comm, right, None)
    assert carried(both, *needed, other, commands=commands) == [(1, needed), (2, (other,))]


@pytest.mark.parametrize(
    ("commands", "number", "cob", "own", "usable"),
    [
        # The predefined connection set; bit 30 of a TPDO's COB-ID forbids remote requests.
        (False, 1, 0x180, True, True),
        (False, 1, 0x4000_0180, True, True),
        (False, 2, 0x280, True, True),
        (False, 1, 0x280, True, False),
        (False, 1, 0x8000_0180, True, False),
        (False, 1, 0x180, False, False),
        (True, 1, 0x200, True, True),
        (True, 2, 0x300, True, True),
        (True, 1, 0x201, True, False),
    ],
)
def test_an_identifier_that_cannot_be_changed_is_that_of_the_predefined_set(
    commands: bool, number: int, cob: int, own: bool, usable: bool
) -> None:
    comm, right = (0x1400, COMMAND) if commands else (0x1800, ANSWER)
    needed = (CONTROLWORD, TARGET) if commands else (STATUSWORD, POSITION)
    others: list[Key] = [(comm + place, 1) for place in range(4) if place != number - 1]
    it = comm + number - 1
    sheet = fixed(drive(*others), it, right, cob)
    sheet = replace(sheet, relative=frozenset([(it, 1)] if own else []))
    found = carried(sheet, *needed, commands=commands)
    assert found == ([(number, needed)] if usable else None)


def test_a_transmission_type_that_cannot_be_changed_is_synchronous() -> None:
    # CiA 301: 0 to 240 are synchronous; of answers 1 alone is that of every SYNC.
    for kind, command, answer in itertools.chain(
        ((0, True, False), (1, True, True), (2, True, False)),
        ((240, True, False), (241, False, False), (255, False, False)),
    ):
        for commands, usable in ((True, command), (False, answer)):
            comm, right = (0x1400, COMMAND) if commands else (0x1800, ANSWER)
            needed = (CONTROLWORD, TARGET) if commands else (STATUSWORD, POSITION)
            only = drive(*[(comm + place, 1) for place in (1, 2, 3)])
            sheet = fixed(only, comm, right, None, kind)
            assert (carried(sheet, *needed, commands=commands) is not None) is usable
            # It is not told, or can be written.
            told = replace(sheet, given=sheet.given - {(comm, 2)})
            free = with_objects(sheet, entry((comm, 2), U8, Access.RW, kind))
            for other in (told, free):
                assert carried(other, *needed, commands=commands) == [(1, needed)]


def test_a_pdo_beyond_the_fourth_has_no_identifier_of_its_own_and_is_not_used() -> None:
    for commands, comm in ((True, 0x1400), (False, 0x1800)):
        free = [entry((comm + 4, sub), U32, Access.RW) for sub in (1, 2)]
        free += [entry((comm + 0x204, sub), U32, Access.RW) for sub in range(9)]
        none = drive(*[(comm + place, 1) for place in range(4)])
        sheet = with_objects(none, *free)
        assert sheet.pdos(commands=commands) == (5,)
        assert choose(sheet, (STATUSWORD,), commands=commands) is None


@pytest.mark.parametrize(
    ("index", "kind"),
    [
        # CiA 402: mode, target torque, offsets of position, velocity and torque, target velocity.
        *((0x6060, DataType.INTEGER8), (0x6071, I16), (0x60B0, I32)),
        *((0x60B1, I32), (0x60B2, I16), (0x60FF, I32)),
    ],
)
def test_what_has_no_part_in_the_cyclic_mode_may_stand_in_a_fixed_command(
    index: int, kind: DataType
) -> None:
    only = drive(*[(0x1400 + place, 1) for place in (1, 2, 3)])
    extra = Mapped(index, 0, kind)
    sheet = with_objects(only, entry((index, 0), kind, Access.RW))
    words = (COMMAND[1], index << 16 | extra.bits)
    found = carried(fixed(sheet, 0x1400, words, None), TARGET, commands=True)
    assert found == [(1, (TARGET, extra))]


# --- proposals -------------------------------------------------------------------------------


def test_what_no_pdo_carries_and_what_is_missing_is_refused_by_name() -> None:
    none = drive(*[(0x1800 + place, 1) for place in range(4)])
    with pytest.raises(
        ConfigError, match=r"^it\.eds: its TPDOs cannot carry 6041h:00, 6064h:00 at .*no TPDO\)"
    ):
        propose(none, "it.eds")
    none = drive(*[(0x1400 + place, 1) for place in range(4)])
    with pytest.raises(
        ConfigError, match=r"^it\.eds: its RPDOs cannot carry 6040h:00, 607Ah:00 at .*no RPDO\)"
    ):
        propose(none, "it.eds")
    with pytest.raises(ConfigError, match=r"3000h:00 is missing; name another object"):
        propose(drive(), "it.eds", Mapped(0x3000, 0, I32))


def test_a_link_is_the_likeliest_one_unless_it_is_named_or_there_is_none() -> None:
    other = Mapped(0x2064, 0, I16)
    for asked, link, torque in (
        (None, LINK, None),
        (other, other, None),
        (ONE_ENCODER, None, Mapped(0x6077, 0, I16)),
    ):
        found = propose(drive(), "it.eds", asked)
        assert (found.link, found.torque, found.links) == (link, torque, (LINK, other))
        assert found.temperature == Mapped(0x2070, 0, I16)
        second = link or torque
        assert [entry for pdo in found.tpdos for entry in pdo.objects][2:] == [second]
    bare = propose(drive((0x2064, 0), (0x60E4, 1), (0x6077, 0), (0x2070, 0)), "it.eds")
    assert (bare.link, bare.torque, bare.links, bare.temperature) == (None, None, (), None)
    # A position that is no whole number is asked for as the usual one.
    real = with_objects(drive(), entry((0x6064, 0), DataType.REAL32))
    assert propose(real, "it.eds").motor == POSITION
