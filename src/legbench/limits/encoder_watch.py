"""All encoders of one leg, held against the commands, against each other, and against the leg."""

from collections.abc import Sequence
from typing import final

from legbench.limits.momentum import LegMomentum, MomentumReading
from legbench.limits.momentum_watch import MomentumWatch
from legbench.limits.plausibility import Doubt, LinkWatch, MotorWatch
from legbench.limits.safety import SafetyLimits


@final
class EncoderWatch:
    """Watches the motors' and the links' encoders of one leg, cycle by cycle."""

    def __init__(
        self,
        limits: SafetyLimits,
        period: float,
        *,
        two_encoders: bool,
        momentum: LegMomentum | None,
    ) -> None:
        """Watch over a leg.

        Args:
            limits: what its encoders may show.
            period: of the cycles [s].
            two_encoders: every axis has an encoder on both sides of its spring, without which
                their readings cannot be held against each other.
            momentum: what the leg's angular momentum obeys; without it `link_error` does not act.
        """
        bounds = limits.bounds(period)
        self._motors = (MotorWatch(bounds), MotorWatch(bounds))
        self._links = LinkWatch(bounds)
        self._two_encoders = two_encoders
        self._momentum = None
        self._asked = False
        """Whether the momentum was asked in the cycle before."""
        self._unweighed: MomentumReading | None = None
        """Reading of the cycle seen last that is not held against the momentum yet."""
        if momentum is not None and limits.link_error is not None:
            self._momentum = MomentumWatch(momentum, limits.link_error, period)

    def start(self, motor_pos: Sequence[float]) -> None:
        """Begin anew from where the motors are [rad]."""
        for watch, value in zip(self._motors, motor_pos, strict=False):
            watch.start_at(value)
        self._links.start()
        self._unweighed = None
        if self._momentum is not None:
            self._momentum.start()

    def expect(self, commands: Sequence[float]) -> None:
        """Prepare for the coming cycle, in which these commands act [rad]."""
        watch_1, watch_2 = self._motors
        command_1, command_2 = commands
        watch_1.expect(command_1)
        watch_2.expect(command_2)
        if self._two_encoders:
            self._links.expect(commands)

    def see(
        self,
        motor_pos: Sequence[float],
        joint_pos: Sequence[float],
        fresh: Sequence[bool],
        elapsed: int,
        interval: float,
    ) -> Doubt | None:
        """Look at the cycle that was expected, but for its momentum.

        Returns what a healthy leg would not show.

        Args:
            motor_pos: positions that the drives' loops lead [rad].
            joint_pos: links [rad].
            fresh: which drives have told something new in this cycle.
            elapsed: periods since the cycle before.
            interval: time since the cycle before [s].
        """
        watch_1, watch_2 = self._motors
        motor_1, motor_2 = motor_pos
        found = watch_1.see(1, motor_1)
        found = watch_2.see(2, motor_2) or found
        if not self._two_encoders:
            return found
        doubt = self._links.see(motor_pos, joint_pos, fresh, elapsed)
        self._unweighed = None
        momentum = self._momentum
        if doubt is not None:
            return self._first(doubt) if found is None else found
        if momentum is not None:
            # It is asked where a sway may hide an encoder that is wrong.
            if self._links.hides_drift and all(fresh):
                self._asked = True
                joint_1, joint_2 = joint_pos
                self._unweighed = MomentumReading(interval, (motor_1, motor_2), (joint_1, joint_2))
            elif self._asked:
                self._asked = False
                momentum.restart()
        return found

    def see_momentum(self) -> Doubt | None:
        """Hold the cycle seen last against the leg's momentum, once; where a sway asks for it."""
        reading, momentum = self._unweighed, self._momentum
        if reading is None or momentum is None:
            return None
        self._unweighed = None
        return self._first(momentum.see(reading, stands=self._links.stands))

    def _first(self, doubt: Doubt | None) -> Doubt | None:
        """Name a suspected motor before a doubt about the links: it makes the springs sway, too."""
        if doubt is None:
            return None
        suspects = [watch.suspicion for watch in self._motors if watch.suspicion is not None]
        return suspects[0] if suspects else doubt
