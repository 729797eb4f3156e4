"""Safety limits of a leg, and what they refuse before anything moves; pure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from legbench.errors import ConfigError
from legbench.limits.knee import Range, check_knee
from legbench.limits.plausibility import HealthBounds
from legbench.limits.upper_ends import LIMIT_ENDS, WIDEST_ANGLE, check_limit, check_waivers

UNLIMITED: Range = (-math.inf, math.inf)
NEEDED = (
    "command_speed",
    "command_step",
    "spring_torque",
    "following_error",
    "joint_speed",
    "standing",
    "sway",
)
"""Limits that real drives are not led without."""
SLOWEST_LOOP = 5.0
"""Lowest `servo_bandwidth`: such a loop still covers most of a step within 50 ms [Hz]."""
START_TOLERANCE = 0.002
"""A motor that was led to the end of its range may show it so far outside [rad]."""


OVERRUNS = "cycle overruns"
"""Cause of a run that ends because the loop has missed too many ticks in a row."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SafetyLimits:
    """What the leg may do; a limit that is not given does not act.

    Raises:
        ConfigError: an empty range or a limit that is not positive.
    """

    motor_range: tuple[Range, ...] = (UNLIMITED, UNLIMITED)
    """Range to which commanded motor positions are clamped, one pair an axis [rad]."""
    joint_range: tuple[Range, ...] = (UNLIMITED, UNLIMITED)
    """Range of the link angles q1, q2; beyond it the run ends [rad]."""
    motor_knee_range: Range = UNLIMITED
    """Range of q2 - q1 of the commanded motor positions; both motors give way alike [rad]."""
    joint_knee_range: Range = UNLIMITED
    """Range of q2 - q1 of the link angles; beyond it the run ends [rad]."""
    command_speed: float = math.inf
    """Highest speed of the command, a faster one is slewed [rad/s]."""
    command_step: float = math.inf
    """Largest jump of the wish in one cycle, from where the motors are at first; a larger one
    ends the run [rad]."""
    spring_torque: float = math.inf
    """Highest torque of a series spring; beyond it the run ends [N m]."""
    following_error: float = math.inf
    """Distance of a motor from all that a healthy position loop would show; beyond it the run
    ends [rad]."""
    following_cycles: int = 5
    """Cycles that a following error may last."""
    servo_bandwidth: float = 15.0
    """Corner frequency of the slowest position loop that is healthy [Hz]."""
    joint_speed: float = math.inf
    """Highest speed of a link; a reading that is faster ends the run [rad/s]."""
    standing: float = math.inf
    """Motion of one link during which the other one cannot stand still; beyond it the run ends
    [rad]."""
    sway: float = math.inf
    """Motion of q1 + q2 that nobody has commanded, besides what the leg did in the seconds before;
    beyond it the run ends [rad]."""
    temperature: float = math.inf
    """Highest temperature of a drive that reports it; beyond it the run ends [deg C]."""
    overrun_cycles: int = 3
    """Consecutive missed ticks that end the run."""
    lost_frames: int = 3
    """Consecutive cycles without a drive's process data that end the run."""
    # None is left out of an experiment's canonical text; older experiments keep their names.
    link_error: float | None = None
    """Angle by which a link encoder may contradict spring torques and momentum of a leg that sways
    too much for `sway`; beyond it the run ends [rad]."""
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
        if len(self.motor_range) == len(self.joint_range) == 2:
            check_knee("motor_knee_range", self.motor_knee_range, self.motor_range)
            check_knee("joint_knee_range", self.joint_knee_range, self.joint_range)
        for name, value, unit in (
            ("command_speed", self.command_speed, "rad/s"),
            ("command_step", self.command_step, "rad"),
            ("spring_torque", self.spring_torque, "N m"),
            ("following_error", self.following_error, "rad"),
            ("servo_bandwidth", self.servo_bandwidth, "Hz"),
            ("joint_speed", self.joint_speed, "rad/s"),
            ("standing", self.standing, "rad"),
            ("sway", self.sway, "rad"),
            ("link_error", math.inf if self.link_error is None else self.link_error, "rad"),
            ("temperature", self.temperature, "deg C"),
            ("following_cycles", self.following_cycles, "cycles"),
            ("overrun_cycles", self.overrun_cycles, "cycles"),
            ("lost_frames", self.lost_frames, "cycles"),
        ):
            if not value > 0:
                raise ConfigError(f"{name} is {value:g} {unit}; it must be positive")
            check_limit(name, value, self.waive)
        if self.servo_bandwidth < SLOWEST_LOOP:
            raise ConfigError(
                f"servo_bandwidth is {self.servo_bandwidth:g} Hz, the lower end is "
                f"{SLOWEST_LOOP:g} Hz: a slower loop looks like a jammed motor; raise it"
            )
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

    def check_within(
        self,
        motor: Sequence[Range],
        joint: Sequence[Range],
        motor_knee: Range = UNLIMITED,
        joint_knee: Range = UNLIMITED,
    ) -> None:
        """Refuse to be looser than a design.

        Args:
            motor: what the design allows of the motor positions [rad].
            joint: what the design allows of the link angles [rad].
            motor_knee: what it allows of q2 - q1 of the motors [rad].
            joint_knee: what it allows of q2 - q1 of the links [rad].

        Raises:
            ConfigError: a limit reaches beyond the design's.
        """
        compared = [
            ("motor_knee_range", self.motor_knee_range, motor_knee),
            ("joint_knee_range", self.joint_knee_range, joint_knee),
        ]
        for name, mine, designs in (
            ("motor_range", self.motor_range, motor),
            ("joint_range", self.joint_range, joint),
        ):
            for axis, (own, outer) in enumerate(zip(mine, designs, strict=True), start=1):
                compared.append((f"{name} of axis {axis}", own, outer))
        for name, own, outer in compared:
            if own[0] < outer[0] or own[1] > outer[1]:
                raise ConfigError(
                    f"{name} is [{own[0]:g}, {own[1]:g}] rad, looser than the design's "
                    f"[{outer[0]:g}, {outer[1]:g}] rad; tighten it"
                )

    def bounds(self, period: float) -> HealthBounds:
        """Return what a healthy leg stays within, for cycles of a period [s]."""
        return HealthBounds(
            period=period,
            following_error=self.following_error,
            following_cycles=self.following_cycles,
            servo_bandwidth=self.servo_bandwidth,
            joint_speed=self.joint_speed,
            standing=self.standing,
            sway=self.sway,
        )
