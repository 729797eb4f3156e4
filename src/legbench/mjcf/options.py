"""What a model is made of besides the design; imports no simulator."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

from legbench.choices import choose
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.errors import ConfigError
from legbench.imperfections import Imperfections
from legbench.mjcf.fitting import (
    LIGHTEST_BAR,
    fitted_bar_density,
    parts_of_step,
    step_in_parts,
)


class LinkageKind(StrEnum):
    """How the knee's motion reaches hip motor and foot."""

    BARS = "bars"
    """Physical parallel bars, closed by equality constraints."""
    REDUCED = "reduced"
    """Ankle = -knee as a joint equality, spring 2 on a fixed tendon hip + knee."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Linkage:
    """The linkage and its dimensions.

    The trunk is lightened by the bars' mass, so that the system weighs what the design says.

    Raises:
        ConfigError: a bar too light to simulate, or a crank without length.
    """

    kind: LinkageKind = LinkageKind.BARS
    """Physical parallel bars, or the constraint they make."""
    bar_density: float | None = None
    """Mass per length of crank and bars; none: a square PA6 rod of 2.3 mm, which weighs 6 g/m, and
    lighter ones for a leg with a lighter segment [kg/m]."""
    crank_length: float = 0.02
    """Length of hip crank and thigh extension [m]."""

    def __post_init__(self) -> None:
        choose(self, kind=LinkageKind)
        density = self.bar_density
        if density is not None and not LIGHTEST_BAR <= density < math.inf:
            raise ConfigError(
                f"bar_density is {density:g} kg/m; from {LIGHTEST_BAR:g} kg/m on the "
                "loops can be integrated, for massless bars use linkage 'reduced'"
            )
        if not 0.0 < self.crank_length < math.inf:
            raise ConfigError(
                f"crank_length is {self.crank_length:g} m; it must be positive and finite"
            )

    def density(self, design: LegDesign) -> float:
        """Mass per length of crank and bars [kg/m]; raises as `fitted_bar_density`."""
        return fitted_bar_density(design) if self.bar_density is None else self.bar_density

    def parts_of_step(self, design: LegDesign) -> float:
        """`fitting.parts_of_step` of a leg with this linkage; raises as `density`."""
        if self.kind is LinkageKind.REDUCED:
            return parts_of_step(design)
        return parts_of_step(design, self.density(design), self.crank_length)

    def mass(self, design: LegDesign) -> float:
        """Mass of everything that the linkage adds to a leg [kg]; raises as `density`."""
        if self.kind is LinkageKind.REDUCED:
            return 0.0
        length = self.crank_length + design.thigh.length + design.shank.length
        return self.density(design) * length


LARGEST_TIP = 0.05
"""Largest radius of a foot tip [m]: a third of the shipped designs' foot segments."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ground:
    """The contact of foot and ground.

    The model of the paper stands on a point. A round tip rolls, and rolling couples the polar
    angle to the radial motion: 3 mm of radius make 0.02 rad of it in a leg that has none.

    Raises:
        ConfigError: a negative friction, or a tip without radius.
    """

    friction: float = 1.0
    """Sliding friction [-]."""
    tip_radius: float = 1e-4
    """Radius of the foot tip that touches the ground, by default a point, near enough [m]."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.friction < math.inf:
            raise ConfigError(f"friction is {self.friction:g}; it must be finite, zero or more")
        if not 0.0 < self.tip_radius <= LARGEST_TIP:
            raise ConfigError(
                f"tip_radius is {self.tip_radius:g} m; it must be above 0 and at most "
                f"{LARGEST_TIP:g} m"
            )


def _whole(value: float) -> bool:
    return value > 0.5 and abs(value - round(value)) < 1e-9 * value


@dataclass(frozen=True, slots=True, kw_only=True)
class Numerics:
    """Integrator, solver and constraint settings.

    Raises:
        ConfigError: a time step that does not divide the 1 ms control period.
    """

    timestep: float | None = None
    """Time step, a whole part of the control period; none: 0.25 ms, or a whole part of it for a leg
    whose foot is light or whose springs are stiff [s]."""
    loop_solref: tuple[float, float] | None = None
    """Time constant and damping ratio of loop closures, foot pin and joint equality; none: one time
    step, and 1 [s, -]."""
    loop_solimp: tuple[float, float, float, float, float] = (0.9999, 0.9999, 0.001, 0.5, 2.0)
    """Impedance of the same: at zero, at the width, the width, midpoint, power
    [-, -, m, -, -]."""
    contact_solref: tuple[float, float] = (0.001, 1.0)
    """Time constant and damping ratio of the foot's contact [s, -]."""
    contact_solimp: tuple[float, float, float, float, float] = (0.9, 0.95, 0.001, 0.5, 2.0)
    """Impedance of the foot's contact, as of the loops [-, -, m, -, -]."""
    stop_solref: tuple[float, float] = (0.01, 1.0)
    """Time constant and damping ratio of the joint stops: soft rubber, as
    `legbench.analytic.stops` [s, -]."""
    stop_solimp: tuple[float, float, float, float, float] = (0.95, 0.95, 0.001, 0.5, 2.0)
    """Impedance of the joint stops, as of the loops [-, -, rad, -, -]."""
    iterations: int = 50
    """Largest number of solver iterations."""
    tolerance: float = 1e-12
    """Improvement below which the solver stops [-]."""

    def __post_init__(self) -> None:
        step = self.timestep
        if step is not None and not (0.0 < step < math.inf and _whole(0.001 / step)):
            raise ConfigError(
                f"timestep is {step:g} s; it must divide the control period of 0.001 s"
            )

    def fitted(self, designs: Sequence[LegDesign], linkage: Linkage) -> "Numerics":
        """These settings with a step and a loop closure that suit all of some legs.

        Raises:
            ConfigError: no step or no bar suits one of them.
        """
        if self.timestep is not None and self.loop_solref is not None:
            return self
        step = self.timestep
        if step is None:
            parts, name = max((linkage.parts_of_step(design), design.name) for design in designs)
            step = step_in_parts(parts, name)
        solref = (step, 1.0) if self.loop_solref is None else self.loop_solref
        return replace(self, timestep=step, loop_solref=solref)


@dataclass(frozen=True, slots=True, kw_only=True)
class BuildOptions:
    """What a model is made of besides the design.

    Raises:
        ConfigError: a damped guide where nothing guides the trunk.
    """

    setup: Setup = field(default_factory=Setup)
    linkage: Linkage = field(default_factory=Linkage)
    ground: Ground = field(default_factory=Ground)
    numerics: Numerics = field(default_factory=Numerics)
    friction: tuple[float, float] = (0.0, 0.0)
    """Coulomb friction on q1 and q2 [N m]."""
    guide_damping: tuple[float, float] = (0.0, 0.0)
    """Viscous damping of the trunk's guide, forward and upward [N s/m]."""

    def __post_init__(self) -> None:
        if any(self.guide_damping) and self.setup.kind is not SetupKind.FFS:
            raise ConfigError(
                f"guide_damping is {self.guide_damping} N s/m; setup {self.setup.kind} has no "
                "guide, only ffs has"
            )

    def built(self, imperfections: Imperfections) -> "BuildOptions":
        """Options of the model of a leg that is built with these imperfections."""
        return replace(
            self,
            friction=imperfections.coulomb_friction or self.friction,
            guide_damping=imperfections.guide_damping or self.guide_damping,
        )
