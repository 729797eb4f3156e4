"""Ranges of the numbers of a bus file; pure."""

from collections.abc import Mapping, Sequence

from legbench.errors import ConfigError
from legbench.limits.upper_ends import DRIVE_HEARTBEAT, check_number

BUS_NUMBERS: Mapping[str, tuple[int, int, str]] = {
    "bitrate": (10_000, 1_000_000, "bit/s"),
    "period_us": (200, 20_000, "us"),
    "reply_delay_us": (1, 10_000, "us"),
    "master_id": (1, 127, ""),
    "master_heartbeat_ms": (1, 21_845, "ms"),
    "sdo_timeout_ms": (1, 10_000, "ms"),
    "sdo_retries": (1, 10, ""),
    "settle_cycles": (1, 1000, "cycles"),
    "enable_spread_ms": (1, 500, "ms"),
}
"""Key -> lowest value, highest value, unit.

CiA 301 knows 10 kbit/s to 1 Mbit/s. Five frames fill 200 us of the fastest bus, and a loop of 50 Hz
leads no leg. Drives watch for three heartbeats, in the 16 bits of 1016h: 65 535 ms. A start waits
2 000 cycles for regular process data, so that 1 000 in a row can come. Holding brakes of motors of
this size open within 20 to 200 ms; half a second of one drive alone is no enabling any more.
"""
RUN_PERIODS_US = (1000, 2000, 4000)
"""Periods with which a leg is led [us]: whole periods of the simulated leg, which moves each."""
SLOWEST_HEARTBEAT, SLOWEST_WAIVED = 100, 2000
"""Longest heartbeat of a drive, and where it is waived [ms]."""
WORD = (1 << 16) - 1
"""Highest value of an object of 16 bits."""
LONG = (1 << 32) - 1
"""Highest value of an object of 32 bits."""
FASTEST_START = 5.0
"""Highest speed of the move to the start posture, before a run begins [rad/s]."""


def check_bus_numbers(numbers: Mapping[str, int], waived: Sequence[str]) -> None:
    """Refuse times, counts and ids that no bus keeps.

    Args:
        numbers: every key of `BUS_NUMBERS`, and `heartbeat_ms`.
        waived: names that the bus file waives.

    Raises:
        ConfigError: one lies outside its range.
    """
    for name, (low, high, unit) in BUS_NUMBERS.items():
        check_number(name, numbers[name], low, high, unit)
    beat = numbers["heartbeat_ms"]
    end = SLOWEST_WAIVED if DRIVE_HEARTBEAT in waived else SLOWEST_HEARTBEAT
    if not 0 < beat <= end:
        way = "" if DRIVE_HEARTBEAT in waived else f', or waive = ["{DRIVE_HEARTBEAT}"]'
        raise ConfigError(
            f"heartbeat_ms is {beat} ms; it must be positive and at most {end} ms: a drive counts "
            f"as lost after three{way}"
        )


def check_start_speed(speed: float) -> None:
    """Refuse a start speed [rad/s] that is not above 0 or is too fast; raises ConfigError."""
    if not 0.0 < speed <= FASTEST_START:
        raise ConfigError(
            f"start_speed is {speed:g} rad/s; it must be above 0 and at most {FASTEST_START:g}"
        )
