"""Nonlinear normal modes as brake orbits: oscillations that stop at both ends.

A brake orbit starts at rest at q and is at rest again half a period later; by time reversal it
then goes back the way it came. Shooting solves `v(T/2; q) = 0` for (q1, q2, T/2): two equations,
three unknowns, so the solutions form curves, one out of each linear mode. Pseudo-arclength
continuation follows such a curve through turning points, energy growing along it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from legbench.errors import ConfigError
from legbench.modes.flow import flow, orbit
from legbench.modes.linear import LinearMode, linear_modes
from legbench.modes.roots import bracketed
from legbench.modes.scene import Scene
from legbench.signals import Floats

FIRST = 0.01
"""Amplitude at which a family starts, where the linear mode is near enough [rad]."""
STEP = 0.05
"""First arc length between two orbits; [rad], half periods count in units of the linear one."""
RESIDUAL = 1e-9
"""Speed left at the far end of a closed orbit [rad/s]."""
NEWTON = 12
"""Iterations until a step is given up and halved."""
SHORTEST = 1e-4
"""Arc length below which a family has ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BrakeOrbit:
    """One oscillation of a mode."""

    start: Floats
    """Posture at one end (2,) [rad]."""
    end: Floats
    """Posture at the other end (2,) [rad]."""
    period: float
    """[s]"""
    energy: float
    """Energy above rest [J]."""
    bend: float
    """Largest |z1| on the way for the radial mode, of z2's excursion from rest for the polar
    one [rad]: distance from the straight line that the mode would be."""
    multipliers: tuple[complex, ...] = ()
    """Floquet multipliers; two are one, the other two off the unit circle when unstable."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """A mode's orbits by growing amplitude: backbone and generator curve."""

    mode: LinearMode
    orbits: tuple[BrakeOrbit, ...]
    ended: str
    """Why there are no more."""

    @property
    def largest(self) -> float:
        """Energy up to which the mode was followed [J]."""
        return max(orbit.energy for orbit in self.orbits)


def _residual(scene: Scene, unknown: Floats, unit: float) -> tuple[Floats, Floats, Floats]:
    """Speed and posture after half a period, and the speed's derivative by the unknowns."""
    start = np.concatenate([unknown[:2], [0.0, 0.0]])
    end, slope = flow(scene, start, unknown[2] * unit, np.eye(4)[:, :2])
    last = np.array([value.real for value in scene.rates(end.tolist())])[2:] * unit
    return end[2:], end[:2], np.column_stack([slope[2:], last])


def _correct(
    scene: Scene, guess: Floats, unit: float, row: Floats, value: float
) -> tuple[Floats, Floats] | None:
    """Newton's method on the orbit with `row . unknown = value`; unknowns and the far end."""
    unknown = guess.copy()
    for _ in range(NEWTON):
        speed, end, slope = _residual(scene, unknown, unit)
        wrong = np.concatenate([speed, [row @ unknown - value]])
        if np.max(np.abs(wrong)) < RESIDUAL:
            return unknown, end
        change = np.linalg.solve(np.vstack([slope, row]), wrong)
        if not np.all(np.isfinite(change)) or np.max(np.abs(change)) > 0.5:
            return None
        unknown = unknown - change
    return None


def _tangent(scene: Scene, unknown: Floats, unit: float, along: Floats) -> Floats:
    _, _, slope = _residual(scene, unknown, unit)
    tangent = np.linalg.svd(slope)[2][-1]
    return tangent * np.sign(tangent @ along)


def _describe(scene: Scene, unknown: Floats, end: Floats, unit: float, name: str) -> BrakeOrbit:
    path = orbit(scene, unknown[:2], unknown[2] * unit, 60)
    off = path.sum(axis=-1) if name == "radial" else np.diff(path - scene.rest, axis=-1)
    return BrakeOrbit(
        start=unknown[:2].copy(),
        end=end.copy(),
        period=2.0 * float(unknown[2]) * unit,
        energy=float(scene.potential(unknown[:2])),
        bend=float(np.max(np.abs(off)) / np.sqrt(2.0)),
    )


