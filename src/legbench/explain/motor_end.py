"""One motor that ends at its range: what it does to bang-bang at the set point that is rated lower.

No smooth imperfection lowers the rating at one set point alone. A range does: with a fixed trunk
the motors stand where the links do, at the far end of the leg's fold, while with the foot fixed
gravity folds the leg and its motors stay far from there.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from legbench.control.bang_bang import RATED_PERIODS
from legbench.design import LegDesign
from legbench.design.setup import SetupKind
from legbench.experiment import targets_of
from legbench.explain.consistency import bang_bang_experiment, settled
from legbench.explain.engine import NOBODY, Watch, rate_many
from legbench.explain.targets import READING
from legbench.imperfections import Imperfections
from legbench.paper import Published

SHARES = (1.0, 0.5, 0.0, -0.5, -1.0, -2.0)
"""Ends that are tried, from the farthest that the motor is told to go, as shares of the amplitude
beyond its middle [-]."""
FREE = (-10.0, 10.0)
"""Range of a motor that has no end within reach [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorEnd:
    """Ratings of bang-bang in one setup with a motor 2 that ends earlier and earlier."""

    setup: SetupKind
    z2: float
    """Set point in the middle [rad]."""
    farthest: float
    """Farthest position that motor 2 is told [rad]."""
    ends: tuple[float, ...]
    """Ends of its range [rad]."""
    levels: tuple[float, ...]
    """Mean P^r after the transient for each end [-]; NaN where the oscillation dies."""

    @property
    def lowers(self) -> float | None:
        """Farthest end at which the rating is lower by more than a figure shows [rad]."""
        for end, level in zip(self.ends, self.levels, strict=True):
            if level < self.levels[0] - READING:
                return end
        return None


def motor_ends(
    design: LegDesign, numbers: Mapping[str, Published], watch: Watch = NOBODY
) -> list[MotorEnd]:
    """Try ends of motor 2 in every fixed setup, at the set point that the paper rates lower."""
    z2 = numbers["lower_rated_set_point"].value
    dz2 = numbers["bang_bang_amplitude"].value
    transient = round(numbers["bang_bang_transient"].value)
    found = []
    for setup in (SetupKind.HFTS, SetupKind.VFTS, SetupKind.FFS):
        if watch.stopped():
            break
        experiment = bang_bang_experiment(design, setup, z2, dz2)
        targets = targets_of(experiment)
        middle, far = (float(targets.motor_at(at, "z2")[1]) for at in (z2, z2 + dz2))
        ends = tuple(middle + share * (far - middle) for share in SHARES)
        legs = [Imperfections(motor_range=(FREE, (FREE[0], end))) for end in ends]
        shapes = rate_many(experiment, legs, periods=RATED_PERIODS, watch=watch)
        found.append(
            MotorEnd(
                setup=setup,
                z2=z2,
                farthest=far,
                ends=ends,
                levels=tuple(np.round(settled(shapes.equilibrium, transient), 6).tolist()),
            )
        )
    return found


def count_ends() -> int:
    """Number of legs that `motor_ends` rates [-]."""
    return 3 * len(SHARES)
