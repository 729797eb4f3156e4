"""Families of nonlinear modes: a mode's orbits by growing energy, and where stability changes.

Pseudo-arclength continuation follows the brake orbits from a linear mode on. The trace of the pair
of multipliers decides their stability: above 2 the pair is real and positive, below -2 real and
negative, and neighbours leave the orbit. Where it passes `2 cos(2 pi p / q)` an
oscillation across the mode takes q periods for p turns: an internal resonance.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from legbench.errors import ConfigError
from legbench.modes.brake import RESIDUAL, BrakeOrbit, BrakeShooting
from legbench.modes.continuation import (
    LOST,
    MANY,
    Answer,
    CurvePoint,
    Refused,
    Stride,
    tangent_of,
    trace,
)
from legbench.modes.linear import LinearMode, linear_modes
from legbench.modes.roots import bracketed
from legbench.modes.scene import Scene
from legbench.modes.seed import APART, FIRST, first_unknown, gap
from legbench.signals import Floats

STEP = 0.03
"""Longest arc between two orbits [rad]; half periods count in units of the linear one."""
SMALLEST = 1e-5
"""Amplitude of the smallest orbit that is computed [rad]."""
DETERMINANT = 1e-8
"""Error of the product of multipliers beyond which a warning is given [-]."""
RATIOS = ((2, 1), (3, 1), (3, 2), (1, 2), (1, 3), (2, 3))
"""Ratios of linear frequencies, radial to polar, that are reported as internal resonances."""
NEAR = 0.02
"""Relative distance from such a ratio within which it is reported [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Passing:
    """An orbit at which the trace of the pair of multipliers passes `2 cos(2 pi p / q)`."""

    orbit: BrakeOrbit
    turns: int
    """Numerator p [-]."""
    periods: int
    """Denominator q [-]: 1 and 2 where stability changes, 3 and 4 for internal resonances."""
    stable_after: bool
    """Whether orbits of larger amplitude next to it are stable."""

    @property
    def changes(self) -> bool:
        """Whether stability changes here, by a multiplier of +1 (q = 1) or -1 (q = 2)."""
        return self.periods <= 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """Orbits of a mode by growing amplitude: its backbone and generator curve."""

    mode: LinearMode
    shooting: BrakeShooting
    orbits: tuple[BrakeOrbit, ...]
    passings: tuple[Passing, ...]
    """Orbits at which the trace passes a level, by growing amplitude."""
    ended: str
    """Reason why there are no more, in words."""
    warnings: tuple[str, ...]
    """Reasons to doubt the family: resonances, and errors of its multipliers."""

    @property
    def largest(self) -> float:
        """Energy up to which the mode was followed [J]."""
        return max(orbit.energy for orbit in self.orbits)


def follow(
    scene: Scene,
    name: str,
    energy: float,
    *,
    most: int = 200,
    progress: Callable[[int, int], None] | None = None,
) -> Family:
    """Continue the `radial` or `polar` mode from rest up to an energy [J], at most `most` orbits.

    Raises:
        ConfigError: an energy that is not positive, a mode that is neither, or a smallest orbit
            that does not exist or is beyond a joint limit.
    """
    modes = linear_modes(scene)
    if name not in modes:
        raise ConfigError(f"mode '{name}' is unknown; there are {', '.join(modes)}")
    if not energy > 0.0:
        raise ConfigError(f"energy is {energy:g} J; it must be positive")
    shooting, unknown, followed_from = first_unknown(scene, name)
    orbits = [_inside(shooting, unknown)]
    along = _outwards(scene, unknown)
    if followed_from is not None:
        smaller: list[BrakeOrbit] = []
        _grow(shooting, unknown, -along, Stride(first=0.02, longest=0.02), smaller, 0.0)
        orbits = smaller[::-1] + orbits
    ended = _grow(
        shooting,
        unknown,
        along,
        Stride(first=STEP, longest=STEP, most=most),
        orbits,
        energy,
        progress,
    )
    orbits = _refined(shooting, orbits)
    return Family(
        mode=modes[name],
        shooting=shooting,
        orbits=tuple(orbits),
        passings=tuple(_passings(shooting, orbits)),
        ended=ended,
        warnings=tuple(_warnings(modes, followed_from, orbits)),
    )


def _outwards(scene: Scene, unknown: Floats) -> Floats:
    away = unknown - np.array([*scene.rest, unknown[2]])
    return away / np.linalg.norm(away)


def _inside(shooting: BrakeShooting, unknown: Floats) -> BrakeOrbit:
    first = shooting.orbit(unknown)
    if first.outside:
        raise ConfigError(
            f"the {shooting.name} mode has no orbit here: at its smallest, {first.energy:.2g} J, "
            f"{first.outside}; choose a set point further from it"
        )
    return first


def _grow(
    shooting: BrakeShooting,
    unknown: Floats,
    along: Floats,
    stride: Stride,
    orbits: list[BrakeOrbit],
    energy: float,
    progress: Callable[[int, int], None] | None = None,
) -> str:
    """Append orbits beyond `unknown` on the side of `along`; return why there are no more.

    With an energy of zero the family is followed down to the amplitude `FIRST`.
    """

    def visit(found: CurvePoint) -> Answer:
        orbit = shooting.orbit(found.unknown)
        if orbit.outside:
            largest = max(one.energy for one in orbits)
            return Refused(f"{orbit.outside} beyond {largest:.4g} J")
        if energy == 0.0:
            rest = np.asarray(shooting.scene.rest)
            if np.linalg.norm(orbit.start - rest) < FIRST:
                return "small"
        orbits.append(orbit)
        if progress is not None:
            progress(min(len(orbits), stride.most - 1), stride.most)
        return "the energy asked for" if energy and orbit.energy >= energy else None

    slope = shooting.equations(unknown)[1]
    first = CurvePoint(unknown=unknown, slope=slope, tangent=tangent_of(slope, along))
    ended = trace(shooting.equations, first, stride, RESIDUAL, visit)
    if ended == MANY:
        return f"{stride.most} orbits"
    if ended == LOST:
        return f"the family ends at {orbits[-1].energy:.4g} J: no orbit continues it"
    return ended


def at_energy(family: Family, energy: float) -> BrakeOrbit:
    """The orbit of a family that has just this energy [J].

    An energy below that of the smallest orbit is reached by continuation from that orbit.

    Raises:
        ConfigError: the family has no orbit of that energy; the message says which it has.
    """
    shooting, orbits, name = family.shooting, family.orbits, family.mode.name
    for before, after in pairwise(orbits):
        if min(before.energy, after.energy) <= energy <= max(before.energy, after.energy):
            ends = shooting.unknown_of(before), shooting.unknown_of(after)
            return shooting.with_energy(*ends, energy)
    if energy < orbits[0].energy:
        return _small(family, energy)
    raise ConfigError(
        f"the {name} mode does not exist at {energy:.4g} J: it was followed from "
        f"{orbits[0].energy:.2g} to {family.largest:.4g} J, where it ended: {family.ended}"
    )


def _small(family: Family, energy: float) -> BrakeOrbit:
    """An orbit between rest and the first one of a family, scaled down from that."""
    shooting, first = family.shooting, family.orbits[0]
    rest = np.array([*shooting.scene.rest, 0.5 / family.mode.freq / shooting.unit])
    largest = shooting.unknown_of(first)
    smallest = rest + SMALLEST / np.linalg.norm(largest[:2] - rest[:2]) * (largest - rest)
    if energy < 1.01 * shooting.energy(smallest):
        raise ConfigError(
            f"{energy:.4g} J are an amplitude below {SMALLEST:g} rad, where the {family.mode.name} "
            f"mode is the linear one to all digits: {family.mode.freq:.6g} Hz; ask for "
            f"{1.01 * shooting.energy(smallest):.2g} J or more"
        )
    if gap(linear_modes(shooting.scene)) < APART:
        raise ConfigError(
            f"the {family.mode.name} mode cannot be followed below {first.energy:.3g} J: in the "
            "1:1 resonance orbits so small do not tell the modes apart"
        )
    return shooting.with_energy(smallest, largest, energy)


def _refined(shooting: BrakeShooting, orbits: list[BrakeOrbit]) -> list[BrakeOrbit]:
    """Orbits, with one more wherever the trace seems to touch 2 or -2 between three of them."""
    more: list[tuple[int, BrakeOrbit]] = []
    for index, (one, two, three) in enumerate(zip(orbits, orbits[1:], orbits[2:], strict=False)):
        energies = np.array([orbit.energy for orbit in (one, two, three)])
        traces = np.array([orbit.monodromy.trace for orbit in (one, two, three)])
        bend, slope, _ = np.polyfit(energies - energies[1], traces, 2)
        if bend == 0.0:
            continue
        turn = -0.5 * slope / bend
        level = traces[1] - 0.25 * slope**2 / bend
        inside = energies[0] < energies[1] + turn < energies[2]
        if inside and abs(level) > 2.0 > np.max(np.abs(traces)):
            before, after = (one, two) if turn < 0.0 else (two, three)
            ends = shooting.unknown_of(before), shooting.unknown_of(after)
            share = (energies[1] + turn - before.energy) / (after.energy - before.energy)
            unknown = shooting.nearly(*ends, float(share))
            more.append((index + (1 if turn < 0.0 else 2), shooting.orbit(unknown)))
    for index, orbit in reversed(more):
        orbits.insert(index, orbit)
    return orbits


def _passings(shooting: BrakeShooting, orbits: list[BrakeOrbit]) -> list[Passing]:
    found = []
    for before, after in pairwise(orbits):
        levels = [(0, 1), (1, 2), (1, 3), (1, 4)]
        for turns, periods in levels:
            level = 2.0 * np.cos(2.0 * np.pi * turns / periods)
            low, high = before.monodromy.trace - level, after.monodromy.trace - level
            if low * high < 0.0:
                orbit = _located(shooting, before, after, level)
                found.append(
                    Passing(
                        orbit=orbit,
                        turns=turns,
                        periods=periods,
                        stable_after=after.monodromy.stable,
                    )
                )
    return sorted(found, key=lambda one: one.orbit.energy)


def _located(
    shooting: BrakeShooting, before: BrakeOrbit, after: BrakeOrbit, level: float
) -> BrakeOrbit:
    """The orbit between two others whose pair of multipliers has the trace `level`."""
    first, last = shooting.unknown_of(before), shooting.unknown_of(after)

    def off(share: float) -> float:
        return shooting.orbit(shooting.nearly(first, last, share)).monodromy.trace - level

    share = bracketed(off, 0.0, 1.0, 1e-9)
    return shooting.orbit(shooting.nearly(first, last, share))


def _warnings(
    modes: dict[str, LinearMode], followed_from: float | None, orbits: list[BrakeOrbit]
) -> list[str]:
    said = []
    radial, polar = modes["radial"].freq, modes["polar"].freq
    if followed_from is not None:
        said.append(
            f"1:1 resonance: the linear frequencies, {radial:.4g} and {polar:.4g} Hz, are "
            f"{100.0 * gap(modes):.2g} % apart, so linear shapes do not tell the modes; they were "
            f"followed from z2 = {followed_from:.4g} rad"
        )
    for first, second in RATIOS:
        if abs(radial / polar * second / first - 1.0) < NEAR:
            said.append(
                f"internal resonance {first}:{second} of the linear frequencies, {radial:.4g} and "
                f"{polar:.4g} Hz: the modes may exchange energy"
            )
    wrong = max(abs(orbit.monodromy.determinant - 1.0) for orbit in orbits)
    if wrong > DETERMINANT:
        said.append(f"the multipliers' product is off 1 by {wrong:.1e}")
    return said
