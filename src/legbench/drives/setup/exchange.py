"""Time that the frames of a cycle take at worst: answers and commands of every channel; pure.

Of the frames that are ready, the one with the lowest identifier is sent first, and a frame that is
on the wire already is not interrupted (ISO 11898-1). So a heartbeat that has just begun may be in
front of SYNC, another one in front of the answers, a third one in front of the commands: both
drives and the master send them, each on a clock of its own. The last answer of a channel ends, at
worst, after SYNC, the longest reply delay, two heartbeats and all answers. An SDO answer, which is
longer, is asked for when it keeps SYNC no longer than a heartbeat does (`asking`).
"""

import math
from dataclasses import dataclass

from legbench.drives.protocol.pdo import PdoMap
from legbench.drives.setup.config import BusConfig, PdoConfig
from legbench.drives.setup.wire import check_load, worst_bits
from legbench.errors import ConfigError


@dataclass(frozen=True, slots=True, kw_only=True)
class Exchange:
    """Longest exchange of one channel, from the tick at which SYNC is to be sent."""

    channel: str | None
    answers_us: float
    """Time at which the last answer has come [us]."""
    commands_us: float
    """Time at which the last command is out, if it leaves as soon as all answers are in [us]."""


def exchanges(bus: BusConfig) -> tuple[Exchange, ...]:
    """Return the longest exchange of every channel."""
    found: list[Exchange] = []
    for channel in bus.channels:
        nodes = bus.nodes_on(channel)
        beats = _heartbeats(bus, len(nodes))
        answers = worst_bits(0) + sum(_bits(node.tpdos) for node in nodes)
        commands = answers + sum(_bits(node.rpdos) for node in nodes)
        answers += worst_bits(1) * min(2, beats)
        commands += worst_bits(1) * min(3, beats)
        answers_us = bus.reply_delay_us + 1e6 * answers / bus.bitrate
        commands_us = bus.reply_delay_us + 1e6 * commands / bus.bitrate
        found.append(Exchange(channel=channel, answers_us=answers_us, commands_us=commands_us))
    return tuple(found)


def _heartbeats(bus: BusConfig, drives: int) -> int:
    """Largest number of heartbeats in a cycle on a channel with so many drives and the master."""
    return drives * math.ceil(bus.period_us / (1000 * bus.heartbeat_ms)) + 1


def _bits(pdos: tuple[PdoConfig, ...]) -> int:
    """Length of some PDOs at worst [bits]."""
    return sum(worst_bits(PdoMap(pdo.objects).size) for pdo in pdos)


def check_budget(bus: BusConfig) -> float:
    """Return the worst-case load of the fullest channel, refusing what no bus can carry in time.

    Raises:
        ConfigError: as `check_load` and `check_exchange`.
    """
    load = check_load(bus)
    check_exchange(bus)
    return load


def check_exchange(bus: BusConfig) -> None:
    """Refuse a bus on which answers come too late, or commands miss the next SYNC.

    Raises:
        ConfigError: the last answer may come after the deadline, or the last command after the
            next SYNC.
    """
    for one in exchanges(bus):
        where = "" if len(bus.channels) == 1 else f" on {one.channel}"
        stated = "" if bus.stated_bitrate is None else f" ({bus.bitrate_text})"
        rate = f"{bus.bitrate} bit/s{stated}"
        if one.answers_us > bus.deadline_us:
            raise ConfigError(
                f"the last answer{where} may come {one.answers_us:.0f} us after SYNC at {rate}, "
                f"tpdo_deadline_us is {bus.deadline_us} us: {_way(bus, one)}"
            )
        if one.commands_us > bus.period_us:
            raise ConfigError(
                f"the last command{where} may go out {one.commands_us:.0f} us after SYNC at "
                f"{rate}, after the next one at {bus.period_us} us: map fewer objects, raise "
                "bitrate or period_us (1000, 2000 or 4000), or give each drive a channel"
            )


def _way(bus: BusConfig, one: Exchange) -> str:
    """Advice on how to let the last answer come in time."""
    if one.commands_us <= bus.period_us and one.answers_us < bus.period_us - 1:
        return f"raise it to {one.answers_us + 1:.0f}, or map fewer objects"
    return (
        "map fewer objects in fewer PDOs, raise bitrate or period_us (1000, 2000 or 4000), or give "
        "each drive a channel"
    )
