"""How much of the radial mode is left in legs as they come out of a workshop.

Legs scatter around a design; each is released from a deflected posture in simulation, all of them
at once, with the motor positions that were computed for the design: nobody knows a leg's errors.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from legbench.control import LegTargets, PositionJump, PositionJumpConfig
from legbench.design import LegDesign, Segment
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import Support, gravity_load
from legbench.design.toml import UNITS, Table, load_tables, units_per_si
from legbench.errors import ConfigError, DesignError
from legbench.kinematics import modal_to_joint
from legbench.metrics import Reference, alignment
from legbench.mjcf import BuildOptions, Linkage, LinkageKind, Numerics
from legbench.plant.batch import BatchPlant
from legbench.plant.start import PERIOD, Start
from legbench.signals import Bools, Floats

KEPT = 0.95
"""P^r that a leg has to keep [-]."""
FARTHEST = 3.0
"""Parts further off than this are sorted out in manufacture [standard deviations]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerances:
    """Standard deviations of manufacture, of each segment and joint on its own.

    The defaults are about what separates Table III from Table II, common errors left aside.

    Raises:
        DesignError: a negative tolerance, or one so wide that parts without mass come out.
    """

    mass: float = 0.02
    """Of each mass, relative [-]."""
    com: float = 0.001
    """Of each centre of mass [m]."""
    inertia: float = 0.05
    """Of each inertia, relative [-]."""
    length: float = 0.0002
    """Of thigh and foot; the shank is as long as both together, as its bars are [m]."""
    stiffness: float = 0.03
    """Of each spring, relative [-]."""
    damping: float = 0.12
    """Of each joint, relative [-]."""

    def __post_init__(self) -> None:
        for name in TOLERANCES:
            value = getattr(self, name)
            widest = np.inf if name in ABSOLUTE else 1.0 / FARTHEST
            if not 0.0 <= value < widest:
                raise DesignError(
                    f"tolerance of {name} is {value:g}; it must be zero or more"
                    + (f" and below {widest:.3g}" if np.isfinite(widest) else "")
                )

    def only(self, name: str) -> "Tolerances":
        """The same tolerance of `name`, nothing else scatters."""
        return replace(self, **{other: 0.0 for other in TOLERANCES if other != name})


TOLERANCES = tuple(entry.name for entry in fields(Tolerances))
"""Names of the tolerances."""
ABSOLUTE = ("com", "length")
"""Those in metres; the others are relative."""


def tolerances_from_mapping(content: Mapping[str, Any]) -> Tolerances:
    """Build tolerances from a file with `[units]` and `[tolerances]`; what is left out is default.

    Raises:
        DesignError: an unknown key or unit, or a value that cannot be.
    """
    unknown = set(content) - {"units", "tolerances"}
    if unknown:
        raise DesignError(
            f"unknown entries: {', '.join(sorted(unknown))}; there are units, tolerances"
        )
    per_si = units_per_si(content.get("units", {}), {"length": UNITS["length"]}) | {"ratio": 1.0}
    table = Table("tolerances", content.get("tolerances", {}), per_si)
    given = {
        name: table.number(name, "length" if name in ABSOLUTE else "ratio")
        for name in TOLERANCES
        if name in table.content
    }
    table.finish()
    return Tolerances(**given)


def load_tolerances(path: Path) -> Tolerances:
    """Read a tolerance file.

    Raises:
        DesignError: the file is missing, is not TOML or makes no sense; the message starts with
            the path.
    """
    hint = "no such tolerance file; 'default' is always there"
    return load_tables(path, tolerances_from_mapping, hint)


def scatter(design: LegDesign, tolerances: Tolerances, count: int, seed: int) -> list[LegDesign]:
    """`count` legs made of one design; the same seed draws the same errors for every design."""
    draws = np.random.default_rng(seed).standard_normal((count, 16))
    draws = np.clip(draws, -FARTHEST, FARTHEST)
    return [_made(design, tolerances, row) for row in draws]


