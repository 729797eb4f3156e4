"""What a drive is told before it is enabled, object by object, as bytes of the standard's numbers.

The transcript is written down here once: a number that the configuration and the emulated drive
share would otherwise agree with itself.
"""

import configparser
from dataclasses import replace
from typing import Any

import pytest
from drives_rig import config, node

from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.objects import OBJECTS
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import (
    CONTROLWORD,
    POSITION_ACTUAL,
    STATUSWORD,
    TARGET_POSITION,
    BusConfig,
    NodeConfig,
    Parameter,
    PdoConfig,
)
from legbench.drives.setup.configuration import configuration, interpolation_time
from legbench.drives.setup.eds import BAUD_RATES, dcf_text, eds_text
from legbench.drives.setup.needs import Need, row_of
from legbench.errors import ConfigError

Told = list[tuple[str, str, int]]
"""Object, type and value."""


def told(bus: BusConfig, chosen: NodeConfig) -> Told:
    return [
        (f"{entry.index:04X}:{entry.sub}", entry.kind.name, entry.value)
        for entry in configuration(bus, chosen)
    ]


def bus_of(chosen: NodeConfig, **changes: Any) -> BusConfig:
    other = replace(node(1 - (chosen.node_id == 2)), node_id=3 - chosen.node_id)
    return replace(config(), nodes=(chosen, other), **changes)


USUAL: Told = [
    ("1005:0", "UNSIGNED32", 0x80),
    ("1006:0", "UNSIGNED32", 1000),
    ("1016:1", "UNSIGNED32", 0x7E003C),
    ("1017:0", "UNSIGNED16", 20),
    ("1029:1", "UNSIGNED8", 0),
    ("6007:0", "INTEGER16", 3),
    ("605A:0", "INTEGER16", 2),
    ("60C2:2", "INTEGER8", -3),
    ("60C2:1", "UNSIGNED8", 1),
    ("60B0:0", "INTEGER32", 0),
    ("60B1:0", "INTEGER32", 0),
    ("60B2:0", "INTEGER16", 0),
    ("607E:0", "UNSIGNED8", 0),
    ("605B:0", "INTEGER16", 1),
    ("605C:0", "INTEGER16", 1),
    ("605D:0", "INTEGER16", 2),
    ("605E:0", "INTEGER16", 2),
    ("1400:1", "UNSIGNED32", 0x80000201),
    ("1600:0", "UNSIGNED8", 0),
    ("1600:1", "UNSIGNED32", 0x60400010),
    ("1600:2", "UNSIGNED32", 0x607A0020),
    ("1600:0", "UNSIGNED8", 2),
    ("1400:2", "UNSIGNED8", 1),
    ("1400:5", "UNSIGNED16", 20),
    ("1400:1", "UNSIGNED32", 0x201),
    ("1401:1", "UNSIGNED32", 0x80000301),
    ("1402:1", "UNSIGNED32", 0x80000401),
    ("1403:1", "UNSIGNED32", 0x80000501),
    ("1800:1", "UNSIGNED32", 0xC0000181),
    ("1A00:0", "UNSIGNED8", 0),
    ("1A00:1", "UNSIGNED32", 0x60410010),
    ("1A00:2", "UNSIGNED32", 0x60640020),
    ("1A00:3", "UNSIGNED32", 0x20640010),
    ("1A00:0", "UNSIGNED8", 3),
    ("1800:2", "UNSIGNED8", 1),
    ("1800:1", "UNSIGNED32", 0x40000181),
    ("1801:1", "UNSIGNED32", 0x80000281),
    ("1802:1", "UNSIGNED32", 0x80000381),
    ("1803:1", "UNSIGNED32", 0x80000481),
    ("6060:0", "INTEGER8", 8),
]


def test_a_usual_drive_is_told_this_in_this_order() -> None:
    bus = replace(config(), master_id=0x7E, master_heartbeat_ms=20, heartbeat_ms=20)
    assert told(bus, bus.nodes[0]) == USUAL


