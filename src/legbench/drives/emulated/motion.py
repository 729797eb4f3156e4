"""Motion of an emulated motor: interpolation of set points, ramps, position loop, encoder."""

import math
from collections import deque
from typing import final

from legbench.drives.emulated.behaviour import Behaviour, MissingSetpoint
from legbench.drives.protocol.objects import Key
from legbench.drives.setup.units import AxisUnits

SECOND_NS = 1_000_000_000
LINK_BANDWIDTH = 2.0
"""Corner frequency of a position loop over the encoder of the link [Hz]."""


@final
class Motion:
    """The moving part of one drive, in unwrapped counts of its motor encoder.

    Attributes:
        demand: position that the motor should have now [counts].
        actual: position of the motor [counts].
        speed: speed of the demand [counts/s].
        limited: the target was cut to the software limits (607Dh).
        missing: SYNCs in a row without a new target.
        beside: way from the motor to the encoder of the position loop, where that one sits at the
            link [counts].
        jammed: the motor stands, whatever the position loop does.
    """

    def __init__(self, units: AxisUnits, behaviour: Behaviour, values: dict[Key, int]) -> None:
        self._units, self._behaviour, self._values = units, behaviour, values
        self.actual = units.offset_counts + behaviour.start_pos * units.counts_per_rad
        self._true_zero = float(units.offset_counts)
        self._hard = self._stops()
        self.demand = self.actual
        self.speed = 0.0
        self.limited = False
        self.missing = 0
        self.jammed = False
        self.beside = 0.0
        self._from = self._to = self.actual
        self._since_ns = 0
        self._late_ms = 0.0
        self._waiting: deque[float] = deque()

    def _stops(self) -> tuple[float, float]:
        stops = self._behaviour.hard_stop
        if stops is None:
            return (-math.inf, math.inf)
        low, high = (self._true_zero + stop * self._units.counts_per_rad for stop in stops)
        return (min(low, high), max(low, high))

    @property
    def angle(self) -> float:
        """True motor position, independent of the zero set by homing [rad]."""
        return self.travel / self._units.counts_per_rad

    @property
    def travel(self) -> float:
        """Distance of the motor from its true zero, independent of homing [counts]."""
        return self.actual - self._true_zero

    @property
    def sign(self) -> int:
        """Sign between positions of the object dictionary and of the motor: bit 7 of 607Eh."""
        return -1 if self._values[0x607E, 0] & 0x80 else 1

    @property
    def span_ns(self) -> int:
        """Interpolation time 60C2h [ns]."""
        value, exponent = self._values[0x60C2, 1], self._values[0x60C2, 2]
        if not -9 <= exponent <= 3:
            exponent = max(-9, min(exponent, 3))
        return max(1, round(value * 10.0**exponent * SECOND_NS))

    def hold(self, now_ns: int) -> None:
        """Hold the motor where it is and drop the interpolated way to a target."""
        self.demand = self._from = self._to = self.actual
        self.speed, self._since_ns, self.missing = 0.0, now_ns, 0
        self._waiting.clear()

    def latch(self, target: int | None, now_ns: int) -> None:
        """Start the interpolated way to a target [counts] at SYNC, or count that none came."""
        if target is None:
            self.missing += 1
            if self._behaviour.missing_setpoint is not MissingSetpoint.EXTRAPOLATE:
                return
            goal = 2.0 * self._to - self._from
        else:
            self.missing = 0
            goal = self._late(float(target))
        goal = self._limit(goal)
        self._from = self.demand if self._behaviour.interpolate else goal
        self._to, self._since_ns = goal, now_ns

    def _late(self, target: float) -> float:
        """Target that is followed now [counts]: the one that has waited for long enough."""
        self._waiting.append(target)
        if len(self._waiting) <= self._behaviour.setpoint_delay:
            return self._to
        return self._waiting.popleft()

    def _limit(self, goal: float) -> float:
        low, high = self._values[0x607D, 1], self._values[0x607D, 2]
        if self.sign < 0:
            low, high = -high, -low
        if low >= high:
            self.limited = False
            return goal
        kept = min(max(goal, low), high)
        self.limited = kept != goal
        return kept

    def follow(self, now_ns: int, step_ns: int) -> None:
        """Move the demand along the interpolated way to its place at `now_ns`."""
        share = 1.0
        if self._behaviour.interpolate:
            share = min(share, (now_ns - self._since_ns) / self.span_ns)
        self._demand(self._from + share * (self._to - self._from), step_ns)

    def seek(self, speed: float, step_ns: int) -> None:
        """Move the demand at a speed [counts/s]."""
        self._demand(self.demand + speed * step_ns / SECOND_NS, step_ns)

    def ramp(self, deceleration: float, step_ns: int) -> bool:
        """Brake the demand [counts/s2], at once at deceleration 0; returns whether it stands."""
        step = step_ns / SECOND_NS
        loss = deceleration * step if deceleration > 0.0 else math.inf
        speed = math.copysign(max(0.0, abs(self.speed) - loss), self.speed)
        self._demand(self.demand + speed * step, step_ns)
        self.speed = speed
        self._from = self._to = self.demand
        return speed == 0.0

    def _demand(self, demand: float, step_ns: int) -> None:
        self.speed = (demand - self.demand) * SECOND_NS / step_ns
        self.demand = demand

    def drive(self, step_ns: int) -> None:
        """Move the motor towards the demand, as its position loop does."""
        if self.jammed:
            return
        move = self.demand - self.actual
        step = step_ns / SECOND_NS
        if self.beside:
            # A loop over the spring has to be slow, or the spring swings in it.
            move = (move - self.beside) * -math.expm1(-2.0 * math.pi * LINK_BANDWIDTH * step)
        if self._behaviour.bandwidth is not None:
            move *= 1.0 - math.exp(-2.0 * math.pi * self._behaviour.bandwidth * step)
        top = self._values[0x6080, 0]
        if top:
            move = min(max(move, -top * step), top * step)
        if self._behaviour.slew_rate is not None:
            reach = self._behaviour.slew_rate * abs(self._units.counts_per_rad) * step
            move = min(max(move, -reach), reach)
        low, high = self._hard
        self.actual = min(max(self.actual + move, low), high)

    def blocked(self) -> bool:
        """Whether the motor presses against a mechanical stop."""
        low, high = self._hard
        return (self.actual <= low and self.demand < low) or (
            self.actual >= high and self.demand > high
        )

    def overdue(self, step_ns: int) -> bool:
        """Whether the following error has been too large for too long (6065h, 6066h)."""
        window = self._values[0x6065, 0]
        if window == 0xFFFFFFFF or abs(self.demand - self.actual - self.beside) <= window:
            self._late_ms = 0.0
            return False
        self._late_ms += step_ns / 1e6
        return self._late_ms > self._values[0x6066, 0]

    def set_position(self, counts: int) -> None:
        """Set the present position to `counts`, as homing does."""
        shift = counts - self.actual
        low, high = self._hard
        self._true_zero += shift
        self._hard = (low + shift, high + shift)
        self.actual += shift
        self.demand += shift
        self._from += shift
        self._to += shift
        self._waiting = deque(target + shift for target in self._waiting)
