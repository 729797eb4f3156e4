"""Many legs at once: the equations of the paper, typed for arrays and for nothing else.

Nothing here is shared with the package but the entries of a design. Stance is Appendix I line by
line. The leg in the air is the floating base of section IV-A, `[x_t, z_t, q1, q2]`: every body is
at `hip + a dir(q1) + b dir(q2)` with `dir(q) = (sin q, -cos q)`, and the trunk's two coordinates
are eliminated from the inertia matrix. A touchdown is eq. (12) with matrices of four rows.
States are (q1, q2, v1, v2), one leg a column.
"""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

from legbench.design import LegDesign
from legbench.signals import Bools, Floats, Ints

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""
STOP_TIME, STOP_SHARE = 0.01, 0.95
"""Time constant of a joint stop [s], and the share of the acceleration that it decides [-]."""
STOPS = ((-1.0, 1.0, 1.0), (-1.0, 1.0, -1.0), (1.0, 0.0, 1.0), (1.0, 0.0, -1.0))
"""Stops in the order knee low, knee high, hip low, hip high: factors of q1 and q2 in the joint's
angle, and the direction in which the stop pushes it [-]."""


class Form(NamedTuple):
    """Inertia and gravity of two angles: the matrices of Appendix I without their sines (n,)."""

    first: Floats
    """Entry of the inertia matrix on q1 [kg m^2]."""
    second: Floats
    """Entry on q2 [kg m^2]."""
    mixed: Floats
    """Entry off the diagonal at q1 = q2 [kg m^2]."""
    weight_1: Floats
    """Torque of gravity on q1 at sin(q1) = 1 [N m]."""
    weight_2: Floats
    """Torque of gravity on q2 at sin(q2) = 1 [N m]."""

    def solve(
        self, q: Floats, right_1: Floats | float, right_2: Floats | float
    ) -> tuple[Floats, Floats]:
        """Accelerations that two torques cause [rad/s^2]."""
        mixed = self.mixed * np.cos(q[0] - q[1])
        whole = self.first * self.second - mixed * mixed
        return (
            (self.second * right_1 - mixed * right_2) / whole,
            (self.first * right_2 - mixed * right_1) / whole,
        )


class Legs(NamedTuple):
    """Constants of n legs (n,), or (k, n) for k limits and pairs."""

    mass: Floats
    """Whole mass [kg]."""
    reach: Floats
    """Length l2 = l1 + l3 [m]."""
    moment: Floats
    """Sums of `m a` and `m b` over the bodies (2, n) [kg m]."""
    own: Floats
    """Sums of `m a^2 + I` and `m b^2 + I` of the bodies parallel to each angle (2, n) [kg m^2]."""
    cross: Floats
    """Sum of `m a b` [kg m^2]."""
    stance: Floats
    """Appendix I: entries of `Form` (5, n)."""
    stiffness: Floats
    """Springs (2, n) [N m/rad]."""
    damping: Floats
    """Dampers (2, n) [N m s/rad]."""
    limits: Floats
    """Limits in the order of `STOPS` (4, n) [rad]."""

    @classmethod
    def of(cls, designs: Sequence[LegDesign]) -> Self:
        """Constants of a sequence of designs, bars without mass."""
        trunk = np.array([d.trunk_mass for d in designs])
        m1, m2, m3 = _entries(designs, "mass")
        c1, c2, c3 = _entries(designs, "com")
        i1, i2, i3 = _entries(designs, "inertia")
        l1, l2, l3 = _entries(designs, "length")
        along = l1 + c3
        t1 = (trunk + m1) * l1 - c1 * m1
        t2 = (trunk + m1 + m2) * (l1 + l3) - c2 * m2
        t3 = (trunk + m1 + m2 + m3) * l3 - c3 * m3
        t4 = t1 * (l1 + l3) + t2 * l3
        t5 = (t1 - c1 * m1) * l1 + m1 * c1**2 + i1
        t6 = (t2 - c2 * m2) * (l1 + l3) + m2 * c2**2 + i2
        t7 = (t3 - c3 * m3) * l3 + m3 * c3**2 + i3
        weights = -GRAVITY * (t1 + t3), -GRAVITY * t2
        return cls(
            mass=trunk + m1 + m2 + m3,
            reach=l2,
            moment=np.array([m1 * c1 + m2 * l1 + m3 * along, m2 * c2 + m3 * l2]),
            own=np.array(
                [
                    m1 * c1**2 + i1 + m2 * l1**2 + m3 * along**2 + i3,
                    m2 * c2**2 + i2 + m3 * l2**2,
                ]
            ),
            cross=m2 * l1 * c2 + m3 * along * l2,
            stance=np.array([2.0 * t1 * l3 + t5 + t7, t6, t4, *weights]),
            stiffness=np.array([d.stiffness for d in designs]).T,
            damping=np.array([d.damping for d in designs]).T,
            limits=np.array([[*d.limits.knee, *d.limits.hip] for d in designs]).T,
        )

    def take(self, columns: Ints | Bools) -> Self:
        """Constants of some of the legs."""
        return type(self)(*(entry[..., columns] for entry in self))

    def air(self) -> Form:
        """Inertia of the angles of a leg that nothing touches."""
        f, none = self.moment, np.zeros_like(self.mass)
        own = self.own - f * f / self.mass
        return Form(own[0], own[1], self.cross - f[0] * f[1] / self.mass, none, none)

    def form(self, flies: Bools) -> Form:
        """Inertia and gravity of each leg, in the air or on the ground."""
        return Form(*(np.where(flies, a, b) for a, b in zip(self.air(), self.stance, strict=True)))

    def arm(self) -> Floats:
        """Way from the centre of mass to the foot along the directions of q1 and q2 (2, n) [m]."""
        return self.reach - self.moment / self.mass


