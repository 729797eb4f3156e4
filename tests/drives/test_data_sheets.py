"""Our data sheets against the rules of CiA 306-1, and another library's reader."""

import configparser
import re
from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import canopen
import eds
import pytest
from can_rig import BUS, ROOT

from legbench.drives.protocol.datatypes import DataType, range_of
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.configuration import configuration
from legbench.drives.setup.eds import Stamps, dcf_text, eds_text, stamps_of

HARDWARE = ROOT / "hardware"
BENCH = load_bus(BUS)
SHEETS = ("legbench-drive.eds", "motor1.dcf", "motor2.dcf")
CONST, READ_ONLY = "const", "ro"
OBJECT = re.compile(r"([0-9A-F]{4})(?:sub([0-9A-F]+))?")


def sheet(name: str) -> configparser.ConfigParser:
    parser = configparser.ConfigParser(interpolation=None)
    parser.optionxform = str  # pyrefly: ignore[bad-assignment]
    parser.read(HARDWARE / name, encoding="ascii")
    return parser


def objects(found: configparser.ConfigParser) -> Iterator[tuple[str, configparser.SectionProxy]]:
    for name in found.sections():
        if OBJECT.fullmatch(name) and "DataType" in found[name]:
            yield name, found[name]


@pytest.mark.parametrize("name", SHEETS)
def test_the_head_has_every_key_in_its_notation(name: str) -> None:
    info = sheet(name)["FileInfo"]
    assert info["FileName"] == name
    assert re.fullmatch(r"[0-9]\.[0-9]", info["EDSVersion"])
    for what in ("Creation", "Modification"):
        assert re.fullmatch(r"(0[1-9]|1[0-2]):[0-5][0-9](AM|PM)", info[f"{what}Time"])
        assert re.fullmatch(r"(0[1-9]|1[0-2])-([0-2][0-9]|3[01])-20[0-9]{2}", info[f"{what}Date"])
    assert info["CreatedBy"] == info["ModifiedBy"] == "legbench"
    for key in ("FileVersion", "FileRevision"):
        assert 0 <= int(info[key]) <= 255
    assert len(info["Description"]) <= 243
    # A DCF names the EDS that it was made from; an EDS was made from none.
    assert info.get("LastEDS") == ("legbench-drive.eds" if name.endswith("dcf") else None)
    assert sheet(name)["DeviceInfo"]["LSS_Supported"] == "1"


@pytest.mark.parametrize("name", SHEETS)
def test_values_are_given_to_what_can_be_written_alone(name: str) -> None:
    found = sheet(name)
    told = {key for key, section in objects(found) if "ParameterValue" in section}
    access = {found[key]["AccessType"] for key in told}
    assert not access & {CONST, READ_ONLY}
    assert bool(told) == name.endswith("dcf")


@pytest.mark.parametrize("name", SHEETS)
def test_every_object_has_its_type_its_range_and_its_subs(name: str) -> None:
    found = sheet(name)
    for key, section in objects(found):
        assert 0 < len(section["ParameterName"]) <= 241, key
        assert section["AccessType"] in ("ro", "wo", "rw", "rwr", "rww", "const")
        assert section["PDOMapping"] in ("0", "1")
        kind = DataType(int(section["DataType"], 16))
        if kind is not DataType.VISIBLE_STRING:
            low, high = range_of(kind)
            for entry in ("DefaultValue", "ParameterValue"):
                text = section.get(entry, "0").removeprefix("$NODEID+")
                assert low <= int(text, 0) <= high, key
    for key in found.sections():
        if OBJECT.fullmatch(key) and "SubNumber" in found[key]:
            subs = [one for one in found.sections() if one.startswith(f"{key}sub")]
            assert int(found[key]["SubNumber"]) == len(subs)
            assert int(found[f"{key}sub0"]["DefaultValue"]) <= 127
    lists = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")
    listed = [value for one in lists for key, value in found[one].items() if key.isdigit()]
    there = {match[1] for match in map(OBJECT.fullmatch, found.sections()) if match}
    assert sorted(listed) == sorted(f"0x{index}" for index in there)


@pytest.mark.parametrize("node", BENCH.nodes, ids=lambda node: node.name)
def test_a_dcf_carries_the_identity_where_nothing_is_written(node: object) -> None:
    chosen = next(one for one in BENCH.nodes if one is node)
    found = sheet(f"{chosen.name}.dcf")
    words = (chosen.identity.vendor, chosen.identity.product, 0, chosen.identity.serial)
    info = found["DeviceInfo"]
    keys = ("VendorNumber", "ProductNumber", "RevisionNumber")
    assert tuple(int(info[key], 0) for key in keys) == words[:3]
    assert int(found["DeviceComissioning"]["LSS_SerialNumber"]) == words[3]
    assert tuple(int(found[f"1018sub{sub}"]["DefaultValue"], 0) for sub in range(1, 5)) == words


@pytest.mark.parametrize("node", BENCH.nodes, ids=lambda node: node.name)
def test_another_stack_reads_every_value_of_a_dcf(node: object) -> None:
    chosen = next(one for one in BENCH.nodes if one is node)
    read = canopen.import_od(str(HARDWARE / f"{chosen.name}.dcf"))
    assert (read.node_id, read.bitrate) == (chosen.node_id, BENCH.bitrate)
    assert read.device_information.LSS_supported is True
    last = {parameter.key: parameter.value for parameter in configuration(BENCH, chosen)}
    for (index, sub), value in last.items():
        variable = read.get_variable(index, sub)
        assert variable is not None
        assert variable.value == value, f"{index:04X}h:{sub:02X}"
    serial = read.get_variable(0x1018, 4)
    assert serial is not None
    assert (serial.default, serial.value) == (chosen.identity.serial, None)


def test_times_of_a_head_come_back() -> None:
    for hour in (0, 9, 12, 23):
        stamps = Stamps(
            created=datetime(2026, 1, 2, hour, 5), modified=datetime(2027, 12, 31, hour, 59)
        )
        assert stamps_of(eds_text(stamps)) == stamps
        assert stamps_of(dcf_text(BENCH, BENCH.nodes[0], stamps)) == stamps
    assert stamps_of("[FileInfo]\nCreationTime=1:2\n") is None


def test_a_sheet_is_modified_when_its_content_is_and_not_before(tmp_path: Path) -> None:
    path, now = tmp_path / "motor1.dcf", datetime(2028, 3, 4, 5, 6)
    node = BENCH.nodes[0]
    first = eds.renewed(path, lambda stamps: dcf_text(BENCH, node, stamps), now)
    assert first is not None
    path.write_text(first, encoding="ascii")
    later = datetime(2029, 1, 1)
    assert eds.renewed(path, lambda stamps: dcf_text(BENCH, node, stamps), later) is None
    other = replace(BENCH, heartbeat_ms=30)
    second = eds.renewed(path, lambda stamps: dcf_text(other, node, stamps), later)
    assert second is not None
    assert stamps_of(second) == Stamps(modified=later)
