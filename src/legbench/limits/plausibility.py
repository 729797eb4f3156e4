"""Whether motors and encoders still work: what a healthy leg can show, and what it cannot.

Nothing here knows a bus or a plant; angles go in a cycle at a time, a `Doubt` comes out. Time is
counted in cycles, the same data give the same answer.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, final

STANDING_TIME = 0.02
"""A link that stands for so long while the other one swings is dead [s]."""
STANDING_BAND = 0.002
"""A link within this band stands: more than one count of an encoder of 4 096 a turn [rad]."""
SWAY_CYCLES = 4
"""Cycles that a sway lasts before it counts; late process data repeat for up to three."""
MEMORY = 1.0
"""Time constant in which the sway's reference follows what lasts, such as an offset [s]."""
SWAY_DELAY = 0.25
"""A sway this old is what the leg does; a younger one may be a fault's [s]."""
SWAY_MEMORY = 5.0
"""Time constant in which a sway is forgotten: a dozen hops, each of which may swing it on [s]."""
SWAY_GROWTH = 1.5
"""A leg that sways may sway so much more, relative to what it did [-]."""
HIDDEN = 0.1
"""Bound of a sway from which on a drift may hide in it [rad]: a leg with this bound sways by 0.03
rad, and 1 rad/s takes 0.13 s to both together."""
POLAR_GAIN = 10.0
"""What a command along the polar mode may cause there, relative to it, in resonance [-]."""


class Doubt(NamedTuple):
    """A reading that no healthy leg shows."""

    cause: str
    message: str


@dataclass(frozen=True, slots=True, kw_only=True)
class HealthBounds:
    """What a healthy leg stays within; a bound that is infinite does not act."""

    period: float
    """[s]"""
    following_error: float
    """Distance of a motor from everything that a healthy position loop could show [rad]."""
    following_cycles: int
    """Cycles that it may last."""
    servo_bandwidth: float
    """Corner frequency of the slowest position loop that is healthy [Hz]."""
    joint_speed: float
    """[rad/s]"""
    standing: float
    """Motion of the other link during which no link stands still [rad]."""
    sway: float
    """Motion of q1 + q2 that nobody has commanded [rad]."""


@final
class MotorWatch:
    """Compares one motor with all position loops that are healthy.

    A first-order loop of any bandwidth between `servo_bandwidth` and infinity, led by the same
    commands, is always found between two bounds: from the far one the slowest loop comes, at the
    near one an ideal loop is already. The bounds close upon a command that rests.

    Attributes:
        suspicion: what is wrong in this cycle, though it may not have lasted yet.
    """

    def __init__(self, bounds: HealthBounds) -> None:
        self._bounds = bounds
        self._gain = 1.0 - math.exp(-2.0 * math.pi * bounds.servo_bandwidth * bounds.period)
        self._limit = bounds.following_error
        self._low = self._high = 0.0
        self._age = 0
        self.suspicion: Doubt | None = None

    def start_at(self, position: float) -> None:
        """Begin with a motor that stands at `position` [rad]."""
        self._low = self._high = position
        self._age = 0

    def expect(self, command: float) -> None:
        """Move the bounds on by the command that acts in the coming cycle [rad]."""
        low, high, gain = self._low, self._high, self._gain
        self._low = command if command < low else low + gain * (command - low)
        self._high = command if command > high else high + gain * (command - high)

    def see(self, motor: int, position: float) -> Doubt | None:
        """Compare a motor's position [rad] with the bounds of the cycle that was expected."""
        low, high, limit = self._low, self._high, self._limit
        if low - position <= limit and position - high <= limit:
            self._age, self.suspicion = 0, None
            return None
        excess = max(low - position, position - high)
        self._age += 1
        self.suspicion = Doubt(
            "following error",
            f"motor {motor} shows {position:.3f} rad and is {excess:.3f} rad away from where its "
            f"commands lead any drive, for {self._age} cycles; the limit is {limit:g} rad: it is "
            "jammed, its encoder is dead, or its position loop is slower than servo_bandwidth",
        )
        return self.suspicion if self._age > self._bounds.following_cycles else None


