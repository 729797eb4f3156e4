"""Whether every mapped object can hold what its joint and its drive may show; pure.

An object that is too short does not end a run: it wraps, and shows another angle, another spring
torque, or a drive that is cool. So it is found before anything moves, from the files alone.
"""

import math
from collections.abc import Sequence

from legbench.drives.protocol.datatypes import DataType, range_of
from legbench.drives.setup.config import BusConfig, NodeConfig
from legbench.drives.setup.units import AxisUnits
from legbench.errors import ConfigError
from legbench.limits.safety import Range, SafetyLimits

SLACK = 0.2
"""Distance beyond its range that a motor may reach, see `stopping.LONGEST_WAY` [rad]."""


def check_field_ranges(
    config: BusConfig, limits: SafetyLimits, stops: Sequence[Range] | None = None
) -> None:
    """Refuse objects that cannot hold what they are to show; a range that is not given is skipped.

    Args:
        config: the bus.
        limits: limits of the leg.
        stops: ranges that the mechanical stops leave the links, one a joint; by default those of
            the limits [rad].

    Raises:
        ConfigError: a motor's or a link's position, or a temperature limit, lies beyond its object.
    """
    for node, motor, joint in zip(
        config.nodes, limits.motor_range, stops or limits.joint_range, strict=True
    ):
        _check_motor(node, motor)
        _check_link(node, joint)
        _check_temperature(node, limits.temperature)


def _check_motor(node: NodeConfig, motor: Range) -> None:
    """Check that 6064h and 607Ah hold every position of the range without wrapping."""
    if not all(map(math.isfinite, motor)):
        return
    units = node.motor
    if units.modulus_counts is not None:
        _check_lap(node, motor)
        return
    ends = sorted(units.to_counts(end) for end in (motor[0] - SLACK, motor[1] + SLACK))
    low, high = units.lowest, units.lowest + units.modulus - 1
    if ends[0] < low or ends[1] > high:
        raise ConfigError(
            f"motor of '{node.name}': its range [{motor[0]:g}, {motor[1]:g}] rad and {SLACK:g} rad "
            f"either way are {ends[0]} to {ends[1]} counts, but position (6064h) and target "
            f"(607Ah) of {units.bits} bits hold {low} to {high}: zero the encoder, or map fewer "
            "counts per turn"
        )


def _check_lap(node: NodeConfig, motor: Range) -> None:
    """Check that the range lies within half a lap of angle 0, so that its first reading is one."""
    half = 0.5 * node.motor.lap
    if max(abs(motor[0] - SLACK), abs(motor[1] + SLACK)) >= half:
        raise ConfigError(
            f"motor of '{node.name}': {node.motor_object} repeats every {2.0 * half:.4g} rad, and "
            f"its range [{motor[0]:g}, {motor[1]:g}] rad with {SLACK:g} rad either way reaches "
            f"beyond {half:.4g} rad from angle 0: where it is at power-on would be a guess; have "
            "the drive count its turns (multi-turn), or choose another offset_counts"
        )


def _check_link(node: NodeConfig, joint: Range) -> None:
    """Check that no two positions of a joint show the same count.

    The lap of a link is found from its motor's position. Where it is found wrongly, the link seems
    to be a whole lap away: outside its range, where no drive is enabled.
    """
    if not all(map(math.isfinite, joint)):
        return
    units, entry = node.link, node.link_object
    if units is None:
        return
    lap, width = units.lap, joint[1] - joint[0]
    if width >= lap:
        raise ConfigError(
            f"link of '{node.name}': {entry} {_repeats(units)} every {lap:.4g} rad at "
            f"{abs(units.counts_per_rad):.6g} counts/rad, but its joint's range [{joint[0]:g}, "
            f"{joint[1]:g}] rad is {width:.4g} rad wide: map an object of 32 bits, such as "
            'link_object = "60E4:01 i32", or fewer counts per turn'
        )


def _check_temperature(node: NodeConfig, limit: float) -> None:
    """Check that the highest count of the temperature object lies above the limit."""
    entry, scale = node.temperature_object, node.temperature_scale
    if entry is None or not math.isfinite(limit):
        return
    if entry.kind is DataType.REAL32:
        return
    highest = range_of(entry.kind)[1] * scale
    if highest <= limit:
        raise ConfigError(
            f"temperature of '{node.name}': {entry} of {entry.bits} bits ends at {highest:g} deg C "
            f"with temperature_scale = {scale:g} deg C a count, the limit is {limit:g} deg C and "
            "would never act: correct the scale, or name an object that holds more"
        )


def _repeats(units: AxisUnits) -> str:
    """Why a position object repeats, in words."""
    if units.modulus_counts is None:
        return f"of {units.bits} bits repeats"
    return f"with modulus_counts = {units.modulus_counts} repeats"
