"""Model of a servo drive: slew, bandwidth, delay and quantisation of a commanded position.

The drives follow a position at 1 kHz behind series springs, so whatever they do to the command
is part of every result. The default is the perfect motor of the paper's equations.
"""

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, TypeVar, final

import numpy as np

from legbench.errors import ConfigError
from legbench.imperfections import MAX_DELAY_CYCLES, Imperfections
from legbench.signals import Floats

PERFECT: Final = Imperfections()
"""Imperfections of motors and encoders that have none."""


MIN_COUNTS: Final = 64
"""Smallest number of counts per revolution that an encoder may have: one count is 0.1 rad then."""


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
        if self.encoder_counts is not None and self.encoder_counts < MIN_COUNTS:
            raise ConfigError(
                f"servo encoder_counts is {self.encoder_counts}: one count would be "
                f"{2.0 * math.pi / self.encoder_counts:.2g} rad, as much as a leg's whole stroke; "
                f"take {MIN_COUNTS} or more"
            )
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
    """Servo of one leg or a batch, which computes motor positions cycle by cycle.

    Positions are those that the motors' encoders count; `shaft` tells where the shafts are.

    Attributes:
        position: positions of the motors (..., 2) [rad].
    """

    def __init__(
        self,
        config: ServoConfig | Sequence[ServoConfig],
        period: float,
        imperfections: Imperfections | Sequence[Imperfections] = PERFECT,
    ) -> None:
        """Prepare the drives of a leg.

        Args:
            config: limits of both drives; one for each leg where legs differ.
            period: control period [s].
            imperfections: limits and zero error of each motor; one for each leg where they differ.
        """
        limits = _table(config, lambda each: _limits(each, period))
        motors = _table(imperfections, lambda each: _motors(each, period))
        step, gain, resolution, delay = np.moveaxis(limits, -2, 0)
        slew, later, zero, low, high = np.moveaxis(motors, -2, 0)
        self._step_max, self._gain = np.minimum(step, slew), gain
        self._delay: Floats = delay + later
        self._delays: list[int] = sorted({int(value) for value in self._delay.flat})
        self._low, self._high = low, high
        self._zero = zero if zero.any() else None
        self._ranged = bool(np.isfinite(low).any() or np.isfinite(high).any())
        lags = not (np.isinf(self._step_max).all() and (gain == 1.0).all())
        self._ideal = not lags and self._delays == [0]
        self._counts = np.isfinite(resolution)
        self._resolution = np.where(self._counts, resolution, 1.0) if self._counts.any() else None
        self._waiting: deque[Floats] = deque(maxlen=self._delays[-1] + 1)
        self.position: Floats = np.zeros(2)

    def reset(self, position: Floats) -> None:
        """Stand still at `position` (..., 2) [rad], with nothing on the way."""
        self.position = self._within(position.copy())
        self._waiting.extend(position.copy() for _ in range(self._delays[-1] + 1))

    def follow(self, command: Floats) -> Floats:
        """Return motor positions (..., 2) [rad] held over the cycle that starts with `command`."""
        if self._ideal:
            self.position = self._within(command)
            return self.position
        self._waiting.append(command.copy())
        target = self._waiting[-1 - self._delays[0]]
        for late in self._delays[1:]:
            target = np.where(self._delay == late, self._waiting[-1 - late], target)
        move = self._gain * (target - self.position)
        moved = self.position + np.minimum(np.maximum(move, -self._step_max), self._step_max)
        self.position = self._within(moved)
        return self.position

    def shaft(self, position: Floats) -> Floats:
        """Return where the shafts are when the encoders count `position` (..., 2) [rad]."""
        return position if self._zero is None else position + self._zero

    def encode(self, position: Floats) -> Floats:
        """Return an angle as the encoders show it: rounded to whole counts."""
        resolution = self._resolution
        if resolution is None:
            return position
        return np.where(self._counts, np.round(position / resolution) * resolution, position)

    def _within(self, position: Floats) -> Floats:
        """A motor ends at its range, whatever it is told."""
        if not self._ranged:
            return position
        return np.minimum(np.maximum(position, self._low), self._high)


Settings = TypeVar("Settings", ServoConfig, Imperfections)


def _table(settings: Settings | Sequence[Settings], row: Callable[[Settings], Floats]) -> Floats:
    """Numbers of one leg's settings (k, 2), or of each leg's (n, k, 2)."""
    if isinstance(settings, ServoConfig | Imperfections):
        return row(settings)
    return np.array([row(each) for each in settings])


def _limits(config: ServoConfig, period: float) -> Floats:
    """Longest way in a cycle, gain of the position loop, count of the encoders, delay (4, 2)."""
    step = math.inf if config.slew_rate is None else config.slew_rate * period
    gain = (
        1.0
        if config.bandwidth is None
        else 1.0 - math.exp(-2.0 * math.pi * config.bandwidth * period)
    )
    count = math.inf if config.encoder_counts is None else 2.0 * math.pi / config.encoder_counts
    return np.array([[value, value] for value in (step, gain, count, config.delay_cycles)])


def _motors(imperfections: Imperfections, period: float) -> Floats:
    """Longest way in a cycle, delay, zero error, lower and upper end of each motor (5, 2)."""
    slew = imperfections.motor_slew_rate or (math.inf, math.inf)
    ends = imperfections.motor_range or ((-math.inf, math.inf),) * 2
    return np.array(
        [
            [rate * period for rate in slew],
            imperfections.motor_delay_cycles or (0, 0),
            imperfections.motor_zero or (0.0, 0.0),
            [low for low, _ in ends],
            [high for _, high in ends],
        ]
    )
