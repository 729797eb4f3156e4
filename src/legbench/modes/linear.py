"""Small oscillations around an equilibrium."""

from dataclasses import dataclass

import numpy as np

from legbench.modes.scene import Scene
from legbench.signals import Floats

RADIAL = np.array([-1.0, 1.0]) / np.sqrt(2.0)
"""Unit vector of z2 in joint space."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearMode:
    """One of the two."""

    name: str
    """`radial` for the one nearer to z2, `polar` for the other."""
    freq: float
    """[Hz]"""
    shape: Floats
    """Unit vector in joint space (2,)."""
    alignment: float
    """|cosine| of the angle between the shape and its modal axis; 1 when the leg is matched."""


def linear_modes(scene: Scene) -> dict[str, LinearMode]:
    """Solve `K w = omega^2 M w` at rest; keys `radial` and `polar`."""
    rest = np.asarray(scene.rest)
    # In coordinates in which the inertia is one, the stiffness is symmetric still.
    unit = np.linalg.inv(np.linalg.cholesky(scene.mass(rest)))
    values, vectors = np.linalg.eigh(unit @ scene.stiffness(rest) @ unit.T)
    vectors = unit.T @ vectors
    shapes = (vectors / np.linalg.norm(vectors, axis=0)).T
    radial = int(np.argmax(np.abs(shapes @ RADIAL)))
    modes = {}
    for name, index in (("radial", radial), ("polar", 1 - radial)):
        axis = RADIAL if name == "radial" else np.abs(RADIAL)
        shape = shapes[index] * np.sign(shapes[index] @ axis)
        modes[name] = LinearMode(
            name=name,
            freq=float(np.sqrt(values[index]) / (2.0 * np.pi)),
            shape=shape,
            alignment=float(abs(shape @ axis)),
        )
    return modes
