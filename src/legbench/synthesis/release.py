"""Rating of many legs that are released from a deflected posture.

All of them move at once, with the motor positions that were computed for the design: nobody knows
a leg's errors.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from legbench.control import LegTargets, PositionJump, PositionJumpConfig
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import Support, balance, gravity_load, is_stable
from legbench.errors import ConfigError
from legbench.kinematics import modal_to_joint
from legbench.metrics import Reference, alignment
from legbench.mjcf import BuildOptions, Linkage, LinkageKind, Numerics
from legbench.plant.batch import BatchPlant
from legbench.plant.start import PERIOD, Start
from legbench.signals import Bools, Floats

KEPT = 0.95
"""Rating P^r that a leg has to keep [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Release:
    """The motion by which legs are judged: a position jump with the foot pinned (section VI-B)."""

    setup: SetupKind = SetupKind.FFS
    z2: float = 1.4
    """Set point after the jump [rad]."""
    dz2: float = 0.3
    """Deflection before it [rad]."""
    duration: float = 1.0
    """Duration over which the motion is rated [s]."""
    reference: Reference = Reference.EQUILIBRIUM
    """Reference of the deflection in eq. (14), without gravity's sag, which would flatter."""
    timestep: float = 0.001
    """Time step of the simulation [s]; P^r is then within 5e-5 of that at 0.25 ms."""

    @property
    def options(self) -> BuildOptions:
        """Options of the model; it is `reduced`, so that the scatter alone acts."""
        return BuildOptions(
            setup=Setup(kind=self.setup),
            linkage=Linkage(kind=LinkageKind.REDUCED),
            numerics=Numerics(timestep=self.timestep, loop_solref=(2.0 * self.timestep, 1.0)),
        )


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
    controller, start = released(nominal, legs, release)
    support = release.options.setup.support
    cycles = round(release.duration / PERIOD)
    total, counted = np.zeros(len(legs)), np.zeros(len(legs))
    with BatchPlant(legs, release.options, start) as plant:
        observation = plant.reset()
        controller.reset(observation)
        target = controller.step(observation).motor_pos
        rest = target
        if release.reference is Reference.EQUILIBRIUM:
            near = np.tile(modal_to_joint(np.array([0.0, release.z2])), (len(legs), 1))
            rest = _resting(legs, target, near, support)
        for cycle in range(cycles):
            observation = plant.step(controller.step(observation))
            aligned = alignment(observation.joint_pos - rest)
            valid = np.isfinite(aligned)
            total += np.where(valid, aligned, 0.0)
            counted += valid
            if progress is not None and cycle % 50 == 49:
                progress(cycle + 1, cycles)
        faulted = plant.faulted.copy()
    values = np.where(faulted | (counted == 0), 0.0, total / np.maximum(counted, 1.0))
    return Ratings(values=values, faulted=faulted)


def released(
    nominal: Sequence[LegDesign], legs: Sequence[LegDesign], release: Release
) -> tuple[PositionJump, Start]:
    """The controller of the nominal legs, and the posture in which it finds the real ones."""
    config = PositionJumpConfig(z2=release.z2, dz2=release.dz2, delay=0.0)
    support = release.options.setup.support
    controller = PositionJump(config, LegTargets(designs=list(nominal), support=support))
    begin = controller.start_motor_pos
    near = np.tile(modal_to_joint(np.array([0.0, release.z2 + release.dz2])), (len(legs), 1))
    return controller, Start(joint_pos=_resting(legs, begin, near, support), motor_pos=begin)


def _resting(
    legs: Sequence[LegDesign], motor_pos: Floats, near: Floats, support: Support
) -> Floats:
    """Rest postures (n, 2) of legs for their motor positions (n, 2), close to `near` (n, 2) [rad].

    Raises:
        ConfigError: a leg has no stable equilibrium there.
    """
    stiffness = np.array([leg.stiffness for leg in legs])
    moment = np.array([gravity_load(leg, support).moment for leg in legs])
    joint_pos = balance(stiffness, moment, motor_pos, near)
    held = np.all(is_stable(stiffness, moment, motor_pos, joint_pos), axis=1)
    if not held.all():
        raise ConfigError(
            f"{int((~held).sum())} of {len(legs)} scattered legs find no equilibrium at their set "
            "point: choose another one, stiffer springs or narrower tolerances"
        )
    return joint_pos
