"""Everything that decides a run, as one value."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal

from legbench.choices import choose
from legbench.control import CONTROLLERS, ControllerSettings, SetpointMeaning
from legbench.design import LegDesign
from legbench.design.setup import Setup
from legbench.errors import ConfigError
from legbench.experiment.reading import REGISTRY
from legbench.guests import load_text
from legbench.imperfections import Imperfections
from legbench.kinematics import ModalConvention
from legbench.mjcf.options import BuildOptions, Ground, Linkage, Numerics
from legbench.plant.opening import PlantSettings
from legbench.plant.start import PERIOD
from legbench.plants import PLANTS, SimChoice
from legbench.servo import PERFECT, ServoConfig

LARGEST_SEED: Final = (1 << 63) - 1
"""Largest seed: TOML and most generators hold no larger whole number."""
LONGEST: Final = 604_800.0
"""Longest run [s]: a week."""


def check_seed(seed: int) -> None:
    """Refuse what cannot be written as the source of randomness; raises ConfigError."""
    if not 0 <= seed <= LARGEST_SEED:
        raise ConfigError(f"seed is {seed}; it must be 0 to {LARGEST_SEED}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Conventions:
    """How the paper's formulas are read."""

    modal: ModalConvention = ModalConvention.ORTHONORMAL
    """Reading of eq. (15), which scales the modal coordinates."""
    setpoint: SetpointMeaning = SetpointMeaning.LINK
    """Meaning of z2: the link's equilibrium, or the motor's position."""
    rating_reference: Literal["setup", "motor", "equilibrium"] = "setup"
    """Reference from which the rating that is shown first measures a deflection, q_d of eq. (14):
    the motor, the equilibrium, or as suits the setup, the equilibrium unless the leg jumps."""

    def __post_init__(self) -> None:
        choose(self, modal=ModalConvention, setpoint=SetpointMeaning)


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """Experiment: everything that decides a run.

    Raises:
        ConfigError: a duration below a cycle or above a week; a seed that is negative;
            imperfections that leave no leg, or belong to another setup; a controller or plant
            that lacks something, or takes a built-in's name.
    """

    design: LegDesign
    """Leg, as in a design file."""
    controller: ControllerSettings = field(metadata={REGISTRY: CONTROLLERS})
    """Kind and settings of the controller."""
    setup: Setup = field(default_factory=Setup)
    """Setup in which the leg is held."""
    linkage: Linkage = field(default_factory=Linkage)
    """Linkage that couples the segments."""
    ground: Ground = field(default_factory=Ground)
    """Ground that the leg stands on."""
    numerics: Numerics = field(default_factory=Numerics)
    """Numerics of the simulation."""
    servo: ServoConfig = field(default_factory=ServoConfig)
    """Limits of a simulated drive."""
    imperfections: Imperfections = PERFECT
    """What leg, encoders and motors have that the controller does not know of."""
    conventions: Conventions = field(default_factory=Conventions)
    """How the paper's formulas are read."""
    plant: PlantSettings = field(default_factory=SimChoice, metadata={REGISTRY: PLANTS})
    """Kind and settings of the plant."""
    duration: float = 8.0
    """Length of the run [s]."""
    seed: int = 0
    """Source of all randomness of a run, which is the noise of its encoders: experiments that
    differ in anything but their seed share it. Without noise it changes no row."""

    def __post_init__(self) -> None:
        if not PERIOD <= self.duration <= LONGEST:
            raise ConfigError(
                f"duration is {self.duration:g} s; it must be at least one cycle of {PERIOD:g} s, "
                f"and finite: at most {LONGEST:.0f} s, a week"
            )
        check_seed(self.seed)
        built = self.imperfections.leg_of(self.design)
        self.setup.check_boom(built)
        self.options.built(self.imperfections)
        CONTROLLERS.check(type(self.controller))
        PLANTS.check(type(self.plant))

    @property
    def options(self) -> BuildOptions:
        """Options of the model besides the design."""
        return BuildOptions(
            setup=self.setup, linkage=self.linkage, ground=self.ground, numerics=self.numerics
        )

    @classmethod
    def from_run(cls, run: Path) -> "Experiment":
        """The experiment that a run folder, or its `run.json`, was recorded from.

        Raises:
            RecordingError: there is no such run, or its manifest is damaged.
            ConfigError: it was written before experiments were recorded whole, or a guest is gone.
        """
        return load_text("legbench.experiment.runs:read_run")(cls, Path(run))
