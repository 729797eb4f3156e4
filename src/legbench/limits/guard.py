"""The limits of one leg, enforced cycle by cycle in the lowest layer of every plant; pure."""

import math
import sys
from collections.abc import Sequence
from typing import NoReturn, final

from legbench.errors import PlantFault
from legbench.limits.encoder_watch import EncoderWatch
from legbench.limits.knee import Range, knee_of, project
from legbench.limits.momentum import LegMomentum
from legbench.limits.safety import START_TOLERANCE, UNLIMITED, SafetyLimits
from legbench.limits.shortfall import Shortfall

ALL = frozenset(("motor_pos", "joint_pos", "spring_torque"))
"""Names of the signals of an axis that limits look at."""


@final
class Guard:
    """Applies the limits to one leg, cycle by cycle; keeps the first cause.

    Attributes:
        applied: the command as it was let through (one value an axis) [rad].
        shortfall: which wishes were let through otherwise than wished.
    """

    def __init__(
        self,
        limits: SafetyLimits,
        period: float,
        *,
        known: Sequence[frozenset[str]] = (ALL, ALL),
        two_encoders: bool = True,
        momentum: LegMomentum | None = None,
    ) -> None:
        """Watch over a leg.

        Args:
            limits: what it may do.
            period: of the cycles [s].
            known: names of the signals that are known of each axis: motor_pos, joint_pos,
                spring_torque. Limits of others do not act.
            two_encoders: every axis has an encoder on both sides of its spring, without which
                their readings cannot be held against each other.
            momentum: what the leg's angular momentum obeys; without it `link_error` does not act.
        """
        self._limits = limits
        self._loads = tuple("spring_torque" in names for names in known)
        self._shown = tuple("joint_pos" in names for names in known)
        self._step_max = limits.command_speed * period
        self._command_step = min(limits.command_step, sys.float_info.max)
        self._knee = None if limits.motor_knee_range == UNLIMITED else limits.motor_knee_range
        limited_knee = limits.joint_knee_range != UNLIMITED and all(self._shown)
        self._joint_knee = limits.joint_knee_range if limited_knee else None
        self._wish: tuple[float, ...] | None = None
        self._encoders = EncoderWatch(limits, period, two_encoders=two_encoders, momentum=momentum)
        self._period = period
        self.applied: tuple[float, ...] = ()
        self.shortfall = Shortfall(period)

    def start_at(self, motor_pos: Sequence[float]) -> None:
        """Begin from where the motors are, whatever was commanded before [rad]."""
        self.applied = tuple(float(value) for value in motor_pos)
        self._wish = None
        self._encoders.start(self.applied)
        self.shortfall.restart()

    def restart_from_applied(self) -> None:
        """Measure the next step of the command from what was applied last."""
        self._wish = None

    def command(self, wish: Sequence[float]) -> tuple[float, ...]:
        """What of a wish may go to the motors: clamped to the ranges, slewed [rad].

        Raises:
            PlantFault: the wish is not finite or jumps too far; `applied` stands.
        """
        asked = tuple(wish)
        self._check_wish(asked)
        self._wish = asked
        self.shortfall.cycles += 1
        if self._allows(asked):
            self.applied = asked
            return asked
        step, last = self._step_max, self.applied
        # From outside a range the way leads back no faster than wished.
        boxes = [
            (min(low, value), max(high, value))
            for value, (low, high) in zip(last, self._limits.motor_range, strict=True)
        ]
        wanted = tuple(
            [min(max(value, low), high) for value, (low, high) in zip(asked, boxes, strict=True)]
        )
        knee = self._knee
        if knee is not None:
            knee = (min(knee[0], knee_of(last)), max(knee[1], knee_of(last)))
            wanted = project(wanted, knee, boxes)
        # Both steps are cut at the same length, so they keep their order and come no farther apart:
        # the knee of what is applied lies between that of the last command and that of the wanted
        # one, and needs no look of its own.
        applied = tuple(
            [
                min(max(value, before - step), before + step)
                for value, before in zip(wanted, last, strict=True)
            ]
        )
        if applied != asked:
            self.shortfall.count(asked, wanted, applied)
        self.applied = applied
        return applied

    def _allows(self, wish: tuple[float, ...]) -> bool:
        """Whether a wish lies within all ranges, and within reach of one cycle."""
        step, knee = self._step_max, self._knee
        (low1, high1), (low2, high2) = self._limits.motor_range
        (motor1, motor2), (last1, last2) = wish, self.applied
        return (
            low1 <= motor1 <= high1
            and low2 <= motor2 <= high2
            and -step <= motor1 - last1 <= step
            and -step <= motor2 - last2 <= step
            and (knee is None or knee[0] <= motor2 - motor1 <= knee[1])
        )

    def _check_wish(self, wish: Sequence[float]) -> None:
        before = self.applied if self._wish is None else self._wish
        limit = self._command_step
        (wish_1, wish_2), (before_1, before_2) = wish, before
        # Of what is not finite no step is within a limit.
        if not (abs(wish_1 - before_1) <= limit and abs(wish_2 - before_2) <= limit):
            self._refuse_wish(wish, before)

    def _refuse_wish(self, wish: Sequence[float], before: Sequence[float]) -> None:
        limit = self._limits.command_step
        for motor, (value, wished) in enumerate(zip(wish, before, strict=True), start=1):
            if not math.isfinite(value):
                raise PlantFault(
                    "command not finite",
                    f"the command of motor {motor} is {value} rad; the controller has failed",
                )
            if abs(value - wished) > limit:
                raise PlantFault(
                    "command step",
                    f"the command of motor {motor} jumps by {abs(value - wished):.3f} rad in one "
                    f"cycle, the limit is {limit:g} rad; smooth it, or raise command_step",
                )

    def reachable(self, wish: Sequence[float]) -> tuple[float, ...]:
        """What of a wish the ranges let through, in the end [rad]."""
        boxes = self._limits.motor_range
        pairs = zip(wish, boxes, strict=True)
        clamped = tuple(min(max(value, low), high) for value, (low, high) in pairs)
        return clamped if self._knee is None else project(clamped, self._knee, boxes)

    def check_start(self, motor_pos: Sequence[float]) -> None:
        """Refuse motors that stand outside their range before they are enabled [rad].

        Raises:
            PlantFault: one is outside its range.
        """
        ranges = zip(motor_pos, self._limits.motor_range, strict=True)
        for axis, (value, (low, high)) in enumerate(ranges, start=1):
            if not low - START_TOLERANCE <= value <= high + START_TOLERANCE:
                raise PlantFault(
                    "motor range",
                    f"motor {axis} stands at {value:.3f} rad, the limits are [{low:g}, {high:g}] "
                    "rad; move it back by hand before it is enabled",
                )
        self._check_start_knee(motor_pos)

    def _check_start_knee(self, motor_pos: Sequence[float]) -> None:
        if self._knee is None:
            return
        low, high = self._knee
        if not low - START_TOLERANCE <= knee_of(motor_pos) <= high + START_TOLERANCE:
            raise PlantFault(
                "motor range",
                f"the motors stand with q2 - q1 at {knee_of(motor_pos):.3f} rad, the limits are "
                f"[{low:g}, {high:g}] rad; move them back by hand before they are enabled",
            )

    def check(
        self,
        *,
        joint_pos: Sequence[float],
        spring_torque: Sequence[float],
        temperature: Sequence[float | None] = (),
    ) -> None:
        """Check what a cycle showed against the ranges of the leg.

        Args:
            joint_pos: links [rad].
            spring_torque: of the series springs [N m].
            temperature: of each drive, None if it is not known [deg C].

        Raises:
            PlantFault: a limit is exceeded.
        """
        (low1, high1), (low2, high2) = self._limits.joint_range
        joint1, joint2 = joint_pos
        if not (low1 <= joint1 <= high1 and low2 <= joint2 <= high2):
            self._refuse_joints(joint_pos)
        knee = self._joint_knee
        if knee is not None and not knee[0] <= joint2 - joint1 <= knee[1]:
            self._refuse_knee(joint_pos, knee)
        torque1, torque2 = spring_torque
        most = self._limits.spring_torque
        if not (-most <= torque1 <= most and -most <= torque2 <= most):
            self._refuse_torques(spring_torque)
        hottest = self._limits.temperature
        for value in temperature:
            if value is not None and value > hottest:
                self._refuse_temperatures(temperature)

    def expect(self, commands: Sequence[float]) -> None:
        """Prepare `check_encoders` for the coming cycle, in which these commands act [rad]."""
        self._encoders.expect(commands)

    def check_encoders(
        self,
        *,
        motor_pos: Sequence[float],
        joint_pos: Sequence[float],
        fresh: Sequence[bool] = (True, True),
        elapsed: int = 1,
        interval: float | None = None,
    ) -> None:
        """Check the cycle of the last `expect` for all that a healthy leg can show by then.

        What takes longer is left to `check_momentum`.

        Args:
            motor_pos: positions that the drives' loops lead [rad].
            joint_pos: links [rad].
            fresh: which drives had told something new in that cycle.
            elapsed: periods since the cycle before.
            interval: time since the cycle before, by default these periods [s].

        Raises:
            PlantFault: a motor does not follow, or an encoder contradicts the others or the leg.
        """
        after = elapsed * self._period if interval is None else interval
        doubt = self._encoders.see(motor_pos, joint_pos, fresh, elapsed, after)
        if doubt is not None:
            raise PlantFault(doubt.cause, doubt.message)

    def check_momentum(self) -> None:
        """Check the encoders seen last against the leg's momentum, once, where a sway asks for it.

        Raises:
            PlantFault: an encoder contradicts the springs and the motion of the links.
        """
        doubt = self._encoders.see_momentum()
        if doubt is not None:
            raise PlantFault(doubt.cause, doubt.message)

    def _refuse_torques(self, spring_torque: Sequence[float]) -> None:
        """Raise PlantFault for the first known torque beyond its limit; none if all are unknown."""
        limit = self._limits.spring_torque
        for axis, value in enumerate(spring_torque, start=1):
            if not abs(value) <= limit and self._loads[axis - 1]:
                raise PlantFault(
                    "spring torque",
                    f"spring {axis} carries {value:.3f} N m, the limit is {limit:g} N m; push "
                    "less, or raise spring_torque",
                )

    def _refuse_temperatures(self, temperature: Sequence[float | None]) -> None:
        """Raise PlantFault for the first temperature beyond its limit."""
        limit = self._limits.temperature
        for axis, value in enumerate(temperature, start=1):
            if value is not None and value > limit:
                raise PlantFault(
                    "temperature",
                    f"drive {axis} is at {value:.1f} deg C, the limit is {limit:g} deg C, "
                    "temperature of the limits; let it cool down",
                )

    def _refuse_knee(self, joint_pos: Sequence[float], knee: Range) -> NoReturn:
        """Raise PlantFault for a knee beyond its range."""
        raise PlantFault(
            "joint range",
            f"q2 - q1 is at {knee_of(joint_pos):.3f} rad, the limits are [{knee[0]:g}, "
            f"{knee[1]:g}] rad, joint_knee_range: the knee has gone through its stop",
        )

    def _refuse_joints(self, joint_pos: Sequence[float]) -> None:
        """Raise PlantFault for the first known joint beyond its range; none if all are unknown."""
        ranges = zip(joint_pos, self._limits.joint_range, strict=True)
        for axis, (value, (low, high)) in enumerate(ranges, start=1):
            if not low <= value <= high and self._shown[axis - 1]:
                raise PlantFault(
                    "joint range",
                    f"joint {axis} is at {value:.3f} rad, the limits are [{low:g}, {high:g}] rad, "
                    f"joint_range of axis {axis}",
                )
