"""A guard at rest, and what its acts end in; numbers are exact in binary."""

from collections.abc import Sequence
from typing import Any

from legbench.errors import PlantFault
from legbench.limits.guard import Guard
from legbench.limits.plausibility import Doubt, HealthBounds, LinkWatch, MotorWatch
from legbench.limits.safety import SafetyLimits

PERIOD = 0.25
"""So long that steps, ranges and speeds are exact binary numbers [s]."""
REST = (-0.5, 0.5)
BOUNDS = HealthBounds(
    period=1e-3,
    following_error=0.03,
    following_cycles=5,
    servo_bandwidth=15.0,
    joint_speed=60.0,
    standing=0.02,
    sway=0.05,
)
"""Bounds of motors and links at 1 kHz."""


def started(limits: SafetyLimits, place: tuple[float, float] = REST) -> Guard:
    """A guard whose command stands at a place [rad]."""
    guard = Guard(limits, PERIOD)
    guard.start_at(place)
    return guard


def see_motor(watch: MotorWatch, motor: int, position: float, command: float) -> Doubt | None:
    """What a watch says of a motor in a cycle in which a command acts."""
    watch.expect(command)
    return watch.see(motor, position)


def see_links(
    watch: LinkWatch,
    links: Sequence[float],
    motors: Sequence[float] = REST,
    commands: Sequence[float] = REST,
    fresh: Sequence[bool] = (True, True),
    elapsed: int = 1,
) -> Doubt | None:
    """What a watch says of links in a cycle in which commands act."""
    watch.expect(commands)
    return watch.see(motors, links, fresh, elapsed)


def see_encoders(guard: Guard, commands: Sequence[float], **shown: Any) -> None:
    """Check the encoders of a cycle in which commands act; raises PlantFault."""
    guard.expect(commands)
    guard.check_encoders(**shown)


def pair(axis: int, value: float, other: float) -> tuple[float, float]:
    """A value for one axis, and one for the other."""
    return (value, other) if axis == 0 else (other, value)


def fault(act: Any, *args: Any, **kwargs: Any) -> str | None:
    """Cause and text of the fault that is raised, if one is."""
    try:
        act(*args, **kwargs)
    except PlantFault as error:
        return f"{error.cause}: {error}"
    return None
