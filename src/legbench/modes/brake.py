"""Brake orbits: oscillations that stop at both ends, the nonlinear modes of an undamped leg.

A brake orbit starts at rest at q and is at rest again half a period later; by time reversal it
then goes back the way it came. Shooting solves `v(T/2; q) = 0` for (q1, q2, T/2): two equations,
three unknowns, so the solutions form curves, one out of each linear mode.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from legbench.errors import ConfigError
from legbench.modes.carry import Carrier
from legbench.modes.continuation import CurvePoint, correct
from legbench.modes.monodromy import Monodromy, monodromy
from legbench.modes.roots import bracketed
from legbench.modes.scene import Scene
from legbench.signals import Floats

RESIDUAL = 1e-10
"""Largest speed left at the far end of a closed orbit [rad/s]."""
NEARLY = 1e-4
"""Largest speed left at the far end of an orbit next to a branch point [rad/s]: a leg that is
matched to nine digits has no straight orbit there, but one that is straight to four."""
SOFT = 0.01
"""Share of the largest singular value below which a direction is not corrected there [-]."""
SAMPLES = 65
"""Number of postures of half an orbit at which bend and joint limits are evaluated [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BrakeOrbit:
    """One oscillation of a mode, which stops at both ends."""

    start: Floats
    """Posture at one end (2,) [rad]."""
    end: Floats
    """Posture at the other end (2,) [rad]."""
    period: float
    """Duration until the leg is back at its start [s]."""
    energy: float
    """Energy above rest [J]."""
    bend: float
    """Largest |z1| on the way for the radial mode, of z2's excursion from rest for the polar
    one [rad]: distance from the straight line that the mode would be."""
    monodromy: Monodromy
    """Derivative of the flow over one period, which moves neighbouring orbits."""
    outside: str
    """Joint that is beyond its limit somewhere on the way, and where; empty if none is."""


@final
class BrakeShooting:
    """The equations of the brake orbits of one leg, scaled.

    Unknowns are (q1, q2, half the period over `unit`) [rad, rad, -].

    Args:
        scene: the leg, how it is held, and where it rests.
        name: mode that the orbits are taken to belong to, for their bend.
        unit: half a period of the linear mode [s].
    """

    def __init__(self, scene: Scene, name: str, unit: float) -> None:
        self.scene, self.carrier = scene, Carrier(scene)
        self.name, self.unit = name, unit

    def equations(self, unknown: Floats) -> tuple[Floats, Floats]:
        """Speed (2,) half a period after rest, and its derivative by the unknowns (2, 3)."""
        done = self.carrier.carry(self.state(unknown), float(unknown[2]) * self.unit)
        slope = np.column_stack([done.by_start[2:, :2], done.rate[2:] * self.unit])
        return done.end[2:], slope

    def state(self, unknown: Floats) -> Floats:
        """State at rest (4,) where the orbit of some unknowns begins."""
        return np.concatenate([unknown[:2], [0.0, 0.0]])

    def correct(self, guess: Floats, row: Floats) -> CurvePoint | None:
        """The orbit near `guess` (3,) with the same component along `row` (3,), if there is one."""
        return correct(self.equations, guess, row, float(row @ guess), RESIDUAL)

    def energy(self, unknown: Floats) -> float:
        """Energy above rest [J]."""
        return float(self.scene.potential(unknown[:2]))

    def orbit(self, unknown: Floats) -> BrakeOrbit:
        """The orbit of solved unknowns (3,)."""
        start, half = self.state(unknown), float(unknown[2]) * self.unit
        path = self.carrier.path(start, np.linspace(0.0, half, SAMPLES))[:, :2]
        rest = np.asarray(self.scene.rest)
        off = path.sum(axis=-1) if self.name == "radial" else np.diff(path - rest, axis=-1)
        return BrakeOrbit(
            start=unknown[:2].copy(),
            end=path[-1].copy(),
            period=2.0 * half,
            energy=self.energy(unknown),
            bend=float(np.max(np.abs(off)) / np.sqrt(2.0)),
            monodromy=monodromy(self.carrier, start, 2.0 * half),
            outside=beyond_limits(self.scene, path),
        )

    def unknown_of(self, orbit: BrakeOrbit) -> Floats:
        """Unknowns (3,) of an orbit."""
        return np.array([*orbit.start, 0.5 * orbit.period / self.unit])

    def between(self, first: Floats, last: Floats, share: float) -> Floats:
        """Unknowns (3,) of the orbit that lies at a share of the way from one to another.

        Raises:
            ConfigError: there is none.
        """
        guess = first + share * (last - first)
        solved = self.correct(guess, _unit(last - first))
        if solved is None:
            raise ConfigError(
                f"the {self.name} mode is lost near {self.energy(guess):.4g} J: no orbit between "
                "two that were found"
            )
        return solved.unknown

    def nearly(self, first: Floats, last: Floats, share: float) -> Floats:
        """Unknowns (3,) as of `between`, but closed to `NEARLY` only, where a branch point is near.

        Raises:
            ConfigError: there are none.
        """
        guess, row = first + share * (last - first), _unit(last - first)
        value = float(row @ guess)
        solved = correct(self.equations, guess, row, value, NEARLY, stiff=SOFT)
        if solved is None:
            raise ConfigError(f"the {self.name} mode is lost near {self.energy(guess):.4g} J")
        return solved.unknown

    def with_energy(self, first: Floats, last: Floats, energy: float) -> BrakeOrbit:
        """The orbit of an energy [J] that lies between those of two unknowns (3,)."""
        share = bracketed(
            lambda share: self.energy(self.between(first, last, share)) - energy, 0.0, 1.0, 1e-13
        )
        return self.orbit(self.between(first, last, share))


def _unit(vector: Floats) -> Floats:
    return vector / np.linalg.norm(vector)


def beyond_limits(scene: Scene, path: Floats) -> str:
    """Joint that a path of postures (n, 2) takes furthest beyond its limit; empty if none."""
    limits = scene.design.limits
    worst, said = 0.0, ""
    for joint, angle, (low, high) in (
        ("knee", path[:, 1] - path[:, 0], limits.knee),
        ("hip", path[:, 0], limits.hip),
    ):
        for over, limit in ((low - np.min(angle), low), (np.max(angle) - high, high)):
            if over > worst:
                worst, said = float(over), f"the {joint} reaches its limit of {limit:g} rad"
    return said
