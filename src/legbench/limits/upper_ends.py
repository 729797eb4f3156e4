"""Upper ends of limits and times, and how a user waives one: by its name; pure.

A limit of 1e9 is no limit: it passes every check for being given, and never acts.
"""

import math
from collections.abc import Mapping, Sequence

from legbench.errors import ConfigError

LIMIT_ENDS: Mapping[str, tuple[float, float, str]] = {
    "command_speed": (200.0, 1000.0, "rad/s"),
    "command_step": (1.0, 6.3, "rad"),
    "spring_torque": (50.0, 1000.0, "N m"),
    "following_error": (0.5, 6.3, "rad"),
    "following_cycles": (50, 5000, "cycles"),
    "servo_bandwidth": (1000.0, 10_000.0, "Hz"),
    "joint_speed": (200.0, 1000.0, "rad/s"),
    "standing": (0.2, 6.3, "rad"),
    "sway": (0.5, 6.3, "rad"),
    "link_error": (0.1, 6.3, "rad"),
    "temperature": (120.0, 200.0, "deg C"),
    "overrun_cycles": (50, 5000, "cycles"),
    "lost_frames": (50, 5000, "cycles"),
}
"""Limit -> highest value, highest value where it is waived, unit.

No geared servo turns a joint at 200 rad/s, 1 900 rpm. A step of 1 rad or an error of 0.5 rad is
half or a quarter of a joint's whole range; a link that stands while the other one moves by 0.2 rad,
or sways by 0.5 rad, is nearly as far from where it should be. A link encoder that is wrong by 0.1
rad drifts for longer than a drift may last. Springs of 3 to 5 N m/rad that carry
50 N m are wound by more than a turn. Insulation of class E ends at 120 deg C. 50 cycles are half of
the time in which drives stop that have lost their master. A waived limit still acts within seconds.
"""
WIDEST_ANGLE = 2.0 * math.pi
"""Furthest end of a range of angles; a joint of a leg makes no turn [rad]."""
MASTER_WATCH = "master watch"
"""Waiver: drives may go on for longer than 100 ms after the death of their master."""
DRIVE_HEARTBEAT = "drive heartbeat"
"""Waiver: drives may tell that they live less often than every 100 ms."""
QUICK_STOP_RAMP = "quick-stop ramp"
"""Waiver: drives brake on a ramp that the bus file does not know, by quick stop."""
SPRING_WATCH = "spring watch"
"""Waiver: spring torques may be unknown, so that their limit does not act."""
BUS_WAIVERS = (MASTER_WATCH, DRIVE_HEARTBEAT, QUICK_STOP_RAMP, SPRING_WATCH)


def check_waivers(given: Sequence[str], known: Sequence[str], file: str) -> None:
    """Refuse a waiver of something that has no such name.

    Raises:
        ConfigError: a name that is not known, or is given twice; all that are known are listed.
    """
    for name in given:
        if name not in known or list(given).count(name) > 1:
            raise ConfigError(
                f"waive in the {file} file names {name!r}; it takes each of these once: "
                f"{', '.join(known)}"
            )


def check_limit(name: str, value: float, waived: Sequence[str]) -> None:
    """Refuse a limit that is too high to act; one that is not given (infinite) is none.

    Raises:
        ConfigError: it is above its upper end.
    """
    usual, most, unit = LIMIT_ENDS[name]
    end = most if name in waived else usual
    if not end < value < math.inf:
        return
    way = "" if name in waived else f', or waive = ["{name}"] in the limits file, up to {most:g}'
    raise ConfigError(
        f"{name} is {value:g} {unit}, the upper end is {end:g} {unit}: beyond it the limit would "
        f"not act in time; lower it{way}"
    )


def check_number(name: str, value: float, low: float, high: float, unit: str) -> None:
    """Refuse a number of a bus file that lies outside what makes sense.

    Raises:
        ConfigError: it is below `low`, above `high`, or no number.
    """
    if not low <= value <= high:
        what = f" {unit}" if unit else ""
        raise ConfigError(f"{name} is {value}{what}; it must be {low:.10g} to {high:.10g}{what}")
