"""A small, slow motion of one motor under all limits."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from legbench.commissioning.status import read_counts
from legbench.drives.master.session import Session
from legbench.drives.setup.checks import check_together
from legbench.errors import ConfigError
from legbench.limits.knee import knee_of
from legbench.limits.safety import START_TOLERANCE, SafetyLimits

FARTHEST = 0.3
"""Longest jog [rad]."""
FASTEST = 1.0
"""Highest jog speed [rad/s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Jogged:
    """What moved, in the order of the nodes."""

    node: str
    before_pos: tuple[float, ...]
    """Motors before [rad]."""
    after_pos: tuple[float, ...]
    """Motors at the far end [rad]."""
    link_pos: tuple[float, ...]
    """Links at the far end [rad]."""
    spring_torque: tuple[float, ...]
    """Torque of the series springs at the far end [N m]."""


def jog(
    session: Session,
    limits: SafetyLimits,
    stiffness: Sequence[float],
    name: str,
    *,
    by: float,
    speed: float,
    back: bool,
) -> Jogged:
    """Enable all drives where they stand, move one by `by` [rad] at `speed` [rad/s], stop.

    Raises:
        ConfigError: no such node, too far or too fast for a jog, limits that leave something out,
            ramps on which a motor runs on too far, an object that cannot hold its range, a drive
            that would go on without its master, or a motor that stands outside its range.
        BusError, DriveError, PlantFault: as `Link.start`, `Link.move_to`.
    """
    names = [node.name for node in session.config.nodes]
    if name not in names:
        raise ConfigError(f"no node '{name}' in the bus file; there are {', '.join(names)}")
    if not 0.0 < abs(by) <= FARTHEST:
        raise ConfigError(f"a jog by {by:g} rad; it may be up to {FARTHEST:g} rad, and not zero")
    if not 0.0 < speed <= FASTEST:
        raise ConfigError(f"a jog at {speed:g} rad/s; it may be up to {FASTEST:g} rad/s")
    _check_limits(limits)
    check_together(session.config, limits)
    up = session.bring_up()
    up.listen()
    up.identify()
    _check_range(session, limits, names.index(name), by)
    with session.link(limits, stiffness) as link:
        link.start()
        start = link.led_pos
        target = [value + (by if names[axis] == name else 0.0) for axis, value in enumerate(start)]
        there = link.move_to(target, speed)
        after = link.led_pos
        if back:
            link.move_to(start, speed)
    return Jogged(
        node=name,
        before_pos=start,
        after_pos=after,
        link_pos=there.link_pos,
        spring_torque=there.spring_torque,
    )


def _check_limits(limits: SafetyLimits) -> None:
    limits.require_complete()
    for name, ranges in (("motor", limits.motor_range), ("joint", limits.joint_range)):
        for axis, (low, high) in enumerate(ranges, start=1):
            if not (math.isfinite(low) and math.isfinite(high)):
                raise ConfigError(
                    f"{name}_range of axis {axis} is [{low:g}, {high:g}] rad; a motor is not "
                    "jogged without: give it two ends"
                )


def _check_range(session: Session, limits: SafetyLimits, place: int, by: float) -> None:
    """Every motor and the knee stand in their ranges, and stay there over the jog."""
    shown = []
    for axis, (node, (low, high)) in enumerate(
        zip(session.config.nodes, limits.motor_range, strict=True)
    ):
        here = node.motor.to_rad(read_counts(session, node)[0])
        shown.append(here)
        if not low - START_TOLERANCE <= here <= high + START_TOLERANCE:
            raise ConfigError(
                f"'{node.name}' stands at {here:.3f} rad, the limits are [{low:g}, {high:g}] rad; "
                "all motors are enabled for a jog: move it back by hand"
            )
        if axis == place and not low <= here + by <= high:
            raise ConfigError(
                f"the jog would take '{node.name}' from {here:.3f} to {here + by:.3f} rad, the "
                f"limits are [{low:g}, {high:g}] rad"
            )
    before = knee_of(shown)
    shown[place] += by
    after, (low, high) = knee_of(shown), limits.motor_knee_range
    if not low - START_TOLERANCE <= before <= high + START_TOLERANCE:
        raise ConfigError(
            f"the motors stand with q2 - q1 at {before:.3f} rad, the limits are [{low:g}, "
            f"{high:g}] rad; all motors are enabled for a jog: move them back by hand"
        )
    if not low <= after <= high:
        raise ConfigError(
            f"the jog would take q2 - q1, the knee, from {before:.3f} to {after:.3f} rad, the "
            f"limits are [{low:g}, {high:g}] rad"
        )
