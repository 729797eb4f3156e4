"""Joint stops of soft rubber, which push and never pull, by the law of the simulation.

A joint that is `p` beyond its limit and would turn back at the acceleration `a0` if nothing
stopped it, turns back at `a1 = (1 - d) a0 + d (b dp/dt + k p)`, if that takes a push. With
`b = 2 / (d T)` and `k = 1 / (d T^2)` the joint returns critically damped with the time constant T
(MuJoCo's manual, "Solver parameters": solref (T, 1), solimp of one impedance d).

The push begins and ends with a jump, so an integrator has to locate both ends. Stops that are
touched at the same time act one after the other, each on the acceleration that the one before has
left.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from legbench.analytic.equations import Pair, Term
from legbench.design import Limits

TIME_CONSTANT = 0.01
"""Time constant T of a stop [s]."""
DAMPING, SQUARE = 2.0 / TIME_CONSTANT, TIME_CONSTANT**2
"""Factor of the speed in the law of a stop [1/s], and divisor of the depth [s^2]."""
IMPEDANCE = 0.95
"""Impedance d: share of the acceleration that the stop decides, not the leg itself [-]."""

KNEE: Pair = (-1.0, 1.0)
"""Factors of q1 and q2 in the knee's angle [-]."""
HIP: Pair = (1.0, 0.0)
"""Factors of q1 and q2 in the hip's angle [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """Stop at one end of a joint's range; its depth is `sign (limit - angle)`."""

    sign: float
    """1 for the lower end, -1 for the upper one."""
    limit: float
    """Angle at which the range ends [rad]."""
    on: Pair
    """Factors of q1 and q2 in the joint's angle [-]."""

    @property
    def normal(self) -> Pair:
        """Torque on q1 and q2 of a unit push away from the limit."""
        return self.sign * self.on[0], self.sign * self.on[1]

    def depth(self, q: Pair) -> Term:
        """Depth of a posture beyond the limit [rad]; negative within the range."""
        return self.sign * (self.limit - self.on[0] * q[0] - self.on[1] * q[1])

    def speed(self, v: Pair) -> Term:
        """Rate of the depth [rad/s]."""
        return -self.sign * (self.on[0] * v[0] + self.on[1] * v[1])

    def turn(self, q: Pair, v: Pair, a: Pair) -> Term:
        """Acceleration that the law asks for beyond that of the leg itself, away from the limit.

        Below zero the stop would have to pull, and does nothing [rad/s^2].

        Args:
            q: angles [rad].
            v: their rates [rad/s].
            a: their accelerations without this stop [rad/s^2].
        """
        (on_1, on_2), sign = self.on, self.sign
        speed = -sign * (on_1 * v[0] + on_2 * v[1])
        depth = sign * (self.limit - on_1 * q[0] - on_2 * q[1])
        back = DAMPING * speed + depth / SQUARE
        return back - IMPEDANCE * (sign * on_1 * a[0] + sign * on_2 * a[1])

    def push(self, q: Pair, v: Pair, a: Pair, answer: Pair) -> Term:
        """Torque on a joint beyond its limit by the law [N m]; below zero the stop does not act.

        `answer` is `M^-1 normal`, what a unit push adds to the accelerations [rad/s^2 / N m].
        """
        n1, n2 = self.normal
        return self.turn(q, v, a) / (n1 * answer[0] + n2 * answer[1])


def make_stops(limits: Limits) -> tuple[Stop, ...]:
    """Make the stops of knee and hip, at the lower and upper end of each."""
    joints: tuple[tuple[Pair, tuple[float, float]], ...] = (
        (KNEE, limits.knee),
        (HIP, limits.hip),
    )
    return tuple(
        Stop(sign=sign, limit=limit, on=on)
        for on, ends in joints
        for sign, limit in zip((1.0, -1.0), ends, strict=True)
    )


def pushes(
    solve: Callable[[Pair], Pair],
    stops: Sequence[Stop],
    beyond: Sequence[bool],
    q: Pair,
    v: Pair,
    a: Pair,
) -> tuple[list[float], Pair]:
    """Torque of each stop, zero if it does not act [N m], and the final accelerations [rad/s^2].

    The angles of the leg accelerate by `a` without stops, and its joints are `beyond` the limits
    of these stops. `solve` gives the accelerations that torques on q1 and q2 add.
    """
    found = []
    for stop, past in zip(stops, beyond, strict=True):
        force = 0.0
        if past:
            answer = solve(stop.normal)
            force = max(stop.push(q, v, a, answer), 0.0)
            a = a[0] + answer[0] * force, a[1] + answer[1] * force
        found.append(force)
    return found, a
