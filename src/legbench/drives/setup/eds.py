"""Electronic data sheets (CiA 306-1) from the object table, and DCFs with a node's values."""

from collections.abc import Iterator, Mapping
from itertools import groupby

from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import COB_INVALID, COB_MASK
from legbench.drives.protocol.objects import OBJECTS, Access, Key, ObjectEntry
from legbench.drives.setup.config import BusConfig, NodeConfig
from legbench.drives.setup.configuration import configuration

MANDATORY = (0x1000, 0x1001, 0x1018)
MANUFACTURER = range(0x2000, 0x6000)
VAR, ARRAY, RECORD = 0x7, 0x8, 0x9
ARRAYS = (0x1003, 0x1016, 0x1029, 0x607D, 0x6099, 0x60E4)
BAUD_RATES = (10, 20, 50, 125, 250, 500, 800, 1000)
"""Bitrates that an EDS names [kbit/s]."""


def eds_text() -> str:
    """The data sheet of the drives that are emulated here."""
    return _text("legbench-drive.eds", {}, None)


def dcf_text(bus: BusConfig, node: NodeConfig) -> str:
    """The data sheet with what `node` is and is told: parameter values and node id."""
    values: dict[Key, int] = {
        (0x1018, 1): node.identity.vendor,
        (0x1018, 2): node.identity.product or 0,
        (0x1018, 3): node.identity.revision or 0,
        (0x1018, 4): node.identity.serial or 0,
    }
    values |= {parameter.key: parameter.value for parameter in configuration(bus, node)}
    commissioning = {
        "NodeID": str(node.node_id),
        "NodeName": node.name,
        "Baudrate": str(bus.bitrate // 1000),
        "NetNumber": "0",
        "NetworkName": "legbench",
        "CANopenManager": "0",
        "LSS_SerialNumber": str(node.identity.serial or 0),
    }
    return _text(f"{node.name}.dcf", values, commissioning)


def _text(name: str, values: Mapping[Key, int], commissioning: Mapping[str, str] | None) -> str:
    sections = [*_head(name)]
    if commissioning is not None:
        # The spelling is that of CiA 306.
        sections.append(_section("DeviceComissioning", commissioning))
    indices = sorted({index for index, _ in OBJECTS})
    for words, chosen in (
        ("MandatoryObjects", [index for index in indices if index in MANDATORY]),
        ("OptionalObjects", [i for i in indices if i not in MANDATORY and i not in MANUFACTURER]),
        ("ManufacturerObjects", [index for index in indices if index in MANUFACTURER]),
    ):
        listed = {str(place): f"0x{index:04X}" for place, index in enumerate(chosen, start=1)}
        sections.append(_section(words, {"SupportedObjects": str(len(chosen)), **listed}))
    for index, group in groupby(OBJECTS.values(), key=lambda entry: entry.index):
        sections += _objects(index, list(group), values)
    return "\n".join(sections)


def _head(name: str) -> Iterator[str]:
    yield _section(
        "FileInfo",
        {
            "FileName": name,
            "FileVersion": "1",
            "FileRevision": "0",
            "EDSVersion": "4.0",
            "Description": "Servo drive in cyclic synchronous position mode",
            "CreatedBy": "legbench",
        },
    )
    rates = {f"BaudRate_{rate}": "1" for rate in BAUD_RATES}
    yield _section(
        "DeviceInfo",
        {
            "VendorName": "legbench",
            "VendorNumber": "0",
            "ProductName": "legbench-drive",
            "ProductNumber": "0",
            "RevisionNumber": "0",
            "OrderCode": "none",
            **rates,
            "SimpleBootUpMaster": "0",
            "SimpleBootUpSlave": "1",
            "Granularity": "8",
            "DynamicChannelsSupported": "0",
            "GroupMessaging": "0",
            "NrOfRXPDO": "4",
            "NrOfTXPDO": "4",
            "LSS_Supported": "0",
        },
    )
    yield _section("DummyUsage", {f"Dummy{index:04X}": "0" for index in range(1, 8)})
    yield _section("Comments", {"Lines": "0"})


def _objects(index: int, group: list[ObjectEntry], values: Mapping[Key, int]) -> Iterator[str]:
    if len(group) == 1 and group[0].sub == 0:
        yield _section(f"{index:04X}", _entry(group[0], VAR, values))
        return
    kind = ARRAY if index in ARRAYS else RECORD
    name = group[0].name.removesuffix(" count").removesuffix(" mapped objects")
    yield _section(
        f"{index:04X}",
        {"ParameterName": name, "ObjectType": f"0x{kind:X}", "SubNumber": str(len(group))},
    )
    for entry in group:
        yield _section(f"{index:04X}sub{entry.sub:X}", _entry(entry, VAR, values))


def _entry(entry: ObjectEntry, kind: int, values: Mapping[Key, int]) -> dict[str, str]:
    lines = {
        "ParameterName": entry.name,
        "ObjectType": f"0x{kind:X}",
        "DataType": f"0x{entry.kind:04X}",
        "AccessType": entry.access.value,
        "DefaultValue": _default(entry),
        "PDOMapping": str(int(entry.mappable)),
    }
    if entry.key in values and entry.access is not Access.RO:
        lines["ParameterValue"] = _number(entry, values[entry.key])
    return lines


def _default(entry: ObjectEntry) -> str:
    if isinstance(entry.default, int):
        if entry.key == (0x1014, 0):
            return "$NODEID+0x80"
        if entry.sub == 1 and (entry.index & ~3 in (0x1400, 0x1800)):
            base = entry.default & COB_MASK
            return f"$NODEID+0x{COB_INVALID | base:X}"
        return _number(entry, entry.default)
    return str(entry.default)


def _number(entry: ObjectEntry, value: int) -> str:
    unsigned = entry.kind in (DataType.UNSIGNED32, DataType.UNSIGNED16)
    return f"0x{value:X}" if unsigned else str(value)


def _section(name: str, lines: Mapping[str, str]) -> str:
    return "\n".join([f"[{name}]", *(f"{key}={value}" for key, value in lines.items()), ""])
