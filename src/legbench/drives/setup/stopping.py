"""How far a motor runs on after a quick stop, from the limits and the drive's own ramp."""

import math

from legbench.drives.setup.config import BusConfig, NodeConfig
from legbench.errors import ConfigError
from legbench.limits.safety import SafetyLimits

QUICK_STOP_DECELERATION = (0x6085, 0)
LONGEST_WAY = 0.2
"""Longest way of a quick stop [rad]: the series springs take up this deflection unharmed."""


def stopping_way(node: NodeConfig, speed: float) -> float:
    """Way of a quick stop from `speed` [rad/s] on the ramp 6085h [rad].

    Raises:
        ConfigError: the bus file sets no ramp: some drives then never stop.
    """
    for parameter in node.parameters:
        if parameter.key == QUICK_STOP_DECELERATION and parameter.value > 0:
            return speed * speed * abs(node.motor.counts_per_rad) / (2.0 * parameter.value)
    raise ConfigError(
        f"drive '{node.name}' has no quick-stop ramp: give \"6085:00 u32\" [counts/s2] above 0 in "
        "its parameters"
    )


def check_stopping(config: BusConfig, limits: SafetyLimits) -> None:
    """Refuse ramps on which a motor at the fastest command runs on too far.

    Raises:
        ConfigError: a drive needs more than 0.2 rad to stop, or has no ramp.
    """
    for node in config.nodes:
        way = stopping_way(node, limits.command_speed)
        if LONGEST_WAY < way < math.inf:
            raise ConfigError(
                f"drive '{node.name}' needs {way:.3g} rad to stop from {limits.command_speed:g} "
                f"rad/s on its quick-stop ramp (6085h), the limit is {LONGEST_WAY:g} rad: raise "
                "6085h in the bus file, or lower command_speed"
            )
