"""Safety limits, enforced in the lowest layer of every plant; pure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

from legbench.drives.upper_ends import LIMIT_ENDS, WIDEST_ANGLE, check_limit, check_waivers
from legbench.errors import ConfigError, PlantFault

Range = tuple[float, float]
UNLIMITED: Range = (-math.inf, math.inf)
NEEDED = ("command_speed", "command_step", "spring_torque", "following_error")
"""Limits that real drives are not led without."""
START_TOLERANCE = 0.002
"""A motor that was led to the end of its range may show it so far outside [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SafetyLimits:
    """What the leg may do; a limit that is not given does not act.

    Raises:
        ConfigError: an empty range or a limit that is not positive.
    """

    motor_range: tuple[Range, ...] = (UNLIMITED, UNLIMITED)
    """Of the commanded motor positions, clamped, one pair an axis [rad]."""
    joint_range: tuple[Range, ...] = (UNLIMITED, UNLIMITED)
    """Of the link angles q1, q2; beyond it the run ends [rad]."""
    command_speed: float = math.inf
    """Highest speed of the command, a faster one is slewed [rad/s]."""
    command_step: float = math.inf
    """Largest jump of the wish in one cycle, from where the motors are at first; a larger one
    ends the run [rad]."""
    spring_torque: float = math.inf
    """Beyond it the run ends [N m]."""
    following_error: float = math.inf
    """Command against motor position one cycle later; beyond it the run ends [rad]."""
    following_cycles: int = 10
    """Cycles that a following error may last."""
    temperature: float = math.inf
    """Of a drive that reports it; beyond it the run ends [deg C]."""
    overrun_cycles: int = 3
    """Consecutive missed ticks that end the run."""
    lost_frames: int = 3
    """Consecutive cycles without a drive's process data that end the run."""
    waive: tuple[str, ...] = ()
    """Limits that may exceed their usual upper end, by name; every run says so."""

    def __post_init__(self) -> None:
        for name, ranges in (("motor", self.motor_range), ("joint", self.joint_range)):
            if len(ranges) != 2:
                raise ConfigError(f"{name}_range has {len(ranges)} pairs; a leg has 2 axes")
            for low, high in ranges:
                if any(WIDEST_ANGLE < abs(end) < math.inf for end in (low, high)):
                    raise ConfigError(
                        f"{name}_range is [{low:g}, {high:g}] rad; no end lies beyond "
                        f"{WIDEST_ANGLE:.2f} rad, one turn"
                    )
                if not low < high:
                    raise ConfigError(
                        f"{name}_range is [{low:g}, {high:g}] rad; low must be below high"
                    )
        for name, value, unit in (
            ("command_speed", self.command_speed, "rad/s"),
            ("command_step", self.command_step, "rad"),
            ("spring_torque", self.spring_torque, "N m"),
            ("following_error", self.following_error, "rad"),
            ("temperature", self.temperature, "deg C"),
            ("following_cycles", self.following_cycles, "cycles"),
            ("overrun_cycles", self.overrun_cycles, "cycles"),
            ("lost_frames", self.lost_frames, "cycles"),
        ):
            if not value > 0:
                raise ConfigError(f"{name} is {value:g} {unit}; it must be positive")
            check_limit(name, value, self.waive)
        check_waivers(self.waive, tuple(LIMIT_ENDS), "limits")

    def require_complete(self) -> None:
        """Refuse to lead real drives without the limits that nothing else stands in for.

        Raises:
            ConfigError: one of them is not given; all that are missing are named.
        """
        missing = [name for name in NEEDED if not math.isfinite(getattr(self, name))]
        if missing:
            raise ConfigError(
                f"limits leave out {', '.join(missing)}; real drives are not led without: give "
                "each a value"
            )

    def check_within(self, motor: Sequence[Range], joint: Sequence[Range]) -> None:
        """Refuse to be looser than a design.

        Args:
            motor: what the design allows of the motor positions [rad].
            joint: what the design allows of the link angles [rad].

        Raises:
            ConfigError: a limit reaches beyond the design's.
        """
        for name, mine, designs in (
            ("motor_range", self.motor_range, motor),
            ("joint_range", self.joint_range, joint),
        ):
            for axis, (own, outer) in enumerate(zip(mine, designs, strict=True), start=1):
                if own[0] < outer[0] or own[1] > outer[1]:
                    raise ConfigError(
                        f"{name} of axis {axis} is [{own[0]:g}, {own[1]:g}] rad, looser than the "
                        f"design's [{outer[0]:g}, {outer[1]:g}] rad; tighten it"
                    )


@final
class Guard:
    """Applies the limits to one leg, cycle by cycle; keeps the first cause.

    Attributes:
        applied: the command as it was let through (one value an axis) [rad].
    """

    def __init__(self, limits: SafetyLimits, period: float) -> None:
        self._limits = limits
        self._step_max = limits.command_speed * period
        self._wish: tuple[float, ...] | None = None
        self._follow_age = 0
        self.applied: tuple[float, ...] = ()

    def start_at(self, motor_pos: Sequence[float]) -> None:
        """Begin from where the motors are, whatever was commanded before [rad]."""
        self.applied = tuple(float(value) for value in motor_pos)
        self._wish = None
        self._follow_age = 0

    def command(self, wish: Sequence[float]) -> tuple[float, ...]:
        """What of a wish may go to the motors: clamped to the range, slewed [rad].

        Raises:
            PlantFault: the wish is not finite or jumps too far; `applied` stands.
        """
        limits, step, applied = self._limits, self._step_max, []
        before = self.applied if self._wish is None else self._wish
        for value, wished, last, (low, high) in zip(
            wish, before, self.applied, limits.motor_range, strict=True
        ):
            if not math.isfinite(value):
                raise PlantFault(
                    "command not finite",
                    f"the command of motor {len(applied) + 1} is {value} rad; the controller has "
                    "failed",
                )
            if abs(value - wished) > limits.command_step:
                raise PlantFault(
                    "command step",
                    f"the command of motor {len(applied) + 1} jumps by {abs(value - wished):.3f} "
                    f"rad in one cycle, the limit is {limits.command_step:g} rad; smooth it",
                )
            if low <= value <= high and -step <= value - last <= step:
                applied.append(value)
                continue
            # From outside the range the way leads back no faster than wished.
            wanted = min(max(value, low if low < last else last), high if high > last else last)
            applied.append(min(max(wanted, last - step), last + step))
        self._wish = tuple(wish)
        self.applied = tuple(applied)
        return self.applied

    def reachable(self, wish: Sequence[float]) -> tuple[float, ...]:
        """What of a wish the range lets through, in the end [rad]."""
        return tuple(
            min(max(value, low), high)
            for value, (low, high) in zip(wish, self._limits.motor_range, strict=True)
        )

    def check_start(self, motor_pos: Sequence[float]) -> None:
        """Where the motors stand before they are enabled [rad].

        Raises:
            PlantFault: one is outside its range.
        """
        for axis, (value, (low, high)) in enumerate(
            zip(motor_pos, self._limits.motor_range, strict=True), start=1
        ):
            if not low - START_TOLERANCE <= value <= high + START_TOLERANCE:
                raise PlantFault(
                    "motor range",
                    f"motor {axis} stands at {value:.3f} rad, the limits are [{low:g}, {high:g}] "
                    "rad; move it back by hand before it is enabled",
                )

    def check(
        self,
        *,
        motor_pos: Sequence[float],
        joint_pos: Sequence[float],
        spring_torque: Sequence[float],
        expected_pos: Sequence[float] | None = None,
        temperature: Sequence[float | None] = (),
    ) -> None:
        """Look at what a cycle showed; `expected_pos` is where the motors should be by now, a
        temperature that is not known is none.

        Raises:
            PlantFault: a limit is exceeded.
        """
        limits = self._limits
        for axis, (value, (low, high)) in enumerate(
            zip(joint_pos, limits.joint_range, strict=True), start=1
        ):
            if not low <= value <= high:
                raise PlantFault(
                    "joint range",
                    f"joint {axis} is at {value:.3f} rad, the limits are [{low:g}, {high:g}] rad",
                )
        for axis, value in enumerate(spring_torque, start=1):
            if not abs(value) <= limits.spring_torque:
                raise PlantFault(
                    "spring torque",
                    f"spring {axis} carries {value:.3f} N m, the limit is "
                    f"{limits.spring_torque:g} N m",
                )
        for axis, value in enumerate(temperature, start=1):
            if value is not None and value > limits.temperature:
                raise PlantFault(
                    "temperature",
                    f"drive {axis} is at {value:.1f} deg C, the limit is "
                    f"{limits.temperature:g} deg C; let it cool down",
                )
        if expected_pos is not None:
            self._check_following(motor_pos, expected_pos)

    def _check_following(self, motor_pos: Sequence[float], expected: Sequence[float]) -> None:
        worst = max([abs(a - b) for a, b in zip(motor_pos, expected, strict=True)])
        self._follow_age = self._follow_age + 1 if worst > self._limits.following_error else 0
        if self._follow_age > self._limits.following_cycles:
            raise PlantFault(
                "following error",
                f"a motor is {worst:.3f} rad away from its command for {self._follow_age} cycles, "
                f"the limit is {self._limits.following_error:g} rad",
            )