def test_another_bus_is_told_in_other_numbers() -> None:
    chosen = replace(
        node(1),
        rpdos=(
            PdoConfig(number=1, objects=(CONTROLWORD,)),
            PdoConfig(number=3, objects=(TARGET_POSITION,), deadline_ms=35, cob_id=0x2FE),
        ),
        tpdos=(
            PdoConfig(number=2, objects=(STATUSWORD, POSITION_ACTUAL)),
            PdoConfig(number=4, objects=(Mapped(0x2064, 0, DataType.INTEGER16),)),
        ),
        parameters=(
            Parameter(index=0x605D, sub=0, kind=DataType.INTEGER16, value=1),
            Parameter(index=0x6065, sub=0, kind=DataType.UNSIGNED32, value=5000),
        ),
        soft_limits=(-0.5, 0.25),
    )
    bus = bus_of(
        chosen,
        period_us=2000,
        master_id=5,
        master_heartbeat_ms=30,
        heartbeat_ms=40,
    )
    said = told(bus, chosen)
    values = {key: value for key, _, value in said}
    assert values["1006:0"] == 2000
    assert values["1016:1"] == 5 << 16 | 90
    assert values["1017:0"] == 40
    assert (values["60C2:1"], values["60C2:2"]) == (2, -3)
    # The bus file's own stop option stands, and stands once.
    assert [value for key, _, value in said if key == "605D:0"] == [1]
    assert values["6065:0"] == 5000
    # A mirrored axis: its lower limit is the larger angle.
    per_rad = -(1 << 20) / 6.283185307179586
    assert values["607D:1"] == 777 + round(0.25 * per_rad)
    assert values["607D:2"] == 777 + round(-0.5 * per_rad)
    ends = {key: value for key, _, value in said if key[:2] in ("14", "18") and key.endswith(":1")}
    assert ends == {
        "1400:1": 0x202,
        "1401:1": 0x80000302,
        "1402:1": 0x2FE,
        "1403:1": 0x80000502,
        "1800:1": 0x80000182,
        "1801:1": 0x40000282,
        "1802:1": 0x80000382,
        "1803:1": 0x40000482,
    }
    deadlines = {key: value for key, _, value in said if key.endswith(":5")}
    assert deadlines == {"1402:5": 35}


def test_what_a_drive_may_lack_is_what_the_profile_lets_it_lack() -> None:
    entries = list({one.key: one for one in configuration(config(), node(0))}.values())
    needs = {need: {one.index for one in entries if row_of(one).need is need} for need in Need}
    process_data = {0x1400, 0x1600, 0x1A00, *range(0x1800, 0x1804)}
    may_lack = {0x1005, 0x605A, 0x6060, 0x607E, 0x60B0, 0x60B1, 0x60B2, 0x60C2}
    assert needs[Need.REQUIRED] == process_data | may_lack
    assert needs[Need.PROTECTION] == {0x1006, 0x1016, 0x1017, 0x1400, 0x6007, 0x605E}
    assert needs[Need.OPTIONAL] == {0x1029, 0x1401, 0x1402, 0x1403, 0x605B, 0x605C, 0x605D}
    for entry in entries:
        if row_of(entry).need is Need.REQUIRED:
            spare = entry.index in (0x1801, 0x1802, 0x1803)
            assert row_of(entry).may_lack == (entry.index in may_lack or spare), entry


@pytest.mark.parametrize(
    ("period_us", "said"),
    [
        (1, (1, -6)),
        (10, (1, -5)),
        (250, (25, -5)),
        (255, (255, -6)),
        (500, (5, -4)),
        (1000, (1, -3)),
        (2550, (255, -5)),
        (1_000_000, (1, 0)),
        (256, None),
        (1001, None),
    ],
)
def test_60c2_says_a_period_or_it_is_refused(period_us: int, said: tuple[int, int] | None) -> None:
    if said is None:
        with pytest.raises(ConfigError, match=f"period_us is {period_us}; object 60C2h cannot"):
            interpolation_time(period_us)
    else:
        assert interpolation_time(period_us) == said


# --- the object dictionary and its data sheets -----------------------------------------------


def test_pdos_have_the_objects_of_the_standard() -> None:
    # CiA 301, 7.5.2.33 to 7.5.2.38: communication 1400h/1800h, mapping 1600h/1A00h.
    for number in range(4):
        for base, first in ((0x1400, 0x200), (0x1800, 0x180)):
            comm, mapping = base + number, base + 0x200 + number
            assert OBJECTS[comm, 1].default == 0x80000000 | first + 0x100 * number
            kinds = {sub: OBJECTS[comm, sub].kind.name for sub in (0, 1, 2, 3, 5)}
            assert kinds == {
                0: "UNSIGNED8",
                1: "UNSIGNED32",
                2: "UNSIGNED8",
                3: "UNSIGNED16",
                5: "UNSIGNED16",
            }
            assert OBJECTS[comm, 2].default == 255
            assert OBJECTS[comm, 0].access.value == "const"
            subs = sorted(sub for index, sub in OBJECTS if index == mapping)
            assert subs == list(range(9))
            assert {OBJECTS[mapping, sub].kind.name for sub in range(1, 9)} == {"UNSIGNED32"}
            assert {OBJECTS[mapping, sub].default for sub in range(9)} == {0}
            assert {OBJECTS[mapping, sub].access.value for sub in range(9)} == {"rw"}


def sheet(text: str) -> configparser.ConfigParser:
    parser = configparser.ConfigParser(interpolation=None)
    parser.optionxform = str  # pyrefly: ignore[bad-assignment]
    parser.read_string(text)
    return parser


def test_a_data_sheet_lists_every_object_once_in_its_group() -> None:
    found = sheet(eds_text())
    indices = sorted({index for index, _ in OBJECTS})
    groups = {
        "MandatoryObjects": [0x1000, 0x1001, 0x1018],
        "ManufacturerObjects": [index for index in indices if 0x2000 <= index <= 0x5FFF],
    }
    listed = groups["MandatoryObjects"] + groups["ManufacturerObjects"]
    groups["OptionalObjects"] = [index for index in indices if index not in listed]
    for name, chosen in groups.items():
        lines = dict(found[name])
        assert lines.pop("SupportedObjects") == str(len(chosen))
        assert lines == {str(place): f"0x{index:04X}" for place, index in enumerate(chosen, 1)}
    assert len(groups["ManufacturerObjects"]) == 2
    assert "DeviceComissioning" not in found


