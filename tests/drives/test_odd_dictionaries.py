"""Objects of a drive that lacks some of them, has other PDOs, or names them in other types."""

from dataclasses import replace

import pytest
from drives_rig import config, node

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.body import stiff_body
from legbench.drives.emulated.dictionary import Dictionary, dictionary_of
from legbench.drives.emulated.homing_methods import METHODS, Until
from legbench.drives.emulated.oddities import changed
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.objects import Access, Key, ObjectEntry
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import NodeConfig, PdoConfig
from legbench.drives.setup.encoders import Side
from legbench.drives.setup.pdos import POSITION_ACTUAL, STATUSWORD
from legbench.drives.setup.unknown import check_springs, describe_unknown
from legbench.errors import ConfigError

TORQUE = Mapped(0x2077, 0, DataType.INTEGER16)


def odd(behaviour: Behaviour, drive: NodeConfig | None = None) -> Dictionary:
    here = node(0) if drive is None else drive
    return changed(dictionary_of(here), here, behaviour)


def entries(dictionary: Dictionary) -> dict[Key, ObjectEntry]:
    return {entry.key: entry for entry in dictionary.entries}


USUAL = entries(dictionary_of(node(0)))


def test_an_ordinary_drive_has_all_objects_as_they_are() -> None:
    found = odd(Behaviour())
    assert entries(found) == USUAL
    assert list(entries(found)) == sorted(USUAL)
    assert found.links == ((0x60E4, 1), (0x2064, 0))
    assert found.temperature == (0x2070, 0)


def test_what_a_drive_lacks_is_hidden_with_the_value_that_it_works_with() -> None:
    found = odd(Behaviour(lacks=frozenset({0x6085, (0x1018, 4), 0x1008, (0x9999, 1)})))
    gone = {key for key in USUAL if key[0] in (0x6085, 0x1008)} | {(0x1018, 4)}
    assert set(USUAL) - set(entries(found)) == gone
    # A text is no number to work with.
    assert found.hidden == {(0x6085, 0): 0, (0x1018, 4): 100, (0x1008, 0): 0}


def test_values_at_power_on_are_those_of_this_drive() -> None:
    found = odd(Behaviour(defaults=(((0x6085, 0), 77), ((0x9999, 0), 5))))
    there = entries(found)
    assert there[0x6085, 0].default == 77
    assert {key: entry for key, entry in there.items() if key != (0x6085, 0)} == {
        key: entry for key, entry in USUAL.items() if key != (0x6085, 0)
    }
    hidden = odd(Behaviour(defaults=(((0x6085, 0), 77),), lacks=frozenset({0x6085})))
    assert hidden.hidden == {(0x6085, 0): 77}


@pytest.mark.parametrize("base", [0x1400, 0x1800])
@pytest.mark.parametrize("count", [1, 3, 4, 6])
def test_a_drive_has_as_many_frames_as_it_has(base: int, count: int) -> None:
    found = odd(Behaviour(rpdos=count) if base == 0x1400 else Behaviour(tpdos=count))
    there = entries(found)
    other = 0x1800 if base == 0x1400 else 0x1400
    for start, number in ((base, count), (other, 4)):
        for index in (start, start + 0x200):
            subs = {sub for at, sub in USUAL if at == index}
            keys = {key for key in there if index <= key[0] < index + 0x200}
            assert keys == {(index + place, sub) for place in range(number) for sub in subs}
            for at, sub in keys:
                assert (there[at, sub].index, there[at, sub].sub) == (at, sub)


def test_mappings_that_are_fixed_are_what_the_bus_file_wants() -> None:
    answers = (
        PdoConfig(number=1, objects=(STATUSWORD,)),
        PdoConfig(number=3, objects=(POSITION_ACTUAL, Mapped(0x2064, 0, DataType.INTEGER16))),
    )
    there = entries(odd(Behaviour(fixed_mapping=True), replace(node(0), tpdos=answers)))
    wanted: dict[Key, int] = {
        (0x1600, 0): 2,
        (0x1600, 1): 0x60400010,
        (0x1600, 2): 0x607A0020,
        (0x1A00, 0): 1,
        (0x1A00, 1): 0x60410010,
        (0x1A02, 0): 2,
        (0x1A02, 1): 0x60640020,
        (0x1A02, 2): 0x20640010,
    }
    for key, entry in there.items():
        if 0x1600 <= key[0] < 0x1800 or 0x1A00 <= key[0] < 0x1C00:
            assert (entry.access, entry.default) == (Access.RO, wanted.get(key, 0))
        else:
            assert entry == USUAL[key]


