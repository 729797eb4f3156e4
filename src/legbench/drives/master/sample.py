"""What one cycle showed."""

from collections.abc import Sequence
from dataclasses import dataclass

from legbench.drives.master.cycle import Cycle, Tick


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """One cycle; one value a drive, in the order of the leg's joints."""

    time_ns: int
    """SYNC was sent, on the link's time base."""
    late_ns: int
    """After its place on the grid."""
    skipped: int
    """Ticks without SYNC just before."""
    motor_pos: tuple[float, ...]
    """[rad]"""
    link_pos: tuple[float, ...]
    """[rad]"""
    spring_torque: tuple[float, ...]
    """Of the series springs on the links, from the encoders' difference [N m]."""
    applied_pos: tuple[float, ...]
    """Command as it was last let through; empty before the drives are enabled [rad]."""
    statusword: tuple[int, ...]
    fresh: tuple[bool, ...]
    """False: no process data in this cycle, the last is repeated."""
    temperature: tuple[float | None, ...]
    """[deg C]"""


def sample_of(
    cycle: Cycle, tick: Tick, stiffness: Sequence[float], applied_pos: tuple[float, ...]
) -> Sample:
    """The state of a cycle after a tick; stiffness of the series springs [N m/rad]."""
    axes = cycle.axes
    motor = tuple([axis.motor_pos for axis in axes])
    links = tuple([axis.link_pos for axis in axes])
    return Sample(
        time_ns=tick.time_ns,
        late_ns=tick.late_ns,
        skipped=tick.skipped,
        motor_pos=motor,
        link_pos=links,
        spring_torque=tuple([k * (a - b) for k, a, b in zip(stiffness, motor, links, strict=True)]),
        applied_pos=applied_pos,
        statusword=tuple([axis.statusword for axis in axes]),
        fresh=tuple([axis.fresh for axis in axes]),
        temperature=tuple([poll.celsius for poll in cycle.polls]),
    )
