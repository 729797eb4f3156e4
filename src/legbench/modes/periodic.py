"""Periodic orbits of any shape, of an undamped or a damped leg.

Unknown are the state at one instant, the period, and a strength `extra` by which both dampers are
changed. Equations are `phi_T(x) - x = 0` and a phase condition: five, of six unknowns. In an
undamped leg energy is conserved, so no orbit needs `extra`, and it comes out as zero; with it the
equations are as regular as those of any other curve (Sepulchre and MacKay 1997; Munoz-Almaraz et
al. 2003). In a damped leg `-extra` is the drive, proportional to speed, that keeps a damped mode
going for ever: its period and decay follow by energy (the extended periodic motion of Krack 2015).
"""

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from legbench.analytic.parameters import DAMPING, MOTOR
from legbench.modes.brake import beyond_limits
from legbench.modes.carry import Carrier
from legbench.modes.continuation import Answer, CurvePoint, Refused, Stride, correct, trace
from legbench.modes.monodromy import Monodromy, monodromy
from legbench.signals import Floats

CLOSED = 1e-9
"""Largest distance between the two ends of a closed orbit, scaled [-]."""
SAMPLES = 129
"""Number of states of an orbit at which its shape and the joint limits are evaluated [-]."""
BRAKES = 1e-3
"""Smallest speed over the largest below which an orbit counts as a brake orbit [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PeriodicOrbit:
    """Periodic orbit of any shape."""

    start: Floats
    """q1, q2, v1, v2 at one instant (4,) [rad, rad/s]."""
    period: float
    """Duration until the leg is back in its state [s]."""
    energy: float
    """Largest energy above rest on the way [J]."""
    lost: float
    """Energy that the leg's own dampers take in a period [J]."""
    extra: float
    """Change of both dampers that keeps the orbit closed [N m s/rad]: error of an undamped leg,
    drive of a damped one."""
    radial: float
    """Half of the range of z2 [rad]."""
    polar: float
    """Half of the range of z1 [rad]."""
    slowest: float
    """Smallest speed on the way over the largest, by kinetic energy [-]."""
    monodromy: Monodromy
    """Derivative of the flow over a period; its pair and trace hold for an undamped leg only."""
    outside: str
    """Joint that is beyond its limit on the way, and where; empty if none is."""

    @property
    def brakes(self) -> bool:
        """Whether the orbit is a brake orbit, which stops and then returns on the same path."""
        return self.slowest < BRAKES

    @property
    def damping_ratio(self) -> float:
        """Share of critical damping that takes as much energy from a linear oscillation [-]."""
        return self.lost / (4.0 * np.pi * self.energy) if self.energy > 0.0 else float("nan")