def test_objects_that_a_bus_file_names_are_there_in_its_types() -> None:
    warm = Mapped(0x2071, 2, DataType.UNSIGNED8)
    target = Mapped(0x607A, 0, DataType.INTEGER32)
    link = Mapped(0x2065, 0, DataType.INTEGER16)
    drive = replace(
        node(0),
        temperature_object=warm,
        link_object=link,
        tpdos=(PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL, link)),),
    )
    found = odd(Behaviour(), drive)
    there = entries(found)
    assert found.links == ((0x60E4, 1), (0x2064, 0), (0x2065, 0))
    assert found.temperature == (0x2071, 2)
    # What is there in that type is left as it is.
    assert there[target.key] == USUAL[target.key]
    for entry in (warm, link):
        held = there[entry.key]
        assert (held.kind, held.access, held.default, held.mappable) == (
            entry.kind,
            Access.RO,
            0,
            True,
        )
        assert held.name == f"Object {entry.index:04X}h of this drive"
    assert set(there) - set(USUAL) == {warm.key, link.key}
    # One of another type keeps its name.
    short = Mapped(0x6077, 0, DataType.INTEGER32)
    renamed = entries(odd(Behaviour(), replace(drive, temperature_object=short)))[0x6077, 0]
    assert (renamed.name, renamed.kind) == (USUAL[0x6077, 0].name, DataType.INTEGER32)


# --- homing ----------------------------------------------------------------------------------


@pytest.mark.parametrize("method", sorted(set(METHODS) - {33, 34, 35, 37}))
def test_a_switch_or_a_stop_is_sought_fast_and_left_slowly(method: int) -> None:
    # CiA 402-2, 6099h: :01 during the search for a switch, :02 for zero.
    first, *rest = METHODS[method]
    assert first.fast
    assert first.until is not Until.INDEX
    assert not [move for move in rest if move.fast]


# --- one encoder -----------------------------------------------------------------------------


def one_sided(place: int, side: Side, torque: Mapped | None = None) -> NodeConfig:
    answers = (STATUSWORD, POSITION_ACTUAL, *((torque,) if torque else ()))
    return replace(
        node(place),
        link=None,
        side=side,
        torque_object=torque,
        torque_scale=0.01,
        tpdos=(PdoConfig(number=1, objects=answers),),
    )


@pytest.mark.parametrize(("side", "other"), [(Side.MOTOR, "link"), (Side.LINK, "motor")])
@pytest.mark.parametrize("place", [0, 1])
def test_either_drive_with_one_encoder_is_told_and_what_is_not_known_of_it(
    place: int, side: Side, other: str
) -> None:
    nodes = [node(0), node(1)]
    nodes[place] = one_sided(place, side)
    bus = config(nodes=tuple(nodes))
    (line,) = describe_unknown(bus)
    head = f"drive '{nodes[place].name}' has one encoder, at the {side}, and sends no torque: "
    assert line.startswith(f"{head}spring torque and the {other}'s position are not known; ")
    assert ("joint_range" in line) is (side is Side.MOTOR)
    with pytest.raises(ConfigError, match=f"spring torque of '{nodes[place].name}' is not known"):
        check_springs(bus)
    check_springs(replace(bus, waive=("spring watch",)))
    nodes[place] = one_sided(place, side, TORQUE)
    told = config(nodes=tuple(nodes))
    check_springs(told)
    (line,) = describe_unknown(told)
    assert f"and the {other}'s position follows from it; joint_speed" in line
    assert describe_unknown(config()) == ()


def test_a_stiff_body_is_where_its_motors_are_and_has_no_springs() -> None:
    assert stiff_body((0.25, -0.5)) == ((0.25, -0.5), (0.0, 0.0))
