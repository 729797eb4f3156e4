"""Configuration of a bus: nodes, their identity, process data and units, as frozen values."""

import math
from dataclasses import dataclass, field, replace

from legbench.drives.errors import CodecError
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import LAST_NODE, RPDO_BASES, TPDO_BASES
from legbench.drives.protocol.objects import LINK_SHORT, PDO_COUNT
from legbench.drives.protocol.pdo import Mapped, PdoMap
from legbench.drives.setup.bus_numbers import BUS_NUMBERS, LONG, WORD, check_bus_numbers
from legbench.drives.setup.cob_ids import check_cob_id, check_distinct
from legbench.drives.setup.homed import HomedCondition
from legbench.drives.setup.parameters import Parameter, check_parameter
from legbench.drives.setup.units import AxisUnits
from legbench.errors import ConfigError
from legbench.limits.safety import Range
from legbench.limits.upper_ends import BUS_WAIVERS, check_number, check_waivers

STATUSWORD = Mapped(0x6041, 0, DataType.UNSIGNED16)
CONTROLWORD = Mapped(0x6040, 0, DataType.UNSIGNED16)
POSITION_ACTUAL = Mapped(0x6064, 0, DataType.INTEGER32)
TARGET_POSITION = Mapped(0x607A, 0, DataType.INTEGER32)
LINK_POSITION_SHORT = Mapped(LINK_SHORT, 0, DataType.INTEGER16)
LINK_POSITION = Mapped(0x60E4, 1, DataType.INTEGER32)
LARGEST_COUNT = (1 << 31) - 1
"""Highest count of a 32-bit position object [counts]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """Identity object 1018h; what is not given is not checked.

    Raises:
        ConfigError: a number that 32 bits do not hold.
    """

    vendor: int
    product: int
    serial: int | None = None
    revision: int | None = None

    def __post_init__(self) -> None:
        for name in ("vendor", "product", "serial", "revision"):
            value = getattr(self, name)
            if value is not None:
                check_number(name, value, 0, LONG, "")


@dataclass(frozen=True, slots=True, kw_only=True)
class PdoConfig:
    """Synchronous process data object (1400h/1600h or 1800h/1A00h and following).

    Raises:
        ConfigError: a number that does not exist, or objects that fill no frame.
    """

    number: int
    """Number of the RPDO or TPDO, 1 to 4."""
    objects: tuple[Mapped, ...]
    cob_id: int | None = None
    """COB-ID of the PDO; by default that of the predefined connection set."""
    deadline_ms: int = 0
    """Time without an RPDO after which the drive faults (140xh:05) [ms]; 0 leaves that object,
    which not every drive has, alone."""

    def __post_init__(self) -> None:
        if not 1 <= self.number <= PDO_COUNT:
            raise ConfigError(f"PDO number {self.number}; a drive has 1 to {PDO_COUNT}")
        try:
            PdoMap(self.objects)
        except CodecError as error:
            raise ConfigError(f"PDO {self.number}: {error}") from None
        if self.cob_id is not None:
            check_cob_id(self.cob_id)
        check_number("deadline_ms", self.deadline_ms, 0, WORD, "ms")


RPDO = PdoConfig(number=1, objects=(CONTROLWORD, TARGET_POSITION), deadline_ms=20)
"""Command frame used by default: controlword and target position, six bytes."""
TPDO = PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL, LINK_POSITION_SHORT))
"""Answer frame used by default: statusword, motor and link position, eight bytes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeConfig:
    """Configuration of one drive.

    Raises:
        ConfigError: a node id that does not exist, or process data that cannot close the loop.
    """

    name: str
    node_id: int
    identity: Identity
    motor: AxisUnits
    link: AxisUnits
    link_object: Mapped = LINK_POSITION_SHORT
    rpdos: tuple[PdoConfig, ...] = (RPDO,)
    tpdos: tuple[PdoConfig, ...] = (TPDO,)
    parameters: tuple[Parameter, ...] = ()
    """Objects written after those of `configuration.configuration`, in this order."""
    temperature_object: Mapped | None = None
    """Integer object in which the drive reports its temperature; none if it does not."""
    temperature_scale: float = 0.1
    """Temperature of one count of `temperature_object`, which depends on the maker [deg C]."""
    heartbeat_consumer: bool = True
    """Whether the drive has 1016h, and so stops when its master's heartbeat is missing; some have
    not, and must be given a `deadline_ms` of their commands instead."""
    homed: HomedCondition | None = None
    """How the drive shows that it is homed, without which nothing moves; none needs no homing, as
    with an absolute encoder."""
    soft_limits: Range | None = None
    """Motor range to which the drive itself clamps targets (607Dh) [rad]; none sets no range."""

    def __post_init__(self) -> None:
        if not 1 <= self.node_id <= LAST_NODE:
            raise ConfigError(f"node '{self.name}' has id {self.node_id}; it must be 1 to 127")
        for needed, pdos, words in (
            ((CONTROLWORD, TARGET_POSITION), self.rpdos, "RPDO"),
            ((STATUSWORD, POSITION_ACTUAL, self.link_object), self.tpdos, "TPDO"),
        ):
            mapped = [entry for pdo in pdos for entry in pdo.objects]
            for entry in needed:
                if mapped.count(entry) != 1:
                    raise ConfigError(
                        f"node '{self.name}' maps {entry} {mapped.count(entry)} times; it must "
                        f"stand in one {words}"
                    )
        if self.link.bits != self.link_object.bits:
            raise ConfigError(
                f"node '{self.name}': link bits is {self.link.bits}, but {self.link_object} has "
                f"{self.link_object.bits}"
            )
        for parameter in self.parameters:
            check_parameter(self.name, parameter)
        check_number("temperature_scale", self.temperature_scale, 1e-4, 10.0, "deg C a count")
        if self.soft_limits is not None:
            _ = self.soft_limits_counts

    @property
    def soft_limits_counts(self) -> tuple[int, int] | None:
        """Soft limits in encoder counts, lower first; raises ConfigError beyond 607Dh."""
        if self.soft_limits is None:
            return None
        low, high = self.soft_limits
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise ConfigError(
                f"node '{self.name}': soft_limits is [{low:g}, {high:g}] rad; low must be below "
                "high"
            )
        ends = sorted((self.motor.to_counts(low), self.motor.to_counts(high)))
        if ends[0] < -LARGEST_COUNT or ends[1] > LARGEST_COUNT:
            raise ConfigError(
                f"node '{self.name}': soft_limits are {ends[0]} to {ends[1]} counts; 607Dh holds "
                f"{LARGEST_COUNT}: zero the encoder, or leave them out"
            )
        return (ends[0], ends[1])

    def rpdo_id(self, pdo: PdoConfig) -> int:
        """COB-ID of an RPDO."""
        return _given(pdo, RPDO_BASES[pdo.number - 1] + self.node_id)

    def tpdo_id(self, pdo: PdoConfig) -> int:
        """COB-ID of a TPDO."""
        return _given(pdo, TPDO_BASES[pdo.number - 1] + self.node_id)


