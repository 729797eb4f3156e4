"""Time within which every drive notices that its master has died, and stands; pure.

A process that is killed, a computer that hangs and a cable that is pulled send no quick stop. What
counts is therefore not the value of a key but a property: by at least one of its own means every
drive stands within 100 ms of its master's last frame.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from legbench.drives.protocol.objects import Key
from legbench.drives.setup.config import CONTROLWORD, TARGET_POSITION, BusConfig, NodeConfig
from legbench.drives.setup.configuration import configuration, quick_stop_ramp
from legbench.errors import ConfigError
from legbench.limits.upper_ends import MASTER_WATCH

CONNECTION_LOST, CONSUMER = (0x6007, 0), (0x1016, 1)
"""Reaction to a lost connection, and the heartbeat that a drive watches."""
STOPS = (1, 3)
"""Values of 6007h that stop a motor: by the reaction to a fault, and by quick stop."""
LONGEST_TIME_MS = 0xFFFF
"""Time that 1016h holds in its lower half [ms]."""
LONGEST_STOP_MS = 100.0
"""Longest time from the last frame of the master to standstill of every drive [ms].

A motor has gone 0.2 rad by then at the 2 rad/s of a move, which the series springs take up, and
half of a joint's range at the 5 rad/s of a jump.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Means:
    """Means by which a drive notices that its master is gone."""

    name: str
    """Name of the object that makes the drive notice."""
    time_ms: float
    """Longest time from the last frame of the master to the reaction of the drive [ms]."""
    ramp_ms: float
    """Time from the reaction to standstill, on the ramp of a quick stop [ms]."""

    @property
    def stop_ms(self) -> float:
        """Longest time from the last frame of the master to standstill [ms]."""
        return self.time_ms + self.ramp_ms


def means_of(
    config: BusConfig,
    node: NodeConfig,
    *,
    speed: float = math.inf,
    commands: bool = True,
    held: Mapping[Key, int] | None = None,
) -> tuple[Means, ...]:
    """Return every means that a drive has, the fastest first.

    The heartbeat consumer (1016h) and the deadline of an RPDO (140xh:05) lead to the quick stop of
    6007h, all written and read back before a drive is enabled. Without 6007h, and for a watch over
    SYNC (1006h), the standard leaves what follows to the maker of the drive: they are not counted.

    Args:
        config: the bus.
        node: one of its drives.
        speed: highest speed of the motor; without one, or a ramp in the bus file, the ramp counts
            as no time [rad/s].
        commands: RPDOs are sent, as in a run; the deadline of one that never comes never ends.
        held: what the drive holds, read back; by default what it is going to be written.
    """
    if held is None:
        held = {entry.key: entry.value for entry in configuration(config, node)}
    if held.get(CONNECTION_LOST) not in STOPS:
        return ()
    ramp_ms = _ramp_ms(node, speed, held)
    # A drive checks its timers once per cycle of its own.
    late_ms = 1e-3 * config.period_us
    found: list[tuple[str, float]] = []
    watched = held.get(CONSUMER, 0)
    if watched >> 16 == config.master_id and watched & LONGEST_TIME_MS:
        found.append(("heartbeat consumer 1016h", watched & LONGEST_TIME_MS))
    for pdo in node.rpdos if commands else ():
        leads = CONTROLWORD in pdo.objects or TARGET_POSITION in pdo.objects
        deadline_ms = held.get((0x1400 + pdo.number - 1, 5), 0)
        if leads and deadline_ms:
            name = f"deadline of RPDO{pdo.number} {0x1400 + pdo.number - 1:04X}h:05"
            found.append((name, deadline_ms))
    means = [
        Means(name=name, time_ms=time_ms + late_ms, ramp_ms=ramp_ms) for name, time_ms in found
    ]
    return tuple(sorted(means, key=lambda one: one.time_ms))


def _ramp_ms(node: NodeConfig, speed: float, held: Mapping[Key, int]) -> float:
    """Time of a quick stop from a speed; 0 where one of the two is not known [ms]."""
    ramp = held.get(quick_stop_ramp(node), 0)
    if ramp <= 0 or not math.isfinite(speed):
        return 0.0
    return 1e3 * speed * abs(node.motor.counts_per_rad) / ramp


def check_master_watch(
    config: BusConfig,
    *,
    speed: float = math.inf,
    commands: bool = True,
    held: Mapping[str, Mapping[Key, int]] | None = None,
) -> None:
    """Refuse a bus whose drives would go on without their master; arguments as for `means_of`.

    What drives hold is given by the name of their node; one that is left out is not looked at.

    Raises:
        ConfigError: a drive has no means, or stands later than 100 ms after its master's death, and
            the bus file does not waive "master watch".
    """
    if MASTER_WATCH in config.waive:
        return
    for node in config.nodes:
        if held is not None and node.name not in held:
            continue
        there = None if held is None else held[node.name]
        means = means_of(config, node, speed=speed, commands=commands, held=there)
        if means and means[0].stop_ms <= LONGEST_STOP_MS:
            continue
        ways = ["give its RPDO a deadline_ms"] if commands else []
        if means:
            ramp, _ = quick_stop_ramp(node)
            ways.append(f"lower master_heartbeat_ms or raise {ramp:04X}h")
        elif not node.heartbeat_consumer:
            ways.append("heartbeat_consumer = true")
        ways.append(f'waive = ["{MASTER_WATCH}"] in the bus file')
        raise ConfigError(
            f"drive '{node.name}' would not stand within {LONGEST_STOP_MS:g} ms of its master's "
            f"death: {_describe(means, commands=commands)}; {', or '.join(ways)}"
        )


def _describe(means: Sequence[Means], *, commands: bool) -> str:
    if not means:
        which = "that is 1016h or 140xh:05, both" if commands else "led by SDO, that is 1016h"
        return f"it has no means to notice it, {which} with 6007h"
    return ", ".join(f"{one.stop_ms:.1f} ms by its {one.name}" for one in means)


def stop_ms(config: BusConfig, *, speed: float = math.inf) -> float:
    """Latest standstill of any drive after its master's death, infinite where one has no means."""
    means = [means_of(config, node, speed=speed) for node in config.nodes]
    return max(entry[0].stop_ms if entry else math.inf for entry in means)
