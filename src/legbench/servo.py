"""Model of a servo drive: slew, bandwidth, delay and quantisation of a commanded position.

The drives follow a position at 1 kHz behind series springs, so whatever they do to the command
is part of every result. The default is the perfect motor of the paper's equations.
"""

import math
from collections import deque
from dataclasses import dataclass
from typing import final

import numpy as np

from legbench.errors import ConfigError
from legbench.signals import Floats

MAX_DELAY_CYCLES = 1000
"""Largest delay, one second: a drive that reacts later is broken, not slow."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoConfig:
    """Limits of both drives; a limit that is not given does not act.

    Raises:
        ConfigError: a limit that is zero or negative, or a delay of more than a second.
    """

    slew_rate: float | None = None
    """Highest motor speed [rad/s]."""
    bandwidth: float | None = None
    """Corner frequency of the first-order position response [Hz]."""
    delay_cycles: int = 0
    """Number of cycles between a command and the motor's first reaction to it."""
    encoder_counts: int | None = None
    """Number of counts per revolution of motor and link encoders; none: they resolve everything."""

    def __post_init__(self) -> None:
        for name, value, unit in (
            ("slew_rate", self.slew_rate, "rad/s"),
            ("bandwidth", self.bandwidth, "Hz"),
            ("encoder_counts", self.encoder_counts, "counts per revolution"),
        ):
            if value is not None and not value > 0:
                raise ConfigError(f"servo {name} is {value:g} {unit}; it must be positive")
        if not 0 <= self.delay_cycles <= MAX_DELAY_CYCLES:
            raise ConfigError(
                f"servo delay_cycles is {self.delay_cycles}; it must be 0 to {MAX_DELAY_CYCLES}"
            )

    @property
    def ideal(self) -> bool:
        """Whether the motor is where it is told to be."""
        return self.slew_rate is None and self.bandwidth is None and self.delay_cycles == 0


@final
class Servo:
    """Servo of one leg or a batch, which computes motor positions cycle by cycle."""

    def __init__(self, config: ServoConfig, period: float) -> None:
        self._ideal, self._delay = config.ideal, config.delay_cycles
        self._step_max = math.inf if config.slew_rate is None else config.slew_rate * period
        self._gain = (
            1.0
            if config.bandwidth is None
            else 1.0 - math.exp(-2.0 * math.pi * config.bandwidth * period)
        )
        self._resolution = (
            None if config.encoder_counts is None else 2.0 * math.pi / config.encoder_counts
        )
        self._waiting: deque[Floats] = deque()
        self._position: Floats = np.zeros(2)

    def reset(self, position: Floats) -> None:
        """Stand still at `position` (..., 2) [rad], with nothing on the way."""
        self._position = position.copy()
        self._waiting = deque(position.copy() for _ in range(self._delay))

    def follow(self, command: Floats) -> Floats:
        """Return motor positions (..., 2) [rad] held over the cycle that starts with `command`."""
        if self._ideal:
            self._position = command
            return command
        self._waiting.append(command.copy())
        target = self._waiting.popleft()
        move = self._gain * (target - self._position)
        self._position = self._position + np.clip(move, -self._step_max, self._step_max)
        return self._position

    def encode(self, position: Floats) -> Floats:
        """Return an angle as the encoders show it: rounded to whole counts."""
        if self._resolution is None:
            return position
        return np.round(position / self._resolution) * self._resolution
