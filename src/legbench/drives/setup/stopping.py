"""Way of a motor during a quick stop, from the limits and the drive's own ramp."""

import math

from legbench.drives.setup.config import BusConfig, NodeConfig
from legbench.drives.setup.configuration import quick_stop_ramp
from legbench.errors import ConfigError
from legbench.limits.safety import SafetyLimits
from legbench.limits.upper_ends import QUICK_STOP_RAMP

LONGEST_WAY = 0.2
"""Longest way of a quick stop [rad]: the series springs take up this deflection unharmed."""


def stopping_way(node: NodeConfig, speed: float) -> float:
    """Way of a quick stop from `speed` [rad/s] on the ramp of the bus file, 6085h or 6084h [rad].

    Raises:
        ConfigError: the bus file sets no ramp: some drives then never stop.
    """
    ramp = quick_stop_ramp(node)
    for parameter in node.parameters:
        if parameter.key == ramp and parameter.value > 0:
            return speed * speed * abs(node.motor.counts_per_rad) / (2.0 * parameter.value)
    raise ConfigError(
        f"drive '{node.name}' has no quick-stop ramp: give \"6085:00 u32\" [counts/s2] above 0 in "
        f'its parameters, or "6084:00 u32" for a drive that has no 6085h, or waive = '
        f'["{QUICK_STOP_RAMP}"] in the bus file'
    )


def check_stopping(config: BusConfig, limits: SafetyLimits) -> None:
    """Refuse ramps on which a motor at the fastest command runs on too far.

    Raises:
        ConfigError: a drive needs more than 0.2 rad to stop, or has no ramp, and the bus file does
            not waive "quick-stop ramp".
    """
    if QUICK_STOP_RAMP in config.waive:
        return
    for node in config.nodes:
        way = stopping_way(node, limits.command_speed)
        if LONGEST_WAY < way < math.inf:
            raise ConfigError(
                f"drive '{node.name}' needs {way:.3g} rad to stop from {limits.command_speed:g} "
                f"rad/s on its quick-stop ramp (6085h), the limit is {LONGEST_WAY:g} rad: raise "
                "6085h in the bus file, or lower command_speed"
            )
