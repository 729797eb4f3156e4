"""Plant that wraps a computed one and lets a motor or encoder of it die in mid-run."""

from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from typing import final

import numpy as np

from legbench.plant.abstract import AbstractPlant
from legbench.signals import Command, Floats, Observation

STEP = 0.1
"""Size of a sudden step of an encoder [rad]."""
DRIFT = 1.0
"""Speed at which an encoder drifts [rad/s]."""


class Part(StrEnum):
    """Part of one drive that may die."""

    JAMMED = "jammed motor"
    MOTOR_FROZEN = "frozen motor encoder"
    LINK_FROZEN = "frozen link encoder"
    REPEATING = "process data repeated"
    MOTOR_STEP = "step of the motor encoder"
    LINK_STEP = "step of the link encoder"
    MOTOR_DRIFT = "drift of the motor encoder"
    LINK_DRIFT = "drift of the link encoder"

    @property
    def drifts(self) -> bool:
        """Whether its reading becomes wrong gradually."""
        return self in (Part.MOTOR_DRIFT, Part.LINK_DRIFT)

    @property
    def shows_at_once(self) -> bool:
        """Whether it differs from a healthy part from the instant in which it dies."""
        return self.drifts or self in (Part.MOTOR_STEP, Part.LINK_STEP)

    @property
    def size(self) -> float:
        """Size of its step [rad] or rate of its drift [rad/s]; 0 if it has neither."""
        if self in (Part.MOTOR_STEP, Part.LINK_STEP):
            return STEP
        return DRIFT if self.drifts else 0.0


@final
class BrokenPlant(AbstractPlant):
    """Plant that shows the observations of the plant within until a part of it dies.

    Attributes:
        contradiction: difference between what the dead part shows and what a healthy one would
            [rad].
    """

    def __init__(self, plant: AbstractPlant, stiffness: Floats, part: Part, drive: int) -> None:
        """Wrap a plant, which is closed with this one.

        Args:
            plant: one leg.
            stiffness: of the series springs (2,) [N m/rad].
            part: the part that is to die.
            drive: index of its drive, 0 or 1.
        """
        self.period = plant.period
        self.contradiction = 0.0
        self._plant, self._stiffness, self._part, self._drive = plant, stiffness, part, drive
        self._seen: Observation | None = None
        self._last: tuple[float, float] | None = None
        self._broken = 0

    def reset(self) -> Observation:
        """Reset the plant within; the part works again."""
        self._seen, self._last, self._broken = self._plant.reset(), None, 0
        return self._seen

    def break_part(self) -> None:
        """Let the part die now, so that the next observation shows it."""
        if self._seen is None:
            raise RuntimeError("a plant that was never reset has nothing to break")
        place = self._drive
        self._last = (float(self._seen.motor_pos[place]), float(self._seen.joint_pos[place]))

    def step(self, command: Command) -> Observation:
        """Apply a command and show the result, as the dead part lets it through."""
        if self._last is None:
            self._seen = self._plant.step(command)
            return self._seen
        self._broken += 1
        place, wished = self._drive, float(command.motor_pos[self._drive])
        if self._part is Part.JAMMED:
            held = command.motor_pos.copy()
            held[place] = self._last[0]
            command = replace(command, motor_pos=held)
        seen = self._plant.step(command)
        motor, link = float(seen.motor_pos[place]), float(seen.joint_pos[place])
        shown_motor, shown_link = self._shown(motor, link)
        if self._part is Part.JAMMED:
            self.contradiction = abs(wished - self._last[0])
        else:
            self.contradiction = max(abs(shown_motor - motor), abs(shown_link - link))
        return self._altered(seen, shown_motor, shown_link)

    def rest(self, motor_pos: Floats, interrupted: Callable[[], bool]) -> str | None:
        """Pass it on to the plant within."""
        return self._plant.rest(motor_pos, interrupted)

    def _shown(self, motor: float, link: float) -> tuple[float, float]:
        if self._last is None:
            return motor, link
        drift = DRIFT * self.period * self._broken
        match self._part:
            case Part.JAMMED:
                return motor, link
            case Part.MOTOR_FROZEN:
                return self._last[0], link
            case Part.LINK_FROZEN:
                return motor, self._last[1]
            case Part.REPEATING:
                return self._last
            case Part.MOTOR_STEP:
                return motor + STEP, link
            case Part.LINK_STEP:
                return motor, link + STEP
            case Part.MOTOR_DRIFT:
                return motor + drift, link
            case Part.LINK_DRIFT:
                return motor, link + drift

    def _altered(self, seen: Observation, motor: float, link: float) -> Observation:
        motors, links = np.array(seen.motor_pos), np.array(seen.joint_pos)
        motors[self._drive], links[self._drive] = motor, link
        torque = self._stiffness * (motors - links)
        return replace(seen, motor_pos=motors, joint_pos=links, spring_torque=torque)

    def close(self) -> None:
        """Close the plant within."""
        self._plant.close()
