"""Rating of many legs that are released from a deflected posture.

All of them move at once, by the equations of motion, with the motor positions that were computed
for the design: nobody knows a leg's errors.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from legbench.analytic import LegModel
from legbench.analytic.many import ManyLegs, motion
from legbench.control import LegTargets
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import GRAVITY, Support, balance, gravity_load, is_stable
from legbench.errors import ConfigError
from legbench.kinematics import modal_to_joint
from legbench.metrics import Reference, alignment
from legbench.signals import Bools, Floats

KEPT = 0.95
"""Rating P^r that a leg has to keep [-]."""
STEP = 0.002
"""Step of the integration [s]: P^r is then good to 2e-7 with the foot pinned, and to 5e-6 with the
trunk fixed, where the leg swings faster."""
TOGETHER = 400
"""Number of legs that are integrated in step: so many fit into a processor's cache [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Release:
    """The motion by which legs are judged: a position jump in a fixed setup (section VI-B).

    Raises:
        ConfigError: a setup in which the leg is free, or a duration without a step.
    """

    setup: SetupKind = SetupKind.FFS
    z2: float = 1.4
    """Set point after the jump [rad]."""
    dz2: float = 0.3
    """Deflection before it [rad]."""
    duration: float = 1.0
    """Duration over which the motion is rated [s]."""
    reference: Reference = Reference.EQUILIBRIUM
    """Reference of the deflection in eq. (14), without gravity's sag, which would flatter."""

    def __post_init__(self) -> None:
        if self.setup is SetupKind.JUMP:
            raise ConfigError("legs are released in a fixed setup: hfts, vfts or ffs")
        if not STEP <= self.duration < float("inf"):
            raise ConfigError(f"duration is {self.duration:g} s; it must be {STEP:g} s or more")

    @property
    def support(self) -> Support:
        """Support that carries the legs."""
        return Setup(kind=self.setup).support


@dataclass(frozen=True, slots=True, kw_only=True)
class Ratings:
    """Ratings P^r of many legs."""

    values: Floats
    """Rating P^r of each leg (n,) [-]; zero for a leg that left its branch."""
    faulted: Bools

    @property
    def kept(self) -> int:
        """Number of legs that keep P^r above `KEPT`."""
        return int((self.values > KEPT).sum())

    @property
    def share(self) -> float:
        """Yield: share of the legs that keep P^r above `KEPT` [-]."""
        return self.kept / len(self.values)


Advance = Callable[[int, int], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Released:
    """Legs about to be released."""

    start: Floats
    """Postures in which they rest before (n, 2) [rad]."""
    held: Floats
    """Motor positions before the jump (n, 2) [rad]."""
    rest: Floats
    """Postures in which they rest afterwards (n, 2) [rad]."""
    motor: Floats
    """Motor positions after the jump (n, 2) [rad]."""


def rate_legs(
    nominal: Sequence[LegDesign],
    legs: Sequence[LegDesign],
    release: Release,
    progress: Advance | None = None,
) -> Ratings:
    """Rate `legs` by P^r, each commanded as its `nominal` design asks for.

    Raises:
        ConfigError: a design that cannot be released there.
    """
    begin = released(nominal, legs, release)
    values, faulted = np.zeros(len(legs)), np.zeros(len(legs), dtype=np.bool_)
    for first in range(0, len(legs), TOGETHER):
        part = slice(first, first + TOGETHER)
        values[part], faulted[part] = _rated(legs[part], begin, part, release)
        if progress is not None:
            progress(min(first + TOGETHER, len(legs)), len(legs))
    return Ratings(values=values, faulted=faulted)


def _rated(
    legs: Sequence[LegDesign], begin: Released, part: slice, release: Release
) -> tuple[Floats, Bools]:
    """P^r (m,) of the legs of one part, and which of them left their branch (m,).

    Rows lie a millisecond apart, as those of a recording do; between two steps that is the cubic
    through both ends, good to 1e-8 rad.
    """
    gravity = 0.0 if release.support is Support.NONE else GRAVITY
    models = [LegModel.of(leg, gravity=gravity) for leg in legs]
    many = ManyLegs.of(models, standing=release.support is Support.FOOT)
    motor, before = begin.motor[part], begin.start[part]
    reference = begin.rest[part] if release.reference is Reference.EQUILIBRIUM else motor
    total, counted = np.zeros(len(legs)), np.zeros(len(legs))
    faulted = np.zeros(len(legs), dtype=np.bool_)
    speed = np.zeros_like(before)
    for after, rate in motion(many, before, motor, STEP, round(release.duration / STEP)):
        middle = 0.5 * (before + after) + 0.125 * STEP * (speed - rate)
        for row in (middle, after):
            knee = row[:, 1] - row[:, 0]
            faulted |= ~((knee > 0.0) & (knee < np.pi))
            aligned = alignment(row - reference)
            valid = np.isfinite(aligned)
            total += np.where(valid, aligned, 0.0)
            counted += valid
        before, speed = after, rate
    return np.where(faulted | (counted == 0), 0.0, total / np.maximum(counted, 1.0)), faulted


def released(nominal: Sequence[LegDesign], legs: Sequence[LegDesign], release: Release) -> Released:
    """Motor positions of the nominal legs, and the postures that the real ones take for them.

    Raises:
        ConfigError: a design that cannot be released there.
    """
    begin, motor = (
        _motors(nominal, z2, name, release.support)
        for z2, name in ((release.z2 + release.dz2, "z2 + dz2"), (release.z2, "z2"))
    )
    start, rest = (
        _resting(legs, at, modal_to_joint(np.array([0.0, z2])), release.support)
        for at, z2 in ((begin, release.z2 + release.dz2), (motor, release.z2))
    )
    return Released(start=start, held=begin, rest=rest, motor=motor)


def _motors(nominal: Sequence[LegDesign], z2: float, name: str, support: Support) -> Floats:
    """Motor positions (n, 2) [rad] for a set point; equal designs are solved once."""
    solved = {
        design: LegTargets(designs=design, support=support).motor_at(z2, name)
        for design in set(nominal)
    }
    return np.array([solved[design] for design in nominal])


def _resting(
    legs: Sequence[LegDesign], motor_pos: Floats, near: Floats, support: Support
) -> Floats:
    """Rest postures (n, 2) of legs for their motor positions (n, 2), close to `near` (2,) [rad].

    Raises:
        ConfigError: a leg has no stable equilibrium there.
    """
    stiffness = np.array([leg.stiffness for leg in legs])
    moment = np.array([gravity_load(leg, support).moment for leg in legs])
    joint_pos = balance(stiffness, moment, motor_pos, np.tile(near, (len(legs), 1)))
    held = np.all(is_stable(stiffness, moment, motor_pos, joint_pos), axis=1)
    if not held.all():
        raise ConfigError(
            f"{int((~held).sum())} of {len(legs)} scattered legs find no equilibrium at their set "
            "point: choose another one, stiffer springs or narrower tolerances"
        )
    return joint_pos
