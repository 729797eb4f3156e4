"""The measurements of one cycle."""

from collections.abc import Sequence
from typing import NamedTuple

from legbench.drives.master.cycle import Cycle
from legbench.drives.master.joint import joint_of
from legbench.drives.master.tick import Tick


class Sample(NamedTuple):
    """Measurements of one cycle, one value a drive, in the order of the leg's joints.

    It is a named tuple because one is made every millisecond.
    """

    time_ns: int
    """Time of SYNC on the link's time base [ns]."""
    late_ns: int
    """Delay of SYNC after its place on the grid [ns]."""
    skipped: int
    """Number of ticks without SYNC just before this one."""
    motor_pos: tuple[float, ...]
    """Positions of the motors; not a number where not known [rad]."""
    link_pos: tuple[float, ...]
    """Positions of the links; not a number where not known [rad]."""
    spring_torque: tuple[float, ...]
    """Torques of the series springs on the links, from the encoders' difference, else from the
    drive's torque; not a number where not known [N m]."""
    applied_pos: tuple[float, ...]
    """Command as it was last let through; empty before the drives are enabled [rad]."""
    statusword: tuple[int, ...]
    fresh: tuple[bool, ...]
    """Whether each drive has sent process data in this cycle; if not, its last is repeated."""
    temperature: tuple[float | None, ...]
    """Temperatures of the drives, none where not known [deg C]."""


def sample_of(
    cycle: Cycle,
    tick: Tick,
    stiffness: Sequence[float],
    applied_pos: tuple[float, ...],
    *,
    two_encoders: bool = True,
) -> Sample:
    """The state of a cycle of two drives after a tick.

    Args:
        cycle: cycle of the drives.
        tick: its last tick.
        stiffness: of the series springs [N m/rad].
        applied_pos: command as it was last let through [rad].
        two_encoders: every drive has an encoder on both sides of its spring.
    """
    axis_1, axis_2 = cycle.axes
    poll_1, poll_2 = cycle.polls
    stiffness_1, stiffness_2 = stiffness
    if two_encoders:
        motor = motor_1, motor_2 = axis_1.motor_pos, axis_2.motor_pos
        links = link_1, link_2 = axis_1.link_pos, axis_2.link_pos
        torque = stiffness_1 * (motor_1 - link_1), stiffness_2 * (motor_2 - link_2)
    else:
        joints = joint_of(axis_1, stiffness_1), joint_of(axis_2, stiffness_2)
        motor, links, torque = zip(*joints, strict=True)
    return Sample(
        tick.time_ns,
        tick.late_ns,
        tick.skipped,
        motor,
        links,
        torque,
        applied_pos,
        (axis_1.statusword, axis_2.statusword),
        (axis_1.fresh, axis_2.fresh),
        (poll_1.celsius, poll_2.celsius),
    )
