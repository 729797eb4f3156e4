"""Safety limits around a plant that has none of its own."""

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import final

import numpy as np

from legbench.limits.guard import Guard
from legbench.limits.momentum import LegMomentum
from legbench.limits.safety import SafetyLimits
from legbench.limits.shortfall import Shortfall
from legbench.plant.abstract import AbstractPlant
from legbench.signals import Command, Floats, Observation


@final
class LimitedPlant(AbstractPlant):
    """Plant that lets through what the limits allow and ends the run where they are exceeded.

    The same `Guard` sits in the cyclic link of the drives, so that a run shows the same slewing
    and the same faults on every plant. `command_pos` of a recording is the wish, `applied_pos`
    what was let through.
    """

    def __init__(
        self,
        plant: AbstractPlant,
        limits: SafetyLimits,
        *,
        delay_cycles: int = 0,
        momentum: LegMomentum | None = None,
    ) -> None:
        """Wrap a plant.

        Args:
            plant: one leg, closed with this plant.
            limits: what it may do.
            delay_cycles: number of cycles that its motors react late.
            momentum: what its angular momentum obeys; without it `link_error` does not act.
        """
        self.period = plant.period
        self._plant, self._delay = plant, delay_cycles
        self._guard = Guard(limits, plant.period, momentum=momentum)
        self._expected: deque[tuple[float, ...]] = deque()

    def reset(self) -> Observation:
        """Reset the plant within; the command begins where its motors are."""
        seen = self._plant.reset()
        self._guard.start_at(seen.motor_pos.tolist())
        self._expected = deque([self._guard.applied] * self._delay)
        return seen

    def step(self, command: Command) -> Observation:
        """Apply what is allowed of a command over one period.

        Raises:
            PlantFault: a limit is exceeded, or the plant itself has failed.
        """
        applied = self._guard.command(command.motor_pos.tolist())
        self._expected.append(applied)
        seen = self._plant.step(replace(command, motor_pos=np.array(applied)))
        joint_pos = seen.joint_pos.tolist()
        self._guard.expect(self._expected.popleft())
        self._guard.check(joint_pos=joint_pos, spring_torque=seen.spring_torque.tolist())
        self._guard.check_encoders(
            motor_pos=seen.motor_pos.tolist(),
            joint_pos=joint_pos,
        )
        self._guard.check_momentum()
        return seen

    def rest(self, motor_pos: Floats, interrupted: Callable[[], bool]) -> str | None:
        """Lead the leg of the plant within to rest."""
        return self._plant.rest(motor_pos, interrupted)

    @property
    def shortfall(self) -> Shortfall:
        """Counts of the commands that the limits changed."""
        return self._guard.shortfall

    def close(self) -> None:
        """Close the plant within."""
        self._plant.close()
