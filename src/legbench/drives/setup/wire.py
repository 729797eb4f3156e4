"""Bits on the wire of classic CAN (ISO 11898-1): lengths, stuffing, bus load; pure."""

from dataclasses import dataclass

from legbench.drives.protocol.frame import SYNC_ID, Frame
from legbench.drives.protocol.pdo import PdoMap
from legbench.drives.setup.config import BusConfig
from legbench.errors import ConfigError

OVERHEAD_BITS = 47
"""Length of a frame with 11-bit identifier and no data, interframe space included [bits]."""
STUFFED_BITS = 34
"""Part of `OVERHEAD_BITS` subject to stuffing: start of frame to CRC sequence [bits]."""
EXTENDED_BITS = 20
"""Length that a 29-bit identifier adds to a frame, all of it subject to stuffing [bits]."""
ERROR_BITS = 23
"""Longest error frame of active nodes: superposed flags, delimiter, intermission [bits]."""
MAX_LOAD = 0.80
"""Largest bus load of the cyclic schedule, which leaves room for emergencies and retries [-]."""
_CRC_POLYNOMIAL = 0x4599


def worst_bits(length: int, *, extended: bool = False) -> int:
    """Longest that a frame of `length` bytes can be [bits]."""
    extra = EXTENDED_BITS if extended else 0
    stuffed = STUFFED_BITS + extra + 8 * length
    return OVERHEAD_BITS + extra + 8 * length + (stuffed - 1) // 4


def plain_bits(length: int, *, extended: bool = False) -> int:
    """Length of a frame without stuff bits [bits]."""
    return OVERHEAD_BITS + (EXTENDED_BITS if extended else 0) + 8 * length


def exact_bits(frame: Frame) -> int:
    """Length of this very frame, its stuff bits counted [bits]."""
    stream = _stream(frame)
    stuffing, run, last = 0, 0, -1
    for bit in stream:
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            stuffing, run, last = stuffing + 1, 1, 1 - bit
    return plain_bits(len(frame.data), extended=frame.extended) + stuffing


def _stream(frame: Frame) -> list[int]:
    """Bits from start of frame to CRC sequence."""
    if frame.extended:
        head = [*_bits(frame.cob_id >> 18, 11), 1, 1, *_bits(frame.cob_id & 0x3FFFF, 18)]
    else:
        head = _bits(frame.cob_id, 11)
    control = [int(frame.remote), 0, 0]
    stream = [0, *head, *control, *_bits(frame.length, 4)]
    for byte in frame.data:
        stream += _bits(byte, 8)
    crc = 0
    for bit in stream:
        carry = bit ^ crc >> 14 & 1
        crc = crc << 1 & 0x7FFF
        if carry:
            crc ^= _CRC_POLYNOMIAL
    return stream + _bits(crc, 15)


def _bits(value: int, width: int) -> list[int]:
    return [value >> place & 1 for place in range(width - 1, -1, -1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadEntry:
    """One kind of frame in the schedule."""

    what: str
    bits: int
    """Length of the frame at worst-case bit stuffing [bits]."""
    rate: float
    """Number of frames per second [1/s]."""


def schedule(bus: BusConfig, channel: str | None = None) -> tuple[LoadEntry, ...]:
    """Return every frame that is sent regularly, with its worst length and rate.

    Args:
        bus: the bus.
        channel: one of its channels; by default the first one.
    """
    rate = 1e6 / bus.period_us
    entries = [LoadEntry(what=f"SYNC {SYNC_ID:03X}h", bits=worst_bits(0), rate=rate)]
    for node in bus.nodes_on(bus.channels[0] if channel is None else channel):
        for words, pdos, cob_of in (
            ("RPDO", node.rpdos, node.rpdo_id),
            ("TPDO", node.tpdos, node.tpdo_id),
        ):
            entries += [
                LoadEntry(
                    what=f"{words}{pdo.number} {cob_of(pdo):03X}h {node.name}",
                    bits=worst_bits(PdoMap(pdo.objects).size),
                    rate=rate,
                )
                for pdo in pdos
            ]
        entries.append(
            LoadEntry(
                what=f"heartbeat {node.name}", bits=worst_bits(1), rate=1e3 / bus.heartbeat_ms
            )
        )
    beat = min(rate, 1e3 / bus.master_heartbeat_ms)
    entries.append(LoadEntry(what="heartbeat master", bits=worst_bits(1), rate=beat))
    return tuple(entries)


def bus_load(bus: BusConfig, channel: str | None = None) -> float:
    """Worst-case share of a channel's bitrate that the schedule takes, as for `schedule` [-]."""
    return sum(entry.bits * entry.rate for entry in schedule(bus, channel)) / bus.bitrate


def check_load(bus: BusConfig) -> float:
    """Return the worst-case load of the fullest channel, refusing one that it cannot carry.

    Raises:
        ConfigError: it is above 80 %.
    """
    load = max(bus_load(bus, channel) for channel in bus.channels)
    if load > MAX_LOAD:
        stated = "" if bus.stated_bitrate is None else f"; {bus.bitrate_text}"
        raise ConfigError(
            f"the schedule takes {100 * load:.0f} % of {bus.bitrate} bit/s at worst, the limit is "
            f"{100 * MAX_LOAD:.0f} %; raise bitrate or period_us, or map fewer objects{stated}"
        )
    return load