def test_a_data_sheet_describes_objects_as_the_standard_spells_them() -> None:
    found = sheet(eds_text())
    assert dict(found["6064"]) == {
        "ParameterName": "Position actual value",
        "ObjectType": "0x7",
        "DataType": "0x0004",
        "AccessType": "ro",
        "DefaultValue": "0",
        "PDOMapping": "1",
    }
    assert found["6065"]["DefaultValue"] == "0xFFFFFFFF"
    assert found["6065"]["PDOMapping"] == "0"
    assert found["1008"]["DefaultValue"] == "legbench-drive"
    assert found["1008"]["DataType"] == "0x0009"
    assert found["60C2sub2"]["DefaultValue"] == "-2"
    assert found["1014"]["DefaultValue"] == "$NODEID+0x80"
    for number, (rpdo, tpdo) in enumerate(((0x200, 0x180), (0x300, 0x280), (0x400, 0x380))):
        assert (
            found[f"{0x1400 + number:04X}sub1"]["DefaultValue"] == f"$NODEID+0x{1 << 31 | rpdo:X}"
        )
        assert (
            found[f"{0x1800 + number:04X}sub1"]["DefaultValue"] == f"$NODEID+0x{1 << 31 | tpdo:X}"
        )
    # Arrays are of one type, records are not (CiA 301, 7.4.3).
    kinds = {
        name: (found[name]["ObjectType"], found[name]["SubNumber"])
        for name in ("1003", "1010", "1011", "1016", "1018", "1400", "1600", "607D", "60C2")
    }
    assert kinds == {
        "1003": ("0x8", "2"),
        "1016": ("0x8", "3"),
        "1018": ("0x9", "5"),
        "1400": ("0x9", "5"),
        "1600": ("0x9", "9"),
        "1010": ("0x8", "4"),
        "1011": ("0x8", "4"),
        "607D": ("0x8", "3"),
        "60C2": ("0x9", "3"),
    }
    assert found["1018"]["ParameterName"] == "Identity"
    assert "1018sub4" in found
    assert "6064sub0" not in found


def test_a_data_sheet_names_the_bitrates_of_the_standard() -> None:
    # CiA 301, table 1.
    assert BAUD_RATES == (10, 20, 50, 125, 250, 500, 800, 1000)
    info = sheet(eds_text())["DeviceInfo"]
    assert [key for key in info if key.startswith("BaudRate")] == [
        f"BaudRate_{rate}" for rate in (10, 20, 50, 125, 250, 500, 800, 1000)
    ]
    assert (info["NrOfRXPDO"], info["NrOfTXPDO"], info["Granularity"]) == ("4", "4", "8")
    dummies = sheet(eds_text())["DummyUsage"]
    assert list(dummies) == [f"Dummy000{number}" for number in range(1, 8)]


def test_a_configured_sheet_holds_the_node_and_what_it_is_told() -> None:
    chosen = replace(node(1), identity=replace(node(1).identity, revision=9))
    bus = bus_of(chosen, bitrate=500_000)
    found = sheet(dcf_text(bus, chosen))
    commissioning = found["DeviceComissioning"]
    assert (commissioning["NodeID"], commissioning["NodeName"]) == ("2", "knee")
    assert (commissioning["Baudrate"], commissioning["LSS_SerialNumber"]) == ("500", "101")
    identity = [found[f"1018sub{sub}"]["DefaultValue"] for sub in (1, 2, 3, 4)]
    assert identity == ["0x1234", "0x7", "0x9", "0x65"]
    device = found["DeviceInfo"]
    numbers = [device[f"{what}Number"] for what in ("Vendor", "Product", "Revision")]
    assert numbers == ["0x1234", "0x7", "0x9"]
    # What cannot be written is no parameter.
    const = [name for name, entry in found.items() if entry.get("AccessType") == "const"]
    assert len(const) > 10
    assert not any("ParameterValue" in found[name] for name in const)
    last = {key: (kind, value) for key, kind, value in told(bus, chosen)}
    for key, (kind, value) in last.items():
        index, sub = key.split(":")
        name = index if index in found and "DataType" in found[index] else f"{index}sub{sub}"
        printed = found[name]["ParameterValue"]
        assert int(printed, 0) == value, key
        assert printed.startswith("0x") == (kind in ("UNSIGNED16", "UNSIGNED32"))
    bare = replace(chosen, identity=replace(chosen.identity, serial=None, revision=None))
    found = sheet(dcf_text(bus_of(bare), bare))
    assert found["DeviceComissioning"]["LSS_SerialNumber"] == "0"
    assert [found[f"1018sub{sub}"]["DefaultValue"] for sub in (3, 4)] == ["0x0", "0x0"]
