"""Time at which a request beside the cycle may be sent, so that no answer is late; pure."""

from legbench.drives.protocol.pdo import PdoMap
from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.wire import worst_bits

PATIENCE_MS = 100
"""Longest wait for a cycle with room [ms]; then a request is sent all the same."""
SDO_BYTES = 8
"""Length of every SDO frame, request and answer (CiA 301, 7.2.4.3) [bytes]."""


def latest_request_us(bus: BusConfig) -> int:
    """Latest time after a tick at which a request may leave, so that no answer is late [us].

    A frame on the wire is not interrupted (ISO 11898-1): an answer that begins just before SYNC
    holds it up by 135 us at 1 Mbit/s, and with it the answers to SYNC. These have room for one
    heartbeat in front of SYNC (`exchange`), so the SDO answer may end as late as that one would.
    The request goes first, the commands behind it while the drive prepares its answer; a heartbeat
    may be in front of each of the two frames. A drive is taken to answer a request as fast as SYNC.
    Negative where the period has no room.
    """
    latest = []
    for channel in bus.channels:
        commands = sum(
            worst_bits(PdoMap(pdo.objects).size)
            for node in bus.nodes_on(channel)
            for pdo in node.rpdos
        )
        # Two heartbeats are in front, one is what the answers have room for after the period.
        frames_us = 1e6 * (2 * worst_bits(SDO_BYTES) + worst_bits(1)) / bus.bitrate
        wait_us = max(bus.reply_delay_us, 1e6 * commands / bus.bitrate)
        latest.append(bus.period_us - frames_us - wait_us)
    return int(min(latest))