def _entries(designs: Sequence[LegDesign], name: str) -> Floats:
    """One entry of thigh, shank and foot (3, n)."""
    return np.array([[getattr(segment, name) for segment in d.segments] for d in designs]).T


def acceleration(legs: Legs, form: Form, motor: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Eq. (1) for the angles, without joint stops: `M qdd = tau - C qd - g` [rad/s^2]."""
    q1, q2, v1, v2 = y
    turn = form.mixed * np.sin(q1 - q2)
    springs = legs.stiffness[0] * (motor[0] - q1), legs.stiffness[1] * (motor[1] - q2)
    return form.solve(
        y,
        springs[0] - legs.damping[0] * v1 - turn * v2 * v2 - form.weight_1 * np.sin(q1),
        springs[1] - legs.damping[1] * v2 + turn * v1 * v1 - form.weight_2 * np.sin(q2),
    )


def depth(legs: Legs, stop: int, y: Floats) -> Floats:
    """Angle by which a joint is beyond a limit [rad]; negative within the range."""
    on_1, on_2, sign = STOPS[stop]
    return sign * (legs.limits[stop] - on_1 * y[0] - on_2 * y[1])


def stopped(
    legs: Legs, form: Form, y: Floats, a: tuple[Floats, Floats], acts: Bools | None, touched: Bools
) -> tuple[Floats, tuple[Floats, Floats]]:
    """What each stop adds by its law (4, ...), and accelerations with the stops [rad/s^2].

    A touched stop pushes where `acts` says so (4, n); without `acts` where it need not pull. By the
    law of the simulation the joint turns back at `(1 - d) a + d (b dp/dt + k p)` with
    `b = 2 / (d T)` and `k = 1 / (d T^2)`. Stops act one after the other.
    """
    added = np.zeros((len(STOPS), *y.shape[1:]))
    first, second = a[0].copy(), a[1].copy()
    for stop, (on_1, on_2, sign) in enumerate(STOPS):
        columns = np.flatnonzero(touched[stop])
        if not columns.size:
            continue
        part, z = Form(*(entry[columns] for entry in form)), y[..., columns]
        beyond = sign * (legs.limits[stop, columns] - on_1 * z[0] - on_2 * z[1])
        speed = -sign * (on_1 * z[2] + on_2 * z[3])
        own = sign * (on_1 * first[..., columns] + on_2 * second[..., columns])
        more = (2.0 * speed + beyond / STOP_TIME) / STOP_TIME - STOP_SHARE * own
        added[stop][..., columns] = more
        unit = part.solve(z, sign * on_1, sign * on_2)
        pushes = more > 0.0 if acts is None else acts[stop, columns]
        force = np.where(pushes, more / (sign * (on_1 * unit[0] + on_2 * unit[1])), 0.0)
        first[..., columns] += unit[0] * force
        second[..., columns] += unit[1] * force
    return added, (first, second)


def rise(along: Floats, y: Floats, a: tuple[Floats, Floats]) -> Floats:
    """Upward acceleration of `along_1 dir(q1) + along_2 dir(q2)` [m/s^2]."""
    first = np.sin(y[0]) * a[0] + np.cos(y[0]) * y[2] * y[2]
    second = np.sin(y[1]) * a[1] + np.cos(y[1]) * y[3] * y[3]
    return along[0] * first + along[1] * second


def foot(legs: Legs, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Foot seen from the centre of mass: height [m], and its velocity forward and up [m/s]."""
    b1, b2 = legs.arm()
    forward = b1 * np.cos(y[0]) * y[2] + b2 * np.cos(y[1]) * y[3]
    up = b1 * np.sin(y[0]) * y[2] + b2 * np.sin(y[1]) * y[3]
    return -b1 * np.cos(y[0]) - b2 * np.cos(y[1]), forward, up


def landed(legs: Legs, y: Floats, centre_vel: Floats) -> Floats:
    """Rates (2, n) after the foot has stopped, by eq. (12) on `[x_t, z_t, q1, q2]` [rad/s]."""
    (c1, c2), (s1, s2), one = np.cos(y[:2]), np.sin(y[:2]), np.ones_like(legs.mass)
    f1, f2 = legs.moment
    mixed, none = legs.cross * np.cos(y[0] - y[1]), np.zeros_like(legs.mass)
    inertia = np.array(
        [
            [legs.mass, none, f1 * c1, f2 * c2],
            [none, legs.mass, f1 * s1, f2 * s2],
            [f1 * c1, f1 * s1, legs.own[0], mixed],
            [f2 * c2, f2 * s2, mixed, legs.own[1]],
        ]
    ).transpose(2, 0, 1)
    jacobian = np.array(
        [
            [one, none, legs.reach * c1, legs.reach * c2],
            [none, one, legs.reach * s1, legs.reach * s2],
        ]
    ).transpose(2, 0, 1)
    inner = np.array([f1 * c1 * y[2] + f2 * c2 * y[3], f1 * s1 * y[2] + f2 * s2 * y[3]])
    before = np.concatenate([centre_vel - inner / legs.mass, y[2:]]).T[:, :, np.newaxis]
    shared = np.linalg.solve(inertia, jacobian.swapaxes(1, 2))
    impulse = np.linalg.solve(jacobian @ shared, jacobian @ before)
    return (before - shared @ impulse)[:, 2:, 0].T
