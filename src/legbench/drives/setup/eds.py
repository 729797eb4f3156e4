"""Electronic data sheets (CiA 306-1) from the object table, and DCFs with a node's values."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import groupby

from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import COB_INVALID, COB_MASK
from legbench.drives.protocol.objects import OBJECTS, Access, Key, ObjectEntry
from legbench.drives.setup.config import BusConfig, NodeConfig
from legbench.drives.setup.configuration import configuration

MANDATORY = (0x1000, 0x1001, 0x1018)
MANUFACTURER = range(0x2000, 0x6000)
VAR, ARRAY, RECORD = 0x7, 0x8, 0x9
ARRAYS = (0x1003, 0x1010, 0x1011, 0x1016, 0x1029, 0x607D, 0x6099, 0x60E4)
BAUD_RATES = (10, 20, 50, 125, 250, 500, 800, 1000)
"""Bitrates that an EDS names [kbit/s]."""
EDS_NAME = "legbench-drive.eds"
CREATED = datetime(2026, 11, 22, 13, 27)
"""Time at which the data sheet of the emulated drives was first written."""
DATE, TIME = "%m-%d-%Y", "%I:%M%p"
"""Notation of dates and times in data sheets (CiA 306-1, 6.3)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stamps:
    """Times in the head of a data sheet, to the minute."""

    created: datetime = CREATED
    modified: datetime = CREATED


def stamps_of(text: str) -> Stamps | None:
    """Times that the head of a data sheet names; none if it names none."""
    lines = {key: value for key, _, value in (line.partition("=") for line in text.splitlines())}
    try:
        created, modified = (
            datetime.strptime(f"{lines[f'{what}Date']} {lines[f'{what}Time']}", f"{DATE} {TIME}")
            for what in ("Creation", "Modification")
        )
    except (KeyError, ValueError):
        return None
    return Stamps(created=created, modified=modified)


def eds_text(stamps: Stamps | None = None) -> str:
    """The data sheet of the drives that are emulated here."""
    return _text(_head(EDS_NAME, stamps or Stamps(), {}), {}, {})


def dcf_text(bus: BusConfig, node: NodeConfig, stamps: Stamps | None = None) -> str:
    """The data sheet with what `node` is and is told: identity, parameter values and node id.

    An identity is constant, so it is the default of 1018h and no parameter value.
    """
    identity = node.identity
    numbers = {
        "VendorNumber": identity.vendor,
        "ProductNumber": identity.product or 0,
        "RevisionNumber": identity.revision or 0,
    }
    defaults: dict[Key, int] = {
        (0x1018, sub): number
        for sub, number in enumerate((*numbers.values(), identity.serial or 0), start=1)
    }
    values = {parameter.key: parameter.value for parameter in configuration(bus, node)}
    commissioning = {
        "NodeID": str(node.node_id),
        "NodeName": node.name,
        "Baudrate": str(bus.bitrate // 1000),
        "NetNumber": "0",
        "NetworkName": "legbench",
        "CANopenManager": "0",
        "LSS_SerialNumber": str(node.identity.serial or 0),
    }
    head = [
        *_head(f"{node.name}.dcf", stamps or Stamps(), numbers),
        # The spelling is that of CiA 306.
        _section("DeviceComissioning", commissioning),
    ]
    return _text(head, defaults, values)


def _text(head: Iterable[str], defaults: Mapping[Key, int], values: Mapping[Key, int]) -> str:
    """Data sheet: head, lists of objects, each object with its default and its value."""
    sections = [*head]
    indices = sorted({index for index, _ in OBJECTS})
    for words, chosen in (
        ("MandatoryObjects", [index for index in indices if index in MANDATORY]),
        ("OptionalObjects", [i for i in indices if i not in MANDATORY and i not in MANUFACTURER]),
        ("ManufacturerObjects", [index for index in indices if index in MANUFACTURER]),
    ):
        listed = {str(place): f"0x{index:04X}" for place, index in enumerate(chosen, start=1)}
        sections.append(_section(words, {"SupportedObjects": str(len(chosen)), **listed}))
    for index, group in groupby(OBJECTS.values(), key=lambda entry: entry.index):
        entries = [
            replace(entry, default=defaults.get(entry.key, entry.default)) for entry in group
        ]
        sections += _objects(index, entries, values)
    return "\n".join(sections)


def _head(name: str, stamps: Stamps, numbers: Mapping[str, int]) -> Iterator[str]:
    """Head of a data sheet; one with numbers of a device is a DCF, which names its EDS."""
    yield _section(
        "FileInfo",
        {
            "FileName": name,
            "FileVersion": "1",
            "FileRevision": "1",
            **({"LastEDS": EDS_NAME} if numbers else {}),
            "EDSVersion": "4.0",
            "Description": "Servo drive in cyclic synchronous position mode",
            "CreationTime": stamps.created.strftime(TIME),
            "CreationDate": stamps.created.strftime(DATE),
            "CreatedBy": "legbench",
            "ModificationTime": stamps.modified.strftime(TIME),
            "ModificationDate": stamps.modified.strftime(DATE),
            "ModifiedBy": "legbench",
        },
    )
    rates = {f"BaudRate_{rate}": "1" for rate in BAUD_RATES}
    yield _section(
        "DeviceInfo",
        {
            "VendorName": "legbench",
            "VendorNumber": f"0x{numbers.get('VendorNumber', 0):X}",
            "ProductName": "legbench-drive",
            "ProductNumber": f"0x{numbers.get('ProductNumber', 0):X}",
            "RevisionNumber": f"0x{numbers.get('RevisionNumber', 0):X}",
            "OrderCode": "none",
            **rates,
            "SimpleBootUpMaster": "0",
            "SimpleBootUpSlave": "1",
            "Granularity": "8",
            "DynamicChannelsSupported": "0",
            "GroupMessaging": "0",
            "NrOfRXPDO": "4",
            "NrOfTXPDO": "4",
            "LSS_Supported": "1",
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
    if entry.key in values and entry.access in (Access.RW, Access.WO):
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
