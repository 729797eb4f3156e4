"""The motion of all drives of a link, measured and commanded within the limits."""

from collections.abc import Sequence
from typing import final

from legbench.drives.master.cycle import Cycle
from legbench.drives.master.sample import Sample, sample_of
from legbench.drives.master.tick import Tick
from legbench.drives.setup.config import BusConfig
from legbench.limits.guard import Guard
from legbench.limits.momentum import LegMomentum
from legbench.limits.safety import SafetyLimits


@final
class LimitedMotion:
    """Motion of all drives of a link, held within the limits of its guard."""

    def __init__(
        self,
        cycle: Cycle,
        guard: Guard,
        stiffness: Sequence[float],
        *,
        two_encoders: bool = True,
    ) -> None:
        """Prepare to measure and command the drives of a cycle.

        Args:
            cycle: cycle of the drives.
            guard: limits of their motion and of their commands.
            stiffness: stiffness of the series springs, one a drive [N m/rad].
            two_encoders: every drive has an encoder on both sides of its spring.

        Raises:
            ValueError: not one spring a drive.
        """
        if len(stiffness) != len(cycle.axes):
            raise ValueError(f"{len(stiffness)} springs for {len(cycle.axes)} drives")
        self._two_encoders = two_encoders
        self._cycle, self._guard = cycle, guard
        self._stiffness = tuple(float(value) for value in stiffness)
        self._acting: tuple[float, ...] | None = None
        """Command that acts by now; none before `begin` [rad]."""
        self._sent: tuple[float, ...] = ()
        """Command that acts in the next cycle [rad]."""
        self._seen_ns = 0

    def begin(self) -> None:
        """Begin to command from the targets that the drives hold, not from their encoders."""
        held = tuple(axis.target_pos for axis in self._cycle.axes)
        self._guard.start_at(held)
        self._acting = self._sent = held

    def sample(self, tick: Tick) -> Sample:
        """Measurements of all drives after a tick."""
        return sample_of(
            self._cycle,
            tick,
            self._stiffness,
            self._guard.applied,
            two_encoders=self._two_encoders,
        )

    @property
    def led_pos(self) -> tuple[float, ...]:
        """Positions of the encoders that the drives' loops are closed over [rad]."""
        return tuple(axis.motor_pos for axis in self._cycle.axes)

    def check(self, sample: Sample) -> None:
        """Check a cycle's measurements against all limits but the momentum; raises PlantFault."""
        interval = 1e-9 * (sample.time_ns - self._seen_ns)
        self._seen_ns = sample.time_ns
        self._guard.check(
            joint_pos=sample.link_pos,
            spring_torque=sample.spring_torque,
            temperature=sample.temperature,
        )
        if self._acting is not None:
            self._guard.check_encoders(
                motor_pos=sample.motor_pos if self._two_encoders else self.led_pos,
                joint_pos=sample.link_pos,
                fresh=sample.fresh,
                elapsed=1 + sample.skipped,
                interval=interval,
            )

    def meanwhile(self) -> None:
        """Do, while the drives answer a SYNC, what needs none of their answers; raises PlantFault.

        The processor has nothing else to do until then. So the bounds of what they may answer are
        computed here, and the measurements checked last are held against the leg's momentum: that
        takes longer than all other limits together, and its evidence grows over ten cycles and
        more, to which one adds little.
        """
        self._guard.check_momentum()
        if self._acting is not None:
            self._guard.expect(self._acting)

    def aim(self, motor_pos: Sequence[float]) -> tuple[tuple[float, ...], list[int | None]]:
        """Set the targets of all drives; returns them [rad] and the controlwords to send.

        Raises:
            PlantFault: the command is not finite or jumps too far.
        """
        applied = self._guard.command(motor_pos)
        axis_1, axis_2 = self._cycle.axes
        target_1, target_2 = applied
        axis_1.aim(target_1)
        axis_2.aim(target_2)
        words: list[int | None] = [axis_1.machine.controlword, axis_2.machine.controlword]
        self._acting, self._sent = self._sent, applied
        return applied, words


def guard_of(config: BusConfig, limits: SafetyLimits, momentum: LegMomentum | None = None) -> Guard:
    """Make the guard of a bus; limits of what its drives do not tell will not act."""
    return Guard(
        limits,
        config.period,
        known=[node.knows for node in config.nodes],
        two_encoders=config.two_encoders,
        momentum=momentum,
    )
