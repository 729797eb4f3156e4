"""Modes of the damped leg, each kept periodic by an excitation proportional to speed.

A mode of an undamped leg is periodic. In a damped leg its amplitude decreases, and frequency and
damping change with it. Each amplitude is computed by itself: a negative damper, the same at both
joints, returns the energy that the leg's own dampers take, and the motion is periodic (`periodic`).
"""

from dataclasses import dataclass

import numpy as np

from legbench.errors import ConfigError
from legbench.modes.carry import Carrier
from legbench.modes.continuation import LOST, MANY
from legbench.modes.periodic import PeriodicOrbit, Shooting, orbits_along
from legbench.modes.scene import Scene
from legbench.modes.seed import first_unknown
from legbench.signals import Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class DampedFamily:
    """A damped mode by growing amplitude."""

    name: str
    """`radial` or `polar`."""
    damping: tuple[float, float]
    """Viscous damping of both joints [N m s/rad]."""
    orbits: tuple[PeriodicOrbit, ...]
    ended: str
    """Reason why there are no more, in words."""


def follow_damped(
    scene: Scene, name: str, energy: float, damping: tuple[float, float], *, most: int = 60
) -> DampedFamily:
    """Follow a mode of the damped leg up to an energy above rest [J].

    Args:
        scene: the leg, how it is held, and where it rests.
        name: `radial` or `polar`.
        energy: up to which it is followed [J].
        damping: of both joints [N m s/rad].
        most: largest number of orbits.

    Raises:
        ConfigError: an energy that is not positive, damping that is negative, or so much of it
            that the leg does not oscillate.
    """
    if not energy > 0.0:
        raise ConfigError(f"energy is {energy:g} J; it must be positive")
    if not all(0.0 <= value < float("inf") for value in damping):
        raise ConfigError(f"damping is {damping} N m s/rad; it must be zero or more, and finite")
    shooting, unknown, along = _begin(scene, name, damping)
    solved = shooting.correct(unknown, along)
    if solved is None:
        raise ConfigError(
            f"the {name} mode of the damped leg is not found: damping {damping} N m s/rad is too "
            "much for an oscillation, or too unequal for a mode"
        )
    orbits, ended = orbits_along(shooting, solved.towards(along), most, energy)
    lost = f"the family ends at {orbits[-1].energy:.4g} J: no orbit continues it"
    said = {LOST: lost, MANY: f"{most} orbits"}
    return DampedFamily(
        name=name, damping=damping, orbits=tuple(orbits), ended=said.get(ended, ended)
    )


def _begin(
    scene: Scene, name: str, damping: tuple[float, float]
) -> tuple[Shooting, Floats, Floats]:
    """Shooting, the small orbit of the undamped leg as a guess (6,), and the way outwards (6,)."""
    brake, unknown, _ = first_unknown(scene, name)
    period = 2.0 * float(unknown[2]) * brake.unit
    times = np.linspace(0.0, 0.25 * period, 9)
    path = brake.carrier.path(brake.state(unknown), times)
    # The share of each damper by what it takes on the way from one end to the middle.
    taken = np.sum(path[:, 2:] ** 2, axis=0)
    drive = -float(taken @ np.array(damping) / np.sum(taken))
    shooting = Shooting(Carrier(scene, damping), period, path[-1])
    guess = shooting.unknown_of(path[-1], period, drive)
    along = guess - shooting.unknown_of(np.array([*scene.rest, 0.0, 0.0]), period, drive)
    return shooting, guess, along / np.linalg.norm(along)
