"""The leg with its foot pinned and its trunk on a boom, in two angles and without approximation.

The boom, as long as `R`, turns about a fixed pivot at height `h` beside the leg: by the yaw angle
psi about the vertical, then by the roll angle phi about its forward axis. The trunk is fixed to its
end, so the leg's plane turns with it. In axes of the boom (forward, along the boom, up) a point of
the leg lies at `p = (x, R, z)`, with `x` and `z` as in the plane. The pin holds the foot tip at
x = z = 0 and lets it slide sideways, which gives the boom's angles by the posture:

    tan psi = x / w,   sin phi = -(h R + z w) / D,   cos phi = (R w - h z) / D
    D = R^2 + z^2,     w^2 = D - h^2

Kane's equations for (psi, phi, q1, q2), with the two conditions of the pin on their rates and
accelerations, leave two equations of the angles; the pin's force is what the conditions take.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from legbench.analytic.equations import Pair
from legbench.analytic.terms import Body
from legbench.design.rig import AXIAL_SHARE, PIN_MASS, TRUNK_COM_HEIGHT, TRUNK_INERTIA
from legbench.signals import Floats

FORWARD = np.array([1.0, 0.0, 0.0])
ALONG = np.array([0.0, 1.0, 0.0])
"""Axis along the boom; the joints turn the other way about it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BoomMotion:
    """Equations of one instant: `inertia a + load = torque`, and what gives the pin's force."""

    inertia: Floats
    """Inertia of q1 and q2 (2, 2) [kg m^2]."""
    load: Floats
    """Torques that motion, gravity and guide take of q1 and q2 (2,) [N m]."""
    trunk_rates: Floats
    """Yaw and roll rate of the boom (2,) [rad/s]."""
    kinetic: float
    """Kinetic energy [J]."""
    follow: Floats
    """Accelerations of (psi, phi, q1, q2) by those of the angles (4, 2) [-]."""
    drift: Floats
    """Their accelerations where those of the angles are zero (4,) [rad/s^2]."""
    whole: Floats
    """Inertia of (psi, phi, q1, q2) (4, 4) [kg m^2]."""
    needed: Floats
    """Forces on these that motion, gravity and guide need (4,) [N m]."""
    unpinned: Floats
    """Yaw and roll rate by the velocity of the foot tip, forward and up (2, 2) [1/m]."""

    def solve(self, torque: Pair) -> Pair:
        """Accelerations that torques on q1 and q2 give, without any load [rad/s^2]."""
        first, second = (_inverse(self.inertia) @ torque).tolist()
        return first, second

    def acceleration(self, torque: Pair) -> Pair:
        """Accelerations of q1 and q2 under torques on them [rad/s^2]."""
        return self.solve((torque[0] - float(self.load[0]), torque[1] - float(self.load[1])))

    def force(self, a: Pair) -> Pair:
        """Force of the pin on the foot (forward, up) [N] while the angles accelerate by `a`."""
        missing = self.whole @ (self.follow @ np.asarray(a) + self.drift) + self.needed
        forward, up = (missing[:2] @ self.unpinned).tolist()
        return forward, up