def _given(pdo: PdoConfig, predefined: int) -> int:
    return predefined if pdo.cob_id is None else pdo.cob_id


NOT_IN_FILES = "not in files"
"""Metadata of a field that is no key of a bus file."""
FASTEST_START = 5.0
"""Highest speed of the move to the start posture, before a run begins [rad/s]."""


def check_start_speed(speed: float) -> None:
    """Refuse a start speed [rad/s] that is not above 0 or is too fast; raises ConfigError."""
    if not 0.0 < speed <= FASTEST_START:
        raise ConfigError(
            f"start_speed is {speed:g} rad/s; it must be above 0 and at most {FASTEST_START:g}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class BusConfig:
    """A bus with its drives, in the order of the leg's joints.

    Raises:
        ConfigError: ids or COB-IDs used twice, or times that no bus keeps.
    """

    nodes: tuple[NodeConfig, ...]
    interface: str | None = None
    """python-can's name of the interface; its own configuration decides if none is given."""
    channel: str | None = None
    bitrate: int = 1_000_000
    """Bitrate of the bus [bit/s]."""
    period_us: int = 1000
    tpdo_deadline_us: int = 700
    """Deadline of the TPDOs after SYNC; later process data counts as lost [us]. A reply delay of
    250 us, two full frames and a heartbeat in front make 640 us at 1 Mbit/s; RPDOs need 230 us
    after it."""
    master_id: int = 126
    """Node id under which the master produces the heartbeat that the drives watch."""
    heartbeat_ms: int = 20
    """Heartbeat period of every drive (1017h) [ms]; a drive is lost after three."""
    master_heartbeat_ms: int = 10
    """Heartbeat period of the master [ms]; the drives stop after three without one (1016h)."""
    sdo_timeout_ms: int = 200
    sdo_retries: int = 3
    settle_cycles: int = 20
    """Number of cycles with regular process data before a drive is enabled."""
    enable_spread_ms: int = 100
    """Longest time for which one drive may be enabled and another not yet [ms]; then both lose
    their power. Drives tell within a few cycles, one with a holding brake once it has opened it."""
    start_speed: float = 2.0
    """Speed of the move to the start posture, before a run begins [rad/s]."""
    stated_bitrate: int | None = field(default=None, metadata={NOT_IN_FILES: True})
    """Bitrate in the bus file, where an interface is opened at another `bitrate` [bit/s]."""
    waive: tuple[str, ...] = ()
    """Protections that these drives do without, by name; every run says so."""

    def __post_init__(self) -> None:
        if not self.nodes:
            raise ConfigError("a bus needs at least one node")
        ids = [node.node_id for node in self.nodes]
        if self.master_id in ids or len(set(ids)) != len(ids):
            raise ConfigError(
                f"node ids {', '.join(map(str, ids))} and master {self.master_id} must differ"
            )
        names = [node.name for node in self.nodes]
        if len(set(names)) != len(names):
            raise ConfigError(f"nodes are named {', '.join(names)}; names must differ")
        self._check_pdos()
        check_waivers(self.waive, BUS_WAIVERS, "bus")
        numbers = {name: getattr(self, name) for name in (*BUS_NUMBERS, "heartbeat_ms")}
        check_bus_numbers(numbers, self.waive)
        check_start_speed(self.start_speed)
        if not 0 < self.tpdo_deadline_us < self.period_us:
            raise ConfigError(
                f"tpdo_deadline_us is {self.tpdo_deadline_us}; it must lie within the period of "
                f"{self.period_us} us"
            )

    def _check_pdos(self) -> None:
        users: dict[str, int] = {}
        for node in self.nodes:
            for words, pdos, cob_of in (
                ("RPDO", node.rpdos, node.rpdo_id),
                ("TPDO", node.tpdos, node.tpdo_id),
            ):
                numbers = [pdo.number for pdo in pdos]
                if len(set(numbers)) != len(numbers):
                    raise ConfigError(f"node '{node.name}' has {words}s {numbers}; each once")
                users |= {f"{words}{pdo.number} of '{node.name}'": cob_of(pdo) for pdo in pdos}
        check_distinct(users)

    def at(self, bitrate: int | None) -> "BusConfig":
        """Return this bus as an interface at another bitrate sees it [bit/s]."""
        if bitrate in (None, self.bitrate):
            return self
        return replace(self, bitrate=bitrate, stated_bitrate=self.bitrate)

    @property
    def bitrate_text(self) -> str:
        """Bitrate of this bus in words, and whether it comes from the bus file or a flag."""
        if self.stated_bitrate is None:
            return f"the bus file says {self.bitrate} bit/s"
        return (
            f"{self.bitrate} bit/s is asked for, but the bus file says {self.stated_bitrate} "
            "bit/s: leave --bitrate out, or give that of the drives"
        )

    @property
    def period(self) -> float:
        """Period of the cycle [s]."""
        return 1e-6 * self.period_us

    @property
    def period_ns(self) -> int:
        """Period of the cycle as a whole number [ns]."""
        return 1000 * self.period_us