@final
class Shooting:
    """The equations of the periodic orbits of one leg, scaled.

    Unknowns are (q1, q2, v1 s, v2 s, T / unit, extra / strength) with s the time in which a linear
    oscillation turns by a radian.

    Args:
        carrier: the leg, with its dampers.
        unit: a period of the linear mode [s].
        reference: state (4,) through whose phase the orbits start; the last one that was found.
    """

    def __init__(self, carrier: Carrier, unit: float, reference: Floats) -> None:
        self.carrier, self.unit = carrier, unit
        second = unit / (2.0 * np.pi)
        terms = carrier.scene.terms
        self.strength = float(np.sqrt(terms.inertia[0] * terms.inertia[1])) / second
        self.scale = np.array([1.0, 1.0, 1.0 / second, 1.0 / second, unit, self.strength])
        self.refer(reference)

    def refer(self, state: Floats) -> None:
        """Let the next orbits start at the phase of this state (4,)."""
        moving = self.carrier.rates(state) / self.scale[:4]
        self._reference, self._phase = state / self.scale[:4], moving / np.linalg.norm(moving)

    def unknown_of(self, start: Floats, period: float, extra: float = 0.0) -> Floats:
        """Unknowns (6,) of an orbit."""
        return np.array([*start, period, extra]) / self.scale

    def equations(self, unknown: Floats) -> tuple[Floats, Floats]:
        """Residual (5,) and its derivative (5, 6)."""
        raw = unknown * self.scale
        done = self.carrier.carry(raw[:4], float(raw[4]), extra=float(raw[5]))
        size = self.scale[:4]
        by_extra = done.by_parameters[:, DAMPING:MOTOR].sum(axis=-1)
        slope = np.zeros((5, 6))
        slope[:4, :4] = (done.by_start - np.eye(4)) * size / size[:, np.newaxis]
        slope[:4, 4] = done.rate * self.unit / size
        slope[:4, 5] = by_extra * self.strength / size
        slope[4, :4] = self._phase
        closed = (done.end - raw[:4]) / size
        return np.append(closed, self._phase @ (unknown[:4] - self._reference)), slope

    def correct(self, guess: Floats, row: Floats) -> CurvePoint | None:
        """The orbit near `guess` (6,) with the same component along `row` (6,), if there is one."""
        return correct(self.equations, guess, row, float(row @ guess), CLOSED)

    def orbit(self, unknown: Floats) -> PeriodicOrbit:
        """The orbit of solved unknowns (6,)."""
        raw = unknown * self.scale
        start, period, extra = raw[:4], float(raw[4]), float(raw[5])
        path = self.carrier.path(start, np.linspace(0.0, period, SAMPLES), extra=extra)
        q, v = path[:, :2], path[:, 2:]
        scene = self.carrier.scene
        kinetic = self._kinetic(path)
        z1, z2 = (q[:, 1] + q[:, 0]) / np.sqrt(2.0), (q[:, 1] - q[:, 0]) / np.sqrt(2.0)
        taken = (self.carrier.damping * v**2).sum(axis=-1)
        return PeriodicOrbit(
            start=start.copy(),
            period=period,
            energy=float(np.max(scene.potential(q) + kinetic)),
            # The trapezoidal rule on a whole period converges faster than any power.
            lost=float(np.mean(taken[:-1])) * period,
            extra=extra,
            radial=float(np.ptp(z2) / 2.0),
            polar=float(np.ptp(z1) / 2.0),
            slowest=self._slowest(start, period, extra, kinetic),
            monodromy=monodromy(self.carrier, start, period),
            outside=beyond_limits(scene, q),
        )

    def _kinetic(self, path: Floats) -> Floats:
        """Kinetic energy (n,) of states (n, 4) [J]."""
        q, v = path[:, :2], path[:, 2:]
        return 0.5 * np.einsum("ni,nij,nj->n", v, self.carrier.scene.mass(q), v)

    def _slowest(self, start: Floats, period: float, extra: float, kinetic: Floats) -> float:
        """Smallest speed over the largest, searched by parabolas through the kinetic energy."""
        largest, least = float(np.max(kinetic)), float(np.min(kinetic))
        step = period / (SAMPLES - 1)
        at = step * float(np.argmin(kinetic[:-1]))
        state = self.carrier.path(start, np.array([0.0, at or period]), extra=extra)[-1]
        for _ in range(3):
            # Around the slowest instant, a step back: the flow goes either way.
            ways = [
                self.carrier.path(state, np.array([0.0, sign * step]), extra=extra)
                for sign in (-1.0, 1.0)
            ]
            before, here, after = self._kinetic(np.stack([ways[0][1], state, ways[1][1]]))
            bend = before - 2.0 * here + after
            least = min(least, float(here))
            if not bend > 0.0:
                break
            move = 0.5 * step * float(before - after) / float(bend)
            move = float(np.clip(move, -step, step))
            if move == 0.0:
                break
            state = self.carrier.path(state, np.array([0.0, move]), extra=extra)[-1]
            least = min(least, float(self._kinetic(state[np.newaxis])[0]))
            step *= 0.2
        return float(np.sqrt(max(least, 0.0) / largest))


def orbits_along(
    shooting: Shooting, first: CurvePoint, most: int, energy: float = math.inf
) -> tuple[list[PeriodicOrbit], str]:
    """Follow closed orbits from a first one on; return them and why there are no more.

    Args:
        shooting: equations of the orbits; they refer to the last orbit afterwards.
        first: where the curve begins, with its tangent ahead.
        most: largest number of orbits, the first included.
        energy: energy above rest with which the curve ends [J].
    """
    orbits = [shooting.orbit(first.unknown)]

    def visit(found: CurvePoint) -> Answer:
        orbit = shooting.orbit(found.unknown)
        if orbit.outside:
            return Refused(f"{orbit.outside} beyond {orbits[-1].energy:.4g} J")
        orbits.append(orbit)
        shooting.refer(orbit.start)
        return "the energy asked for" if orbit.energy >= energy else None

    return orbits, trace(shooting.equations, first, Stride(first=0.03, most=most), CLOSED, visit)