@final
class Boom:
    """Boom of one leg, for plain floats.

    A point of the leg is `rho @ _basis(q)` in the boom's axes, where `rho` holds its distances from
    the hip along dir(q1) and dir(q2), one, and its height over the hip; so ten sums over the bodies
    give all that depends on their masses.
    """

    def __init__(
        self,
        bodies: tuple[Body, ...],
        trunk_mass: float,
        reach: float,
        *,
        radius: float,
        height: float,
        gravity: float,
        guide: Pair = (0.0, 0.0),
    ) -> None:
        """Collect the parts.

        Args:
            bodies: all of the leg.
            trunk_mass: mass of the trunk [kg].
            reach: distance of the foot tip along either direction [m].
            radius: length of the boom [m].
            height: height of its pivot over the ground [m].
            gravity: acceleration of gravity [m/s^2].
            guide: viscous damping of the boom's pivot, as at its end forward and upward [N s/m].
        """
        self._radius, self._height, self._gravity = radius, height, gravity
        self._reach = reach
        leg = [(*body.along, 1.0, 0.0) for body in bodies]
        rho = np.array([*leg, (0.0, 0.0, 1.0, TRUNK_COM_HEIGHT)])
        mass = np.array([*(body.mass for body in bodies), trunk_mass])
        self._first, self._second = mass @ rho, rho.T @ (mass[:, np.newaxis] * rho)
        self._tip = np.array([reach, reach, 1.0, 0.0])
        self._across = np.sum([np.multiply(body.inertia, body.turns) for body in bodies], axis=0)
        # A force c v at the end of an arm R turns it back by c R^2 omega.
        self._guide = np.array(guide) * radius**2

    def turn(self, q: Pair) -> Floats:
        """Axes of the boom in the world (3, 3), one a column, for a posture."""
        x, z = self._reach * np.sin(q).sum(), -self._reach * np.cos(q).sum()
        radius, height = self._radius, self._height
        square = radius**2 + z**2
        out = np.sqrt(square - height**2)
        sin_roll = -(height * radius + z * out) / square
        cos_roll = (radius * out - height * z) / square
        sin_yaw, cos_yaw = x / np.hypot(x, out), out / np.hypot(x, out)
        return np.array(
            [
                [cos_yaw, -sin_yaw * cos_roll, sin_yaw * sin_roll],
                [sin_yaw, cos_yaw * cos_roll, -cos_yaw * sin_roll],
                [0.0, sin_roll, cos_roll],
            ]
        )

    def hip(self, q: Pair) -> Pair:
        """Position of the hip over the pinned foot (forward, up) [m]."""
        axes = self.turn(q)
        return float(self._radius * axes[0, 1]), float(self._height + self._radius * axes[2, 1])

    def hip_vel(self, q: Pair, v: Pair) -> Pair:
        """Velocity of the hip (forward, up) [m/s]: that of the boom's end."""
        axes, (yaw, roll) = self.turn(q), self.motion(q, v).trunk_rates
        moved = axes @ (self._radius * np.array([-yaw * axes[2, 2], 0.0, roll]))
        return float(moved[0]), float(moved[2])

    def energy(self, q: Pair, v: Pair) -> Pair:
        """Potential energy over the ground and kinetic energy [J]."""
        raised = self._first @ self._basis(q) @ self.turn(q)[2] + self._first[2] * self._height
        return float(self._gravity * raised), self.motion(q, v).kinetic

    def motion(self, q: Pair, v: Pair) -> BoomMotion:
        """Equations of motion in a posture at rates `v` of q1 and q2."""
        axes, basis, rates = self.turn(q), self._basis(q), np.asarray(v)
        vertical, swept = axes[2], _swept(q)
        # Velocities of the basis by the four rates (4, 4, 3), and those of the tip in the world, of
        # which the pin holds those forward and up.
        moves = np.zeros((4, 4, 3))
        moves[0], moves[1] = basis @ _crossed_by(vertical), basis @ _crossed_by(FORWARD)
        moves[2, 0], moves[3, 1] = swept
        tip = axes @ (self._tip @ moves).T
        held = tip[::2]
        unpinned = _inverse(held[:, :2])
        follow = np.zeros((4, 2))
        follow[:2], follow[2, 0], follow[3, 1] = -unpinned @ held[:, 2:], 1.0, 1.0
        all_rates = follow @ rates
        # Accelerations while no rate changes, in axes that turn themselves.
        omega = all_rates[0] * vertical + all_rates[1] * FORWARD
        tilting = all_rates[0] * all_rates[1] * (FORWARD @ _crossed_by(vertical))
        turning = _crossed_by(omega)
        kept = basis @ (_crossed_by(tilting) + turning @ turning)
        pace = rates[:, np.newaxis]
        kept[:2] += pace * (2.0 * swept @ turning - pace * basis[:2])
        tip_kept = axes @ (self._tip @ kept)
        kept[2] += self._gravity * vertical
        weighted = (self._second @ moves).reshape(4, 12)
        turned, twisted = self._turned(basis, swept, vertical, all_rates, tilting)
        sideways = tip[1]
        whole = weighted @ moves.reshape(4, 12).T + turned
        whole += PIN_MASS * sideways * sideways[:, np.newaxis]
        needed = weighted @ kept.ravel() + twisted + PIN_MASS * tip_kept[1] * sideways
        needed[:2] += self._guide * all_rates[:2]
        drift = np.zeros(4)
        drift[:2] = -unpinned @ tip_kept[::2]
        return BoomMotion(
            inertia=follow.T @ whole @ follow,
            load=follow.T @ (needed + whole @ drift),
            trunk_rates=all_rates[:2],
            kinetic=float(0.5 * all_rates @ whole @ all_rates),
            follow=follow,
            drift=drift,
            whole=whole,
            needed=needed,
            unpinned=unpinned,
        )

    def _basis(self, q: Pair) -> Floats:
        """Vectors whose sums are the points of the leg (4, 3), in the boom's axes."""
        (sin_1, sin_2), (cos_1, cos_2) = np.sin(q), np.cos(q)
        return np.array(
            [
                [sin_1, 0.0, -cos_1],
                [sin_2, 0.0, -cos_2],
                [0.0, self._radius, 0.0],
                [0.0, 0.0, 1.0],
            ]
        )

    def _turned(
        self, basis: Floats, swept: Floats, vertical: Floats, rates: Floats, tilting: Floats
    ) -> tuple[Floats, Floats]:
        """Part of turning in the inertia (4, 4) and in what the four rates need (4,).

        What turns is three: all that turns with q1, all that turns with q2, and the trunk.
        """
        parts = np.zeros((3, 4, 3))
        parts[:, 0], parts[:, 1] = vertical, FORWARD
        parts[0, 2] = parts[1, 3] = -ALONG
        across, lengthwise = (
            swept[:, :, np.newaxis] * swept[:, np.newaxis],
            basis[:2, :, np.newaxis],
        )
        shape = np.outer(ALONG, ALONG) + across
        shape += AXIAL_SHARE * lengthwise * basis[:2, np.newaxis]
        inertias = np.empty((3, 3, 3))
        inertias[:2] = self._across[:, np.newaxis, np.newaxis] * shape
        inertias[2] = np.diag(TRUNK_INERTIA)
        spins = rates @ parts
        omega = spins[2]
        whole, needed = np.zeros((4, 4)), np.zeros(4)
        for part, inertia, spin in zip(parts, inertias, spins, strict=True):
            whole += part @ inertia @ part.T
            change = inertia @ (tilting + spin @ _crossed_by(omega))
            needed += part @ (change + (inertia @ spin) @ _crossed_by(spin))
        return whole, needed


def _swept(q: Pair) -> Floats:
    """Derivatives of dir(q1) and dir(q2) by the angles, in the boom's axes (2, 3)."""
    (sin_1, sin_2), (cos_1, cos_2) = np.sin(q), np.cos(q)
    return np.array([[cos_1, 0.0, sin_1], [cos_2, 0.0, sin_2]])


def _crossed_by(vector: Floats) -> Floats:
    """Matrix (3, 3) that turns a row `p` into `vector x p`."""
    x, y, z = vector
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])


def _inverse(matrix: Floats) -> Floats:
    """Inverse of a matrix (2, 2); NumPy's takes four times as long."""
    (a, b), (c, d) = matrix.tolist()
    return np.array([[d, -b], [-c, a]]) / (a * d - b * c)
