"""Protections that a bus and a limits file waive, in words that every run repeats; pure."""

import math

from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.master_watch import stop_ms
from legbench.drives.setup.unknown import describe_unknown
from legbench.limits.safety import SafetyLimits
from legbench.limits.upper_ends import LIMIT_ENDS, MASTER_WATCH, QUICK_STOP_RAMP, SPRING_WATCH


def describe_waivers(config: BusConfig | None, limits: SafetyLimits | None) -> tuple[str, ...]:
    """Return one line for each protection that a run does without, its value included.

    What drives with one encoder do not tell is among them, and what is not watched then.
    """
    lines: list[str] = []
    for name in () if config is None else config.waive:
        lines.append(f"the bus file waives the {name}: {_of_bus(name, config)}")
    if config is not None:
        lines += describe_unknown(config)
    for name in () if limits is None else limits.waive:
        unit = LIMIT_ENDS[name][2]
        lines.append(
            f"the limits file waives the upper end of {name}: it is {getattr(limits, name):g} "
            f"{unit}, the usual end {LIMIT_ENDS[name][0]:g} {unit}"
        )
    return tuple(lines)


def _of_bus(name: str, config: BusConfig | None) -> str:
    if config is None:
        return ""
    if name == QUICK_STOP_RAMP:
        return "a drive may run on beyond the springs before a quick stop has ended"
    if name == SPRING_WATCH:
        return "the springs of drives with one encoder may be wound beyond their limit"
    if name != MASTER_WATCH:
        return f"drives tell that they live every {config.heartbeat_ms} ms"
    latest = stop_ms(config)
    if math.isinf(latest):
        return "a drive does not stop when its master is gone"
    return (
        f"drives may go on for {latest:.0f} ms when their master is gone, or without end where "
        "they lack what stops them (1016h or 140xh:05, both with 6007h), which `legbench drives "
        "check` tells by their data sheet"
    )
