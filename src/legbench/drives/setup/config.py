"""Configuration of a bus: nodes, their identity, process data and units, as frozen values."""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path

from legbench.drives.protocol.frame import LAST_NODE, RPDO_BASES, TPDO_BASES
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.bus_numbers import BUS_NUMBERS, check_bus_numbers, check_start_speed
from legbench.drives.setup.cob_ids import check_distinct
from legbench.drives.setup.encoders import Side, check_encoder, check_sides, known_signals
from legbench.drives.setup.homed import HomedCondition
from legbench.drives.setup.identity import Identity as Identity
from legbench.drives.setup.parameters import Parameter, check_parameter
from legbench.drives.setup.pdos import (
    CONTROLWORD,
    LINK_POSITION_SHORT,
    POSITION_ACTUAL,
    RPDO,
    STATUSWORD,
    TARGET_POSITION,
    TPDO,
    PdoConfig,
    check_mapped,
)
from legbench.drives.setup.pdos import LINK_POSITION as LINK_POSITION
from legbench.drives.setup.quirks import Quirks
from legbench.drives.setup.units import AxisUnits
from legbench.errors import ConfigError
from legbench.limits.safety import Range
from legbench.limits.upper_ends import BUS_WAIVERS, check_number, check_waivers

LARGEST_COUNT = (1 << 31) - 1
"""Highest count of a 32-bit position object [counts]."""


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
    """Units of position and target (6064h, 607Ah)."""
    link: AxisUnits | None
    """Units of the second encoder, at the link; none on a drive that has one encoder."""
    side: Side = Side.MOTOR
    """Side of the spring on which the encoder of 6064h sits."""
    channel: str | None = None
    """Channel of the drive, where it is not that of the bus."""
    motor_object: Mapped = POSITION_ACTUAL
    target_object: Mapped = TARGET_POSITION
    link_object: Mapped = LINK_POSITION_SHORT
    torque_object: Mapped | None = None
    """Object in which the drive sends its torque every cycle; none if it does not."""
    torque_scale: float = 0.0
    """Torque at the joint of one count of `torque_object` [N m]."""
    rpdos: tuple[PdoConfig, ...] = (RPDO,)
    tpdos: tuple[PdoConfig, ...] = (TPDO,)
    parameters: tuple[Parameter, ...] = ()
    """Objects written after those of `configuration.configuration`, in this order."""
    temperature_object: Mapped | None = None
    """Object in which the drive reports its temperature, a number; none if it does not."""
    temperature_scale: float = 0.1
    """Temperature of one count of `temperature_object`, which depends on the maker [deg C]."""
    heartbeat_consumer: bool = True
    """Whether the drive has 1016h, and so stops when its master's heartbeat is missing; some have
    not, and must be given a `deadline_ms` of their commands instead."""
    homed: HomedCondition | None = None
    """How the drive shows that it is homed, without which nothing moves; none needs no homing, as
    with an absolute encoder."""
    eds: Path | None = None
    """Electronic data sheet of the drive, relative to the bus file; an emulated one wears it."""
    soft_limits: Range | None = None
    """Motor range to which the drive itself clamps targets (607Dh) [rad]; none sets no range."""
    quirks: Quirks = field(default_factory=Quirks)

    def __post_init__(self) -> None:
        if not 1 <= self.node_id <= LAST_NODE:
            raise ConfigError(f"node '{self.name}' has id {self.node_id}; it must be 1 to 127")
        commands = (CONTROLWORD, self.target_object)
        check_mapped(self.name, self.rpdos, commands, "RPDO")
        check_mapped(self.name, self.tpdos, self.answers, "TPDO")
        self._check_encoders()
        for parameter in self.parameters:
            check_parameter(self.name, parameter)
        check_number("temperature_scale", self.temperature_scale, 1e-4, 10.0, "deg C a count")
        if self.soft_limits is not None:
            _ = self.soft_limits_counts

    @property
    def answers(self) -> tuple[Mapped, ...]:
        """Objects that the drive sends every cycle: statusword, positions, and its torque."""
        second = None if self.link is None else self.link_object
        optional = (second, self.torque_object)
        found = tuple(entry for entry in optional if entry is not None)
        return (STATUSWORD, self.motor_object, *found)

    @property
    def link_units(self) -> AxisUnits:
        """Units of the second encoder; raises ConfigError on a drive that has one encoder."""
        if self.link is None:
            raise ConfigError(
                f"node '{self.name}' has no second encoder, which [node.link] describes"
            )
        return self.link

    @property
    def knows(self) -> frozenset[str]:
        """Names of the signals that the drive tells of its joint, see `known_signals`."""
        second, torque = self.link is not None, self.torque_object is not None
        return known_signals(self.side, second=second, torque=torque)

    def _check_encoders(self) -> None:
        check_sides(self.name, self.side, self.link)
        for entry in (self.motor_object, self.target_object):
            check_encoder(self.name, self.side, self.motor, entry)
        if self.link is not None:
            check_encoder(self.name, "link", self.link, self.link_object)
        if self.torque_object is not None:
            check_number("torque_scale", self.torque_scale, 1e-6, 1e3, "N m a count")

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
        lowest = max(self.motor.lowest, -LARGEST_COUNT)
        highest = min(self.motor.lowest + self.motor.modulus - 1, LARGEST_COUNT)
        if ends[0] < lowest or ends[1] > highest:
            raise ConfigError(
                f"node '{self.name}': soft_limits are {ends[0]} to {ends[1]} counts; 607Dh holds "
                f"{lowest} to {highest}: zero the encoder, or leave them out"
            )
        return (ends[0], ends[1])

    def rpdo_id(self, pdo: PdoConfig) -> int:
        """COB-ID of an RPDO."""
        return pdo.identifier(RPDO_BASES, self.node_id)

    def tpdo_id(self, pdo: PdoConfig) -> int:
        """COB-ID of a TPDO."""
        return pdo.identifier(TPDO_BASES, self.node_id)


