"""Joint stops: rubber that pushes back, never pulls.

`F = k p (s + sqrt(1 + s^2))` with the depth p and `s = chi dp/dt / 2`: nearly `k p (1 + chi
dp/dt)` on the way in, as Hunt and Crossley have it, and positive on the way out. Unlike a spring
beside a damper it starts from zero, so an integrator meets a kink and not a jump. The stiffness
is that of a 20 ms time constant with the inertia that the knee of the free leg shows at its stop.
"""

from dataclasses import dataclass

from legbench.analytic.equations import SCALAR, Ops, Pair, Term
from legbench.analytic.terms import FloatingTerms
from legbench.design import Limits

TIME_CONSTANT = 0.02
"""As that of the simulation's stops [s]."""
CHI = 1.0
"""Damping of the rubber [s/rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """One end of a joint's range; depth is `sign (side - angle)`, side the limit."""

    sign: float
    """1 for the lower end, -1 for the upper one."""
    limit: float
    """[rad]"""
    on: Pair
    """How the joint's angle is made of q1 and q2."""
    stiffness: float
    """[N m/rad]"""

    def depth(self, q: Pair) -> Term:
        """How far beyond the limit [rad]; negative within the range."""
        return self.sign * (self.limit - self.on[0] * q[0] - self.on[1] * q[1])

    def speed(self, v: Pair) -> Term:
        """Rate of the depth [rad/s]."""
        return -self.sign * (self.on[0] * v[0] + self.on[1] * v[1])

    def force(self, ops: Ops, q: Pair, v: Pair) -> Term:
        """Torque on the joint, away from the limit, if the stop is touched [N m]."""
        s = 0.5 * CHI * self.speed(v)
        return self.stiffness * self.depth(q) * (s + ops.sqrt(1.0 + s * s))

    def torque(self, force: Term) -> Pair:
        """What a force on the joint is on q1 and q2 [N m]."""
        return self.sign * self.on[0] * force, self.sign * self.on[1] * force


def make_stops(terms: FloatingTerms, limits: Limits) -> tuple[Stop, ...]:
    """Stops of knee and hip, lower and upper end each."""
    free = terms.falling()
    determinant = free.inertia[0] * free.inertia[1] - free.coupling**2
    knee = determinant / (free.inertia[0] + free.inertia[1] + 2.0 * free.coupling)
    stiffness = abs(knee) / TIME_CONSTANT**2
    joints: tuple[tuple[Pair, tuple[float, float]], ...] = (
        ((-1.0, 1.0), limits.knee),
        ((1.0, 0.0), limits.hip),
    )
    return tuple(
        Stop(sign=sign, limit=limit, on=on, stiffness=stiffness)
        for on, ends in joints
        for sign, limit in zip((1.0, -1.0), ends, strict=True)
    )


def stop_torque(stops: tuple[Stop, ...], q: Pair, v: Pair) -> Pair:
    """Torque of all stops on q1 and q2 of one leg (floats) [N m]."""
    total = (0.0, 0.0)
    for stop in stops:
        if stop.depth(q) > 0.0:
            torque = stop.torque(stop.force(SCALAR, q, v))
            total = total[0] + torque[0], total[1] + torque[1]
    return total
