"""Motion of the neighbours of a periodic orbit over one period.

In a conservative leg two of the four Floquet multipliers are one: along the orbit, and towards
orbits of another energy. As a double eigenvalue they are known to half of the digits only. They
are taken out exactly, by their eigenvectors, and what is left is the pair that says whether the
orbit is stable.
"""

from dataclasses import dataclass

import numpy as np

from legbench.modes.carry import Carrier
from legbench.signals import Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Monodromy:
    """Derivative of the flow over one period of an orbit."""

    matrix: Floats
    """(4, 4), of (q1, q2, v1, v2)."""
    pair: tuple[complex, complex]
    """The two multipliers besides those that are one, the larger first [-]."""
    trace: float
    """Sum of the pair [-]: 2 where it is +1 twice, -2 where it is -1 twice."""
    determinant: float
    """Product of all four multipliers [-]; one in a conservative leg, the rest is error."""

    @property
    def multipliers(self) -> tuple[complex, ...]:
        """All four, the pair first [-]."""
        return (*self.pair, 1.0 + 0.0j, 1.0 + 0.0j)

    @property
    def stable(self) -> bool:
        """Whether neighbours of the same energy stay near, to first order."""
        return abs(self.trace) <= 2.0


def monodromy(carrier: Carrier, start: Floats, period: float) -> Monodromy:
    """The monodromy matrix of the orbit through a state (4,) of an undamped leg.

    The flow maps directions of the same energy to such, and the direction of motion to itself; on
    what is left of the first without the second it is a matrix of two by two.
    """
    matrix = carrier.carry(start, period).by_start
    pair, trace = transverse(matrix, carrier.rates(start), energy_slope(carrier, start))
    return Monodromy(
        matrix=matrix, pair=pair, trace=trace, determinant=float(np.linalg.det(matrix))
    )


def energy_slope(carrier: Carrier, state: Floats) -> Floats:
    """Derivative of the energy by a state (4,)."""
    scene, q, v = carrier.scene, state[:2], state[2:]
    swirl = scene.terms.coupling * np.sin(q[0] - q[1]) * v[0] * v[1]
    return np.concatenate([np.array([-swirl, swirl]) - scene.force(q), scene.mass(q) @ v])


def transverse(
    matrix: Floats, moving: Floats, energy: Floats
) -> tuple[tuple[complex, complex], float]:
    """The pair of multipliers beside the double one, and their sum.

    Args:
        matrix: monodromy matrix (4, 4).
        moving: its eigenvector of the eigenvalue one, the direction of motion (4,).
        energy: the left eigenvector, the derivative of the energy (4,).
    """
    known = np.stack([moving / np.linalg.norm(moving), energy / np.linalg.norm(energy)])
    basis = np.linalg.svd(known)[2][2:]
    reduced = basis @ matrix @ basis.T
    values = np.linalg.eigvals(reduced)
    first, second = values[np.argsort(-np.abs(values))].tolist()
    return (complex(first), complex(second)), float(np.trace(reduced))