USUAL_DEADLINE = 0.72
"""Share of the period that drives have for their answers [-]."""
NOT_IN_FILES = "not in files"
"""Metadata of a field that is no key of a bus file."""


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
    tpdo_deadline_us: int | None = None
    """Deadline of the TPDOs after SYNC; later process data counts as lost; by default 72 % of the
    period [us]. A reply delay of 250 us, two full frames and two heartbeats in front make 705 us at
    1 Mbit/s; RPDOs and a heartbeat in front of them need 295 us after it."""
    reply_delay_us: int = 250
    """Longest time from SYNC until a drive begins to send its first answer [us]."""
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
        if not 0 < self.deadline_us < self.period_us:
            raise ConfigError(
                f"tpdo_deadline_us is {self.deadline_us}; it must lie within the period of "
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
    def channels(self) -> tuple[str | None, ...]:
        """Channels that drives hang on, in the order of the drives, each once."""
        return tuple(dict.fromkeys(map(self.channel_of, self.nodes)))

    def channel_of(self, node: NodeConfig) -> str | None:
        """Channel of a drive: its own, else that of the bus."""
        return self.channel if node.channel is None else node.channel

    def nodes_on(self, channel: str | None) -> tuple[NodeConfig, ...]:
        """Drives on a channel, in their order."""
        return tuple(node for node in self.nodes if self.channel_of(node) == channel)

    @property
    def two_encoders(self) -> bool:
        """Whether every drive has an encoder on both sides of its spring."""
        return all(node.link is not None for node in self.nodes)

    @property
    def deadline_us(self) -> int:
        """Deadline of the TPDOs after SYNC [us]."""
        given = self.tpdo_deadline_us
        return round(USUAL_DEADLINE * self.period_us) if given is None else given

    def cycles_in(self, time_ms: float) -> int:
        """Number of cycles that last for a time [ms] or longer, 1 or more."""
        return max(1, math.ceil(1000 * time_ms / self.period_us))

    @property
    def beat_ms(self) -> int:
        """Longest time between two heartbeats of the master, which leave on ticks [ms]."""
        ticks = math.ceil(1000 * self.master_heartbeat_ms / self.period_us)
        return math.ceil(1e-3 * ticks * self.period_us)

    @property
    def period(self) -> float:
        """Period of the cycle [s]."""
        return 1e-6 * self.period_us

    @property
    def period_ns(self) -> int:
        """Period of the cycle as a whole number [ns]."""
        return 1000 * self.period_us