def follow(
    scene: Scene,
    name: str,
    energy: float,
    *,
    most: int = 60,
    progress: Callable[[int, int], None] | None = None,
) -> Family:
    """Continue the `radial` or `polar` mode from rest up to an energy [J], at most `most` orbits.

    Raises:
        ConfigError: an energy that is not positive, or a mode that is neither.
    """
    modes = linear_modes(scene)
    if name not in modes:
        raise ConfigError(f"mode '{name}' is unknown; there are {', '.join(modes)}")
    if not energy > 0.0:
        raise ConfigError(f"energy is {energy:g} J; it must be positive")
    mode = modes[name]
    unit = 0.5 / mode.freq
    along = np.concatenate([mode.shape, [0.0]])
    unknown = np.concatenate([scene.rest, [1.0]]) + FIRST * along
    solved = _correct(scene, unknown, unit, along, float(along @ unknown))
    if solved is None:
        raise ConfigError(f"the {name} mode does not exist at small amplitude: resonance")
    unknown, end = solved
    orbits = [_describe(scene, unknown, end, unit, name)]
    step, ended = STEP, f"{most} orbits"
    while len(orbits) < most:
        along = _tangent(scene, unknown, unit, along)
        solved = _correct(scene, unknown + step * along, unit, along, float(along @ unknown) + step)
        if solved is None:
            step *= 0.5
            if step < SHORTEST:
                ended = "the family ends: no orbit continues it"
                break
            continue
        unknown, end = solved
        found = _describe(scene, unknown, end, unit, name)
        if not (scene.inside(found.start) and scene.inside(found.end)):
            ended = "a joint reaches its limit"
            break
        orbits.append(found)
        step = min(1.3 * step, STEP)
        if progress is not None:
            progress(min(len(orbits), most - 1), most)
        if found.energy >= energy:
            ended = "the energy asked for"
            break
    return Family(mode=mode, orbits=tuple(orbits), ended=ended)


def at_energy(scene: Scene, family: Family, energy: float) -> BrakeOrbit:
    """The orbit of a family that has just this energy [J].

    Raises:
        ConfigError: the mode does not exist at that energy; the message says up to which it does.
    """
    name, unit = family.mode.name, 0.5 / family.mode.freq
    for before, after in zip(family.orbits, family.orbits[1:], strict=False):
        if before.energy <= energy <= after.energy:
            first, last = (
                np.array([*found.start, 0.5 * found.period / unit]) for found in (before, after)
            )
            row = last - first

            def corrected(
                share: float, first: Floats = first, row: Floats = row
            ) -> tuple[Floats, Floats]:
                guess = first + share * row
                solved = _correct(scene, guess, unit, row, float(row @ guess))
                if solved is None:
                    raise ConfigError(f"the {name} mode is lost near {energy:.4g} J")
                return solved

            share = bracketed(
                lambda s: float(scene.potential(corrected(s)[0][:2])) - energy, 0.0, 1.0, 1e-13
            )
            unknown, end = corrected(float(share))
            return _describe(scene, unknown, end, unit, name)
    raise ConfigError(
        f"the {name} mode does not exist at {energy:.4g} J: it was followed from "
        f"{family.orbits[0].energy:.2g} to {family.largest:.4g} J, where {family.ended}"
    )


def floquet(scene: Scene, found: BrakeOrbit) -> tuple[complex, ...]:
    """Floquet multipliers of an orbit: eigenvalues of the flow's derivative over a period."""
    start = np.concatenate([found.start, [0.0, 0.0]])
    _, monodromy = flow(scene, start, found.period, np.eye(4))
    values = np.linalg.eigvals(monodromy)
    return tuple(complex(value) for value in values[np.argsort(-np.abs(values))])
