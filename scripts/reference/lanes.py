"""State of many hops that advance together.

A lane is one hop. A piece of a hop runs from one event to the next; within it motors, regime and
the switches of the stops stand still, so that the motion is smooth.
"""

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from reference.law import SCALE
from reference.legs import GRAVITY, STOPS, Form, Legs, acceleration, depth, foot, rise, stopped

from legbench.signals import Bools, Floats, Ints

NEAR = 0.3 * GRAVITY
"""Contact force over mass below which the ground nearly pulls [m/s^2]."""


@dataclass(slots=True, kw_only=True)
class Lanes:
    """Arrays of n lanes, which are the last axis of each."""

    number: Ints
    """Number of the hop in its batch [-]."""
    legs: Legs
    form: Form
    """Inertia and gravity of the regime in which each leg is."""
    probe: Floats
    """Factors of the angles in y (2, n) [-]."""
    y: Floats
    """Angles and rates (4, n) [rad, rad/s]."""
    time: Floats
    """Time since the first apex [s]."""
    step: Floats
    """Length of the next step, before anything cuts it [s]."""
    rejected: Bools
    """Whether the last step was rejected."""
    flies: Bools
    """Whether the leg is in the air."""
    left: Bools
    """Whether the leg has lifted off since its first apex."""
    blind: Floats
    """Time until which touchdown and lift-off are not looked at [s]."""
    began: Floats
    """Time at which the flight began [s]."""
    centre: Floats
    """Height [m], upward and forward speed [m/s] of the centre of mass there (3, n)."""
    touched: Bools
    """Whether a joint is beyond a limit, in the order of `STOPS` (4, n)."""
    pushing: Bools
    """Whether the stop pushes (4, n)."""
    upper: Floats
    lower: Floats
    """Levels of y [rad]."""
    turning: Ints
    """Kind of the extreme of y that is waited for: 1 minimum, -1 maximum, 0 none [-]."""
    alarm: Floats
    """Time at which the controller goes on by itself [s]."""
    motor: Floats
    """Motor positions (2, n) [rad]."""

    def take(self, columns: Ints | Bools) -> Self:
        """Some of the lanes, copied."""
        return type(self)(**{name: _take(getattr(self, name), columns) for name in self.__slots__})

    def rates(self, y: Floats) -> Floats:
        """Time derivative of the states (4, n)."""
        a = acceleration(self.legs, self.form, self.motor, y)
        if self.touched.any():
            _, a = stopped(self.legs, self.form, y, a, self.pushing, self.touched)
        return np.array([y[2], y[3], *a])

    def height(self, y: Floats, time: Floats) -> Floats:
        """Height of the foot in flight [m]."""
        elapsed = time - self.began
        z, up, _ = self.centre
        return z + (up - 0.5 * GRAVITY * elapsed) * elapsed + foot(self.legs, y)[0]

    def sinking(self) -> Bools:
        """Whether the foot of a leg in flight goes down at present."""
        speed = self.centre[1] - GRAVITY * (self.time - self.began)
        return speed + foot(self.legs, self.y)[2] < 0.0

    def pull(self, y: Floats) -> Floats:
        """Condition of lift-off: the ground pulls, and the released foot would rise [m/s^2].

        The second is computed for lanes alone whose ground pulls, or nearly so, at some of the
        states; the condition is below zero elsewhere.
        """
        legs = self.legs
        bare = acceleration(legs, self.form, self.motor, y)
        _, held = stopped(legs, self.form, y, bare, self.pushing, self.touched)
        pull = rise(legs.arm(), y, held) - GRAVITY
        near = np.flatnonzero((pull > -NEAR).reshape(-1, self.number.size).any(axis=0))
        if near.size:
            lanes, y = self.take(near), y[..., near]
            air = lanes.legs.air()
            free = acceleration(lanes.legs, air, lanes.motor, y)
            _, free = stopped(lanes.legs, air, y, free, None, lanes.touched)
            rising = rise(lanes.legs.arm(), y, free) - GRAVITY
            pull[..., near] = np.minimum(pull[..., near], rising)
        return pull

    def asked(self, y: Floats, *, by_law: bool = False) -> Floats:
        """What each stop adds (4, ...); others act as switched, or by the law [rad/s^2]."""
        bare = acceleration(self.legs, self.form, self.motor, y)
        acts = None if by_law else self.pushing
        return stopped(self.legs, self.form, y, bare, acts, self.touched)[0]


def _take(value: Any, columns: Ints | Bools) -> Any:
    """Columns of an array, or of each array of a tuple."""
    if isinstance(value, tuple):
        return type(value)(*(entry[..., columns] for entry in value))
    return value[..., columns]


def launch(legs: Legs, probe: Floats, starts: Floats) -> Lanes:
    """Lanes at their first apexes."""
    height, speed, z1, z2, dz1, dz2 = starts
    size, none = height.size, np.zeros_like(height)
    y = SCALE * np.array([z1 - z2, z1 + z2, dz1 - dz2, dz1 + dz2])
    flies = np.ones(size, dtype=bool)
    touched = np.array([depth(legs, stop, y) > 0.0 for stop in range(len(STOPS))])
    return Lanes(
        number=np.arange(size),
        legs=legs,
        form=legs.form(flies),
        probe=probe,
        y=y,
        time=none.copy(),
        step=np.full(size, 1e-3),
        rejected=~flies,
        flies=flies,
        left=~flies,
        blind=np.full(size, -math.inf),
        began=none.copy(),
        centre=np.array([height, none, speed]),
        touched=touched,
        pushing=np.zeros_like(touched),
        upper=none.copy(),
        lower=none.copy(),
        turning=np.zeros(size, dtype=np.int64),
        alarm=none.copy(),
        motor=np.zeros((2, size)),
    )
