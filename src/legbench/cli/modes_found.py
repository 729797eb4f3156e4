"""Results of `legbench modes`: the families and curves that were asked for."""

from collections.abc import Callable
from dataclasses import dataclass

from legbench.cli.output import note
from legbench.errors import ConfigError
from legbench.modes.brake import BrakeOrbit
from legbench.modes.branches import Branch, branches
from legbench.modes.carry import Carrier
from legbench.modes.damped import DampedFamily, follow_damped
from legbench.modes.family import Family, at_energy, follow
from legbench.modes.linear import LinearMode
from legbench.modes.response import ResponseCurve, respond
from legbench.modes.ridden import RiddenCurve, ride
from legbench.modes.scene import Scene
from legbench.modes.strict import Strictness
from legbench.modes.trajectory import OrbitPath, branch_paths, damped_paths, family_paths

FIRST_RIDE = 1.3
"""Amplitude of the motors at which bang-bang is started, over the least at which it can switch."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModesFound:
    """Modes of one leg."""

    scene: Scene
    linear: dict[str, LinearMode]
    strict: Strictness
    reach: float
    """Range of z2 either way over which strictness was checked [rad]."""
    families: tuple[Family, ...]
    shown: dict[str, BrakeOrbit]
    """Mode -> the orbit that is shown in full."""
    branches: dict[str, tuple[Branch, ...]]
    """Mode -> its branches; empty where none were asked for."""
    damped: tuple[DampedFamily, ...]
    curves: tuple[ResponseCurve, ...]
    ridden: RiddenCurve | None

    def paths(self) -> list[OrbitPath]:
        """All orbits as trajectories."""
        found: list[OrbitPath] = []
        for family in self.families:
            found += family_paths(family)
            found += branch_paths(family, self.branches[family.mode.name])
        for family in self.damped:
            found += damped_paths(family, Carrier(self.scene, family.damping))
        return found


def families_of(
    scene: Scene,
    names: tuple[str, ...],
    energy: float,
    at: float | None,
    *,
    branched: bool,
    progress: Callable[[int, int], None],
) -> tuple[tuple[Family, ...], dict[str, BrakeOrbit], dict[str, tuple[Branch, ...]]]:
    """The families of modes up to an energy [J], the orbit of each that is shown, its branches.

    A mode that has no orbit of the energy `at` is told; the others are shown.

    Raises:
        ConfigError: no mode has such an orbit.
    """
    families = tuple(
        follow(scene, name, max(energy, at or 0.0), progress=progress) for name in names
    )
    shown: dict[str, BrakeOrbit] = {}
    refused: list[str] = []
    for family in families:
        try:
            shown[family.mode.name] = family.orbits[-1] if at is None else at_energy(family, at)
        except ConfigError as error:
            refused.append(str(error))
    if not shown:
        raise ConfigError("; ".join(refused))
    for words in refused:
        note(words)
    found = {family.mode.name: branches(family) if branched else () for family in families}
    return families, shown, found


def damped_of(scene: Scene, names: tuple[str, ...], energy: float) -> tuple[DampedFamily, ...]:
    """The damped modes, with the dampers of the design."""
    return tuple(follow_damped(scene, name, energy, scene.design.damping) for name in names)


def responses_of(
    scene: Scene, amplitudes: tuple[float, ...], largest: float | None, threshold: float
) -> tuple[tuple[ResponseCurve, ...], RiddenCurve | None]:
    """Response curves of some amplitudes, and bang-bang's cycles up to the largest [rad]."""
    damping = scene.design.damping
    curves = tuple(respond(scene, damping, dz2) for dz2 in amplitudes)
    if largest is None:
        return curves, None
    first = FIRST_RIDE * threshold / min(scene.model.stiffness)
    if first >= largest:
        raise ConfigError(
            f"bang-bang with a threshold of {threshold:g} N m needs motors of {first:.4g} rad or "
            f"more, and ride is {largest:g} rad; lower --threshold or raise --ride"
        )
    return curves, ride(scene, damping, threshold, first, largest)