def _made(design: LegDesign, tolerances: Tolerances, draw: Floats) -> LegDesign:
    """One leg from 16 standard normal numbers."""
    mass, com, inertia = draw[0:3], draw[3:6], draw[6:9]
    length, stiffness, damping = draw[9:11], draw[11:13], draw[13:15]
    thigh = design.thigh.length + tolerances.length * float(length[0])
    foot = design.foot.length + tolerances.length * float(length[1])
    segments = [
        Segment(
            mass=segment.mass * (1.0 + tolerances.mass * float(mass[index])),
            length=long,
            com=float(np.clip(segment.com + tolerances.com * float(com[index]), 0.0, long)),
            inertia=segment.inertia * (1.0 + tolerances.inertia * float(inertia[index])),
        )
        for index, (segment, long) in enumerate(
            zip(design.segments, (thigh, thigh + foot, foot), strict=True)
        )
    ]
    first, second = 1.0 + tolerances.stiffness * stiffness
    third, fourth = 1.0 + tolerances.damping * damping
    return replace(
        design,
        trunk_mass=design.trunk_mass * (1.0 + tolerances.mass * float(draw[15])),
        thigh=segments[0],
        shank=segments[1],
        foot=segments[2],
        stiffness=(design.stiffness[0] * float(first), design.stiffness[1] * float(second)),
        damping=(design.damping[0] * float(third), design.damping[1] * float(fourth)),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Release:
    """The motion by which legs are judged: a position jump with the foot pinned (section VI-B)."""

    setup: SetupKind = SetupKind.FFS
    z2: float = 1.4
    """Set point after the jump [rad]."""
    dz2: float = 0.3
    """Deflection before it [rad]."""
    duration: float = 1.0
    """How long the motion is rated [s]."""
    reference: Reference = Reference.EQUILIBRIUM
    """What eq. (14) measures deflection from: gravity's sag, which flatters, is left out."""
    timestep: float = 0.001
    """Of the simulation [s]: P^r is then within 5e-5 of that at 0.25 ms."""

    @property
    def options(self) -> BuildOptions:
        """The model: `reduced`, so that nothing but the scatter is in the way."""
        return BuildOptions(
            setup=Setup(kind=self.setup),
            linkage=Linkage(kind=LinkageKind.REDUCED),
            numerics=Numerics(timestep=self.timestep, loop_solref=(2.0 * self.timestep, 1.0)),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Ratings:
    """P^r of many legs."""

    values: Floats
    """(n,) [-]; zero for a leg that left its branch."""
    faulted: Bools

    @property
    def kept(self) -> int:
        """How many legs keep P^r above `KEPT`."""
        return int((self.values > KEPT).sum())

    @property
    def share(self) -> float:
        """The yield [-]."""
        return self.kept / len(self.values)


Advance = Callable[[int, int], None]


def rate_legs(
    nominal: Sequence[LegDesign],
    legs: Sequence[LegDesign],
    release: Release,
    progress: Advance | None = None,
) -> Ratings:
    """P^r of `legs`, each commanded as its `nominal` design asks for.

    Raises:
        ConfigError: a design that cannot be released there.
    """
    controller, start = _released(nominal, legs, release)
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


def _released(
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
    """Where each leg rests for its motor positions (n, 2), close to `near` (n, 2) [rad].

    Raises:
        ConfigError: a leg has no stable equilibrium there.
    """
    stiffness = np.array([leg.stiffness for leg in legs])
    moment = np.array([gravity_load(leg, support).moment for leg in legs])
    joint_pos = near
    for _ in range(20):
        slope = stiffness + moment * np.cos(joint_pos)
        residual = stiffness * (motor_pos - joint_pos) - moment * np.sin(joint_pos)
        joint_pos = joint_pos + residual / np.where(np.abs(slope) < 1e-9, 1e-9, slope)
    slope = stiffness + moment * np.cos(joint_pos)
    residual = stiffness * (motor_pos - joint_pos) - moment * np.sin(joint_pos)
    held = np.all((np.abs(residual) < 1e-9) & (slope > 0.0), axis=1)
    if not held.all():
        raise ConfigError(
            f"{int((~held).sum())} of {len(legs)} scattered legs find no equilibrium at their set "
            "point: choose another one, stiffer springs or narrower tolerances"
        )
    return joint_pos


@dataclass(frozen=True, slots=True, kw_only=True)
class Yield:
    """What scatter does to a design, and which tolerance does it."""

    tolerances: Tolerances
    release: Release
    legs: int
    kept: int
    """Legs of `legs` that keep P^r above `KEPT`."""
    nominal: float
    """P^r of the design itself [-]."""
    mean: float
    """P^r of the scattered legs [-]."""
    tenth: float
    """P^r that nine legs of ten keep [-]."""
    causes: dict[str, tuple[float, float]]
    """Tolerance -> share of legs kept and mean P^r, when it scatters alone; the worst first."""


def measure_yield(
    design: LegDesign,
    tolerances: Tolerances,
    *,
    legs: int = 1000,
    legs_each: int | None = None,
    seed: int = 0,
    release: Release | None = None,
    progress: Advance | None = None,
) -> Yield:
    """Make `legs` legs with all tolerances, and `legs_each` with each alone; rate all of them.

    By default a tenth as many with each alone.

    Raises:
        ConfigError: fewer than one leg, or a design that cannot be released there.
    """
    release = release or Release()
    legs_each = max(1, legs // 10) if legs_each is None else legs_each
    if legs < 1 or legs_each < 1:
        raise ConfigError(f"a yield needs legs; {legs} and {legs_each} were asked for")
    made = [design, *scatter(design, tolerances, legs, seed)]
    for name in TOLERANCES:
        made += scatter(design, tolerances.only(name), legs_each, seed + 1)
    values = rate_legs([design] * len(made), made, release, progress).values
    together, alone = values[1 : legs + 1], values[legs + 1 :].reshape(len(TOLERANCES), legs_each)
    causes = {
        name: (float((row > KEPT).mean()), float(row.mean()))
        for name, row in zip(TOLERANCES, alone, strict=True)
    }
    return Yield(
        tolerances=tolerances,
        release=release,
        legs=legs,
        kept=int((together > KEPT).sum()),
        nominal=float(values[0]),
        mean=float(together.mean()),
        tenth=float(np.quantile(together, 0.1)),
        causes=dict(sorted(causes.items(), key=lambda item: item[1][1])),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ScatterCost:
    """What candidates pay for the rating that scatter takes from them."""

    tolerances: Tolerances
    legs: int = 12
    """Made of every candidate, with the same errors [-]."""
    weight: float = 1.0
    """Objective per unit of P^r lost [-]."""
    seed: int = 0
    release: Release = field(default_factory=lambda: Release(duration=0.5))

    def __call__(self, designs: Sequence[LegDesign]) -> Floats:
        """Cost (n,) of designs; one whose legs cannot be released loses all of its rating."""
        values = np.zeros(len(designs))
        made = [scatter(design, self.tolerances, self.legs, self.seed) for design in designs]
        held = [index for index, legs in enumerate(made) if self._holds(designs[index], legs)]
        if held:
            nominal = [designs[index] for index in held for _ in range(self.legs)]
            legs = [leg for index in held for leg in made[index]]
            ratings = rate_legs(nominal, legs, self.release).values
            values[held] = ratings.reshape(len(held), self.legs).mean(axis=1)
        return self.weight * (1.0 - values)

    def _holds(self, design: LegDesign, legs: Sequence[LegDesign]) -> bool:
        try:
            _released([design] * len(legs), legs, self.release)
        except ConfigError:
            return False
        return True
