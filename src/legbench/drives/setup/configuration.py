"""The objects that bring a drive into cyclic synchronous position mode, in writing order."""

from collections.abc import Iterator

from legbench.drives.protocol.cia402 import Mode
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import COB_INVALID, COB_NO_REMOTE, SYNC_ID
from legbench.drives.protocol.objects import PDO_COUNT, Key
from legbench.drives.setup.bus_numbers import WORD
from legbench.drives.setup.config import BusConfig, NodeConfig, Parameter, PdoConfig
from legbench.errors import ConfigError

HEARTBEATS_MISSED = 3
"""Number of periods without the master's heartbeat after which a drive stops (1016h)."""
QUICK_STOP = 3
"""Option code of 6007h that makes a drive quick-stop when the connection is lost."""
EVERY_SYNC = 1
"""Transmission type: latched, or sampled, at every SYNC."""
U8, U16, U32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32
I8, I16, I32 = DataType.INTEGER8, DataType.INTEGER16, DataType.INTEGER32
SLOW_DOWN, QUICK_STOP_RAMP = (0x6084, 0), (0x6085, 0)
"""Profile deceleration and quick-stop deceleration, one of which a quick stop brakes with."""
STOP_OPTIONS = ((0x605B, 1), (0x605C, 1), (0x605D, 2), (0x605E, 2))
"""Stop option codes that make a drive stop on a ramp, by object: 0 would let the leg drop."""
OFFSETS = ((0x60B0, I32), (0x60B1, I32), (0x60B2, I16), (0x607E, U8))
"""Objects that offset every target or turn its sign, and their types: values left by another
program would move the motor, so all are set to 0."""


def interpolation_time(period_us: int) -> tuple[int, int]:
    """Value and power of ten of 60C2h for a period.

    Raises:
        ConfigError: the object cannot say it.
    """
    value, exponent = period_us, -6
    while value % 10 == 0:
        value, exponent = value // 10, exponent + 1
    if value > 255:
        raise ConfigError(f"period_us is {period_us}; object 60C2h cannot say it")
    return value, exponent


def quick_stop_option(node: NodeConfig) -> int:
    """Quick stop option (605Ah): 1 on the ramp 6084h if the bus file gives that one alone, else 2.

    Both lead to switch on disabled.
    """
    return 1 if quick_stop_ramp(node) == SLOW_DOWN else 2


def quick_stop_ramp(node: NodeConfig) -> Key:
    """Return the object whose ramp a quick stop brakes on: 6084h if the bus file gives no 6085h."""
    given = {parameter.key for parameter in node.parameters}
    return SLOW_DOWN if SLOW_DOWN in given and QUICK_STOP_RAMP not in given else QUICK_STOP_RAMP


def configuration(bus: BusConfig, node: NodeConfig) -> Iterator[Parameter]:
    """Return all objects that a drive is sent in pre-operational, default values included."""
    value, exponent = interpolation_time(bus.period_us)
    watched = bus.master_id << 16 | min(WORD, HEARTBEATS_MISSED * bus.beat_ms)
    yield _parameter(0x1005, 0, U32, SYNC_ID)  # bit 30 clear: the drive is no SYNC producer
    yield _parameter(0x1006, 0, U32, bus.period_us)
    if node.heartbeat_consumer:
        yield _parameter(0x1016, 1, U32, watched)
    yield _parameter(0x1017, 0, U16, bus.heartbeat_ms)
    yield _parameter(0x1029, 1, U8, 0)  # a communication error leads to pre-operational
    yield _parameter(0x6007, 0, I16, QUICK_STOP)
    yield _parameter(0x605A, 0, I16, quick_stop_option(node))
    # Some drives fix the power of ten, to which the value then has to be fitted.
    yield _parameter(0x60C2, 2, I8, exponent)
    yield _parameter(0x60C2, 1, U8, value)
    for index, kind in OFFSETS:
        yield _parameter(index, 0, kind, 0)
    given = {parameter.key for parameter in node.parameters}
    for index, value in STOP_OPTIONS:
        if (index, 0) not in given:
            yield _parameter(index, 0, I16, value)
    yield from node.parameters
    if node.soft_limits_counts is not None:
        low, high = node.soft_limits_counts
        yield _parameter(0x607D, 1, I32, low)
        yield _parameter(0x607D, 2, I32, high)
    for pdos, base, cob_of, flags in (
        (node.rpdos, 0x1400, node.rpdo_id, 0),
        (node.tpdos, 0x1800, node.tpdo_id, COB_NO_REMOTE),
    ):
        used = {pdo.number: pdo for pdo in pdos}
        for number in sorted({*range(1, PDO_COUNT + 1), *used}):
            pdo = used.get(number)
            if pdo is None:
                yield _parameter(
                    base + number - 1, 1, U32, COB_INVALID | _spare(base, number, node)
                )
            else:
                yield from _pdo(base + number - 1, pdo, flags | cob_of(pdo))
    yield _parameter(0x6060, 0, I8, Mode.CYCLIC_SYNCHRONOUS_POSITION)


def _pdo(comm: int, pdo: PdoConfig, cob: int) -> Iterator[Parameter]:
    """Yield the objects of a PDO in CiA 301's order (7.5.2.36): off, unmap, map, type, on."""
    yield _parameter(comm, 1, U32, COB_INVALID | cob)
    yield _parameter(comm + 0x200, 0, U8, 0)
    for sub, entry in enumerate(pdo.objects, start=1):
        yield _parameter(comm + 0x200, sub, U32, entry.word)
    yield _parameter(comm + 0x200, 0, U8, len(pdo.objects))
    yield _parameter(comm, 2, U8, EVERY_SYNC)
    if comm < 0x1800 and pdo.deadline_ms:
        yield _parameter(comm, 5, U16, pdo.deadline_ms)
    yield _parameter(comm, 1, U32, cob)


def _spare(base: int, number: int, node: NodeConfig) -> int:
    first = 0x200 if base == 0x1400 else 0x180
    return first + 0x100 * (number - 1) + node.node_id


def _parameter(index: int, sub: int, kind: DataType, value: int) -> Parameter:
    return Parameter(index=index, sub=sub, kind=kind, value=value)
