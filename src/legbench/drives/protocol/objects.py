"""The object dictionary of a CiA 402 drive as far as a leg needs it: one table for all.

The emulated drives hold these objects, the EDS writer lists them, messages name them.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from legbench.drives.protocol.datatypes import SHORT_NAMES, DataType, Value
from legbench.drives.protocol.frame import COB_INVALID, RPDO_BASES, TPDO_BASES

Key = tuple[int, int]
"""Index and sub-index."""
PDO_COUNT = 4
"""Number of RPDOs, and of TPDOs, that the predefined connection set gives identifiers."""
LAST_PDO = 512
"""Highest number of an RPDO or a TPDO (CiA 301, 7.5.2.33)."""
MAX_MAPPED = 8
LINK_SHORT = 0x2064
"""Link position in 16 bits, manufacturer specific: with 6041h and 6064h it fills one TPDO."""
TEMPERATURE = 0x2070
"""Temperature of the power stage [0.1 deg C], manufacturer specific."""


class Access(Enum):
    """Access to an object by SDO: reading, writing or both."""

    CONST = "const"
    RO = "ro"
    RW = "rw"
    WO = "wo"


@dataclass(frozen=True, slots=True)
class ObjectEntry:
    """Entry of the object dictionary: an object or sub-object."""

    index: int
    sub: int
    name: str
    kind: DataType
    access: Access
    default: Value
    mappable: bool = False

    @property
    def key(self) -> Key:
        """Index and sub-index."""
        return (self.index, self.sub)


_TABLE = """
1000 0 u32 const 0x00020192 - Device type
1001 0 u8 ro 0 m Error register
1003 0 u8 rw 0 - Pre-defined error field count
1003 1 u32 ro 0 - Latest error
1005 0 u32 rw 0x80 - COB-ID SYNC
1006 0 u32 rw 0 - Communication cycle period [us]
1007 0 u32 rw 0 - Synchronous window length [us]
1008 0 str const legbench-drive - Manufacturer device name
1010 0 u8 const 3 - Store parameters count
1010 1 u32 rw 1 - Store all parameters
1010 2 u32 rw 1 - Store communication parameters
1010 3 u32 rw 1 - Store application parameters
1011 0 u8 const 3 - Restore default parameters count
1011 1 u32 rw 1 - Restore all default parameters
1011 2 u32 rw 1 - Restore communication default parameters
1011 3 u32 rw 1 - Restore application default parameters
1014 0 u32 ro 0x80 - COB-ID EMCY
1015 0 u16 rw 0 - Inhibit time EMCY [100 us]
1016 0 u8 const 2 - Consumer heartbeat time count
1016 1 u32 rw 0 - Consumer heartbeat time 1
1016 2 u32 rw 0 - Consumer heartbeat time 2
1017 0 u16 rw 0 - Producer heartbeat time [ms]
1018 0 u8 const 4 - Identity count
1018 1 u32 const 0 - Vendor-ID
1018 2 u32 const 0 - Product code
1018 3 u32 const 0 - Revision number
1018 4 u32 const 0 - Serial number
1019 0 u8 rw 0 - Synchronous counter overflow
1029 0 u8 const 1 - Error behaviour count
1029 1 u8 rw 0 - Communication error
2064 0 i16 ro 0 m Link position, low 16 bits [counts]
2070 0 i16 ro 250 m Power stage temperature [0.1 deg C]
6007 0 i16 rw 1 - Abort connection option code
603F 0 u16 ro 0 m Error code
6040 0 u16 rw 0 m Controlword
6041 0 u16 ro 0 m Statusword
605A 0 i16 rw 2 - Quick stop option code
605B 0 i16 rw 0 - Shutdown option code
605C 0 i16 rw 1 - Disable operation option code
605D 0 i16 rw 1 - Halt option code
605E 0 i16 rw 2 - Fault reaction option code
6060 0 i8 rw 0 m Modes of operation
6061 0 i8 ro 0 m Modes of operation display
6062 0 i32 ro 0 m Position demand value
6064 0 i32 ro 0 m Position actual value
6065 0 u32 rw 0xFFFFFFFF - Following error window
6066 0 u16 rw 0 - Following error time out [ms]
606C 0 i32 ro 0 m Velocity actual value
6071 0 i16 ro 0 m Target torque
6072 0 u16 rw 1000 m Max torque [permille]
6077 0 i16 ro 0 m Torque actual value [permille]
607A 0 i32 rw 0 m Target position
607C 0 i32 rw 0 - Home offset
607D 0 u8 const 2 - Software position limit count
607D 1 i32 rw 0 - Min position limit
607D 2 i32 rw 0 - Max position limit
607E 0 u8 rw 0 - Polarity
6080 0 u32 rw 0 - Max motor speed [counts/s]
6081 0 u32 ro 0 - Profile velocity
6083 0 u32 ro 0 - Profile acceleration
6084 0 u32 rw 0 - Profile deceleration [counts/s2]
6085 0 u32 rw 0 - Quick stop deceleration [counts/s2]
6098 0 i8 rw 37 - Homing method
6099 0 u8 const 2 - Homing speeds count
6099 1 u32 rw 0 - Speed during search for switch [counts/s]
6099 2 u32 rw 0 - Speed during search for zero [counts/s]
609A 0 u32 rw 0 - Homing acceleration
60B0 0 i32 rw 0 m Position offset
60B1 0 i32 rw 0 m Velocity offset
60B2 0 i16 rw 0 m Torque offset
60C2 0 u8 const 2 - Interpolation time period count
60C2 1 u8 rw 1 - Interpolation time period value
60C2 2 i8 rw -2 - Interpolation time index
60E4 0 u8 const 1 - Additional position actual value count
60E4 1 i32 ro 0 m Additional position actual value 1 (link)
60F4 0 i32 ro 0 m Following error actual value
60FD 0 u32 ro 0 m Digital inputs
6502 0 u32 const 0xA0 - Supported drive modes
"""
"""Index, sub, type, access, default, mappable, name; the defaults are as unhelpful as usual."""


def _rows() -> Iterator[ObjectEntry]:
    for line in _TABLE.strip().splitlines():
        index, sub, kind, access, default, mappable, name = line.split(maxsplit=6)
        data_type = SHORT_NAMES[kind]
        text = data_type is DataType.VISIBLE_STRING
        yield ObjectEntry(
            int(index, 16),
            int(sub),
            name,
            data_type,
            Access(access),
            default if text else int(default, 0),
            mappable == "m",
        )


def _pdo_rows() -> Iterator[ObjectEntry]:
    u8, u16, u32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32
    for base, name, bases in ((0x1400, "RPDO", RPDO_BASES), (0x1800, "TPDO", TPDO_BASES)):
        for number in range(PDO_COUNT):
            comm, mapping, words = base + number, base + 0x200 + number, f"{name}{number + 1}"
            yield ObjectEntry(comm, 0, f"{words} parameter count", u8, Access.CONST, 5)
            cob = COB_INVALID | bases[number]
            yield ObjectEntry(comm, 1, f"{words} COB-ID", u32, Access.RW, cob)
            yield ObjectEntry(comm, 2, f"{words} transmission type", u8, Access.RW, 255)
            # An RPDO has no inhibit time.
            inhibit = Access.RO if base == 0x1400 else Access.RW
            yield ObjectEntry(comm, 3, f"{words} inhibit time [100 us]", u16, inhibit, 0)
            yield ObjectEntry(comm, 5, f"{words} event timer [ms]", u16, Access.RW, 0)
            yield ObjectEntry(mapping, 0, f"{words} mapped objects", u8, Access.RW, 0)
            for sub in range(1, MAX_MAPPED + 1):
                yield ObjectEntry(mapping, sub, f"{words} mapping {sub}", u32, Access.RW, 0)


OBJECTS: dict[Key, ObjectEntry] = {
    entry.key: entry
    for entry in sorted((*_rows(), *_pdo_rows()), key=lambda entry: (entry.index, entry.sub))
}
"""Every object by index and sub-index, in order."""


def name_of(index: int, sub: int = 0) -> str:
    """An object as messages name it, such as `6064h:00 Position actual value`."""
    entry = OBJECTS.get((index, sub))
    return f"{index:04X}h:{sub:02X}" + ("" if entry is None else f" {entry.name}")
