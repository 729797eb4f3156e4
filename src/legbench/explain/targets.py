"""Targets: ratings that were measured, which an explanation has to reproduce."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from legbench.control import PositionJumpConfig
from legbench.control.position_jump import RATED_SHARE
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.errors import ConfigError
from legbench.experiment import Experiment
from legbench.paper import PAPER, published
from legbench.signals import Floats

READING = 0.02
"""Accuracy with which ratings of the paper's figures are known [-]: two printed digits, and the
spread of repeated trials."""
PERIODS = 6
"""Number of periods of the step that the paper rates."""
DURATIONS = {SetupKind.FFS: 5.0, SetupKind.HFTS: 1.6, SetupKind.VFTS: 1.6}
"""Setup -> time in which six periods of a leg much softer than the built one fit [s]."""


class Reading(StrEnum):
    """Reading of the paper's step with the foot fixed, of which text and caption disagree."""

    TEXT = "text"
    """Step from z2 = 1.7 rad to 1.4 rad, as section VI-B has it."""
    CAPTION = "caption"
    """Step from z2 = 0.7 rad to 1.0 rad, as the caption of Fig. 4 has it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Ratings of the leading periods of one step, measured about the equilibrium.

    Raises:
        ConfigError: fewer than two ratings, or one that no rating can have.
    """

    name: str
    """Name in tables."""
    z2: float
    """Set point after the step [rad]."""
    dz2: float
    """Deflection before it [rad]."""
    shape: tuple[float, ...]
    """Ratings P^r, period by period [-]."""
    tolerance: float = READING
    """Accuracy of each rating [-]."""
    setup: SetupKind = SetupKind.FFS
    """Setup in which it was measured."""

    def __post_init__(self) -> None:
        if len(self.shape) < 2 or not all(0.0 < value <= 1.0 for value in self.shape):
            raise ConfigError(
                f"target '{self.name}' has the ratings {self.shape}; it needs two or more, above 0 "
                "and up to 1"
            )
        if not self.tolerance > 0.0:
            raise ConfigError(
                f"target '{self.name}' has a tolerance of {self.tolerance:g}; it must be positive"
            )

    def experiment(self, design: LegDesign) -> Experiment:
        """The step, of a leg that its controller believes to be `design`."""
        return step_experiment(design, self.setup, self.z2, self.dz2)

    def residuals(self, ratings: Floats, amplitude: Floats) -> Floats:
        """Differences from the target (n, m) in units of the tolerance.

        A period that is not there, or too small for the paper to have rated it, counts as
        `MISSING` tolerances, and the amplitude that is missing counts besides, so that a search
        finds back.
        """
        wanted = np.asarray(self.shape)
        apart = (ratings[:, : len(wanted)] - wanted) / self.tolerance
        least = RATED_SHARE * abs(self.dz2)
        size = np.nan_to_num(amplitude[:, : len(wanted)], nan=0.0)
        small = np.maximum(0.0, 1.0 - size / least)
        return np.where(np.isfinite(apart) & (small == 0.0), apart, MISSING * (1.0 + small))


MISSING = 10.0
"""Difference that stands for a period that is not there [tolerances]."""


def step_experiment(design: LegDesign, setup: SetupKind, z2: float, dz2: float) -> Experiment:
    """Step from z2 + dz2 to z2 in a fixed setup, long enough for the periods that are rated."""
    return Experiment(
        design=design,
        controller=PositionJumpConfig(z2=z2, dz2=dz2),
        setup=Setup(kind=setup),
        duration=DURATIONS[setup],
    )


def step_target(reading: Reading | str = Reading.TEXT, path: Path = PAPER) -> Target:
    """The step of Fig. 4, from P_1 to P_6 in a "steady decline", which is read as a straight one.

    Args:
        reading: which of the two descriptions of the step.
        path: file of published numbers, by default the paper's.

    Raises:
        ConfigError: there is no such reading, or the file lacks one of the numbers.
    """
    if reading not in tuple(Reading):
        raise ConfigError(f"no reading '{reading}'; there are {', '.join(Reading)}")
    numbers = published(path)
    suffix = "" if reading == Reading.TEXT else "_caption"
    keys = (f"step_from{suffix}", f"step_to{suffix}", "step_rating_1", f"step_rating_{PERIODS}")
    missing = [key for key in keys if key not in numbers]
    if missing:
        raise ConfigError(f"{path} lacks {', '.join(missing)}, which an explanation needs")
    begin, end, first, last = (numbers[key].value for key in keys)
    shape = np.linspace(first, last, PERIODS)
    return Target(
        name=str(reading),
        z2=end,
        dz2=round(begin - end, 9),
        shape=tuple(float(value) for value in shape),
    )