@final
class LinkWatch:
    """Compares both link encoders with each other and with the motors.

    A link faster than `joint_speed` is none. On the radial mode, q1 = -q2, along which all
    controllers lead the leg, two more things do not happen: one link stands while the other one
    swings; and the links sway along the polar mode, q1 + q2. Both bounds widen with the sway of
    the seconds before, since a hop in place sways more from hop to hop, and with what is commanded
    along the polar mode, such as a jog of one motor: a leg that is led along it is not watched in
    this way. The references follow what lasts, such as an offset or the weight.

    Attributes:
        stands: one link stands while the other one swings, as it may in a leg that sways.
        hides_drift: the leg may sway so far that a drift of an encoder would be found too late.
    """

    def __init__(self, bounds: HealthBounds) -> None:
        self._bounds = bounds
        self._step_max = bounds.joint_speed * bounds.period
        self._forget = bounds.period / MEMORY
        self._keep = 1.0 - self._forget
        self._fade = 1.0 - bounds.period / SWAY_MEMORY
        self._delay = round(SWAY_DELAY / bounds.period)
        self._standing_cycles = max(2, round(STANDING_TIME / bounds.period))
        self._watches_standing = math.isfinite(bounds.standing)
        self._near = 0.49 * bounds.standing
        """Distance from one place within which a link does not swing, rounding included [rad]."""
        self.start()

    def start(self) -> None:
        """Begin anew with whatever is shown next."""
        self.stands = self.hides_drift = False
        self._last: tuple[float, float] | None = None
        self._silent = [0, 0]
        self._heard = True
        self._sway_age = 0
        self._sway_rest = self._led_rest = self._led = self._swayed = self._widening = 0.0
        self._limit = 0.0
        self._young = deque([0.0] * self._delay, maxlen=self._delay)
        self._window = deque[tuple[float, float, float, float]](maxlen=self._standing_cycles)
        self._place = (math.nan, math.nan)
        self._near_cycles = 0

    def expect(self, commands: Sequence[float]) -> None:
        """Widen the bounds of the coming cycle by the commands that act in it [rad].

        The leg may do so much along the polar mode, from what it did and was led to do.
        """
        command_1, command_2 = commands
        led = command_1 + command_2
        if self._last is None:
            self._led_rest = led
        self._led_rest = rest = self._led_rest + self._forget * (led - self._led_rest)
        fading, led = self._led * self._keep, abs(led - rest)
        self._led = led = led if led > fading else fading
        fading, past = self._swayed * self._fade, self._young[0]
        self._swayed = swayed = past if past > fading else fading
        self._widening = widening = SWAY_GROWTH * swayed + POLAR_GAIN * led
        self._limit = limit = self._bounds.sway + widening
        self.hides_drift = limit > HIDDEN

    def see(
        self,
        motor_pos: Sequence[float],
        joint_pos: Sequence[float],
        fresh: Sequence[bool],
        elapsed: int,
    ) -> Doubt | None:
        """Compare the readings of the cycle that was expected.

        Args:
            motor_pos: motors [rad].
            joint_pos: links [rad].
            fresh: which drives have told something new.
            elapsed: periods since the readings before.
        """
        joint_1, joint_2 = joint_pos
        polar, last = joint_1 + joint_2, self._last
        if last is None:
            self._last = last = (joint_1, joint_2)
            self._sway_rest = polar
        complete, reach = all(fresh), self._step_max * elapsed
        doubt, usual = None, complete and self._heard
        if usual and abs(joint_1 - last[0]) <= reach and abs(joint_2 - last[1]) <= reach:
            self._last = (joint_1, joint_2)
        else:
            doubt = self._speed((joint_1, joint_2), last, fresh, elapsed)
        self._sway_rest = rest = self._sway_rest + self._forget * (polar - self._sway_rest)
        sway = abs(polar - rest)
        self._young.append(sway)
        if sway > self._limit:
            doubt = self._doubt_sway(sway) or doubt
        else:
            self._sway_age = 0
        if not (complete and self._watches_standing):
            return doubt
        motor_1, motor_2 = motor_pos
        return self._standing(joint_1, joint_2, joint_1 - motor_1, joint_2 - motor_2) or doubt

    def _speed(
        self,
        joint_pos: tuple[float, float],
        last: tuple[float, float],
        fresh: Sequence[bool],
        elapsed: int,
    ) -> Doubt | None:
        """Judge each link by the time since its own last reading."""
        doubt, known = None, list(last)
        for place, value in enumerate(joint_pos):
            self._silent[place] += elapsed
            if not fresh[place]:
                continue
            step, cycles = abs(value - last[place]), self._silent[place]
            known[place], self._silent[place] = value, 0
            if step > self._step_max * cycles:
                doubt = Doubt(
                    "joint speed",
                    f"joint {place + 1} moved by {step:.3f} rad in {cycles} cycles, "
                    f"{step / (cycles * self._bounds.period):.0f} rad/s; the limit is "
                    f"{self._bounds.joint_speed:g} rad/s: look at its encoder",
                )
        self._last = (known[0], known[1])
        self._heard = not any(self._silent)
        return doubt

    def _doubt_sway(self, sway: float) -> Doubt | None:
        """Doubt a sway that is beyond its limit [rad], once it has lasted."""
        self._sway_age += 1
        if self._sway_age < SWAY_CYCLES:
            return None
        return Doubt(
            "sway",
            f"the links sway by {sway:.3f} rad along q1 + q2, where the motors have not led them; "
            f"the limit is {self._limit:.3f} rad: look at the link encoders, or raise sway for a "
            "leg that is pushed from outside",
        )

    def _standing(
        self, joint_1: float, joint_2: float, spring_1: float, spring_2: float
    ) -> Doubt | None:
        """Judge links [rad] and springs [rad] of a cycle in which both drives have answered."""
        window, cycles, near = self._window, self._standing_cycles, self._near
        window.append((joint_1, joint_2, spring_1, spring_2))
        self.stands = False
        place_1, place_2 = self._place
        if abs(joint_1 - place_1) <= near and abs(joint_2 - place_2) <= near:
            self._near_cycles += 1
            if self._near_cycles >= cycles:
                return None  # No link has swung.
        else:
            self._place, self._near_cycles = (joint_1, joint_2), 1
        if len(window) < cycles:
            return None
        first = window[0]
        if abs(joint_1 - first[0]) > STANDING_BAND and abs(joint_2 - first[1]) > STANDING_BAND:
            return None  # No link stands.
        return self._compare_ranges()

    def _compare_ranges(self) -> Doubt | None:
        """Judge each link by how far both have moved since the window began."""
        columns = tuple(zip(*self._window, strict=True))
        joints, springs = columns[:2], columns[2:]
        ranges = (_range(joints[0]), _range(joints[1]))
        limit = self._bounds.standing + self._widening
        for place in (0, 1):
            if ranges[place] > STANDING_BAND or ranges[1 - place] <= self._bounds.standing:
                continue
            self.stands = True
            # A link that its motor merely carries along pulls at nothing: the spring must work.
            moved = min(ranges[1 - place], _range(springs[1 - place]))
            if moved > limit:
                return Doubt(
                    "joint encoder",
                    f"joint {place + 1} stands at {joints[place][-1]:.3f} rad for "
                    f"{self._standing_cycles} cycles, in which the other one moved by "
                    f"{moved:.3f} rad; the limit is {limit:.3f} rad: its encoder is dead, or the "
                    "link is blocked",
                )
        return None


def _range(values: Sequence[float]) -> float:
    return max(values) - min(values)
