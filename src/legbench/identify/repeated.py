"""A recorded experiment repeated with the identified leg, and its figures beside the recorded ones.

The controller still believes the design that the run names; what differs is the leg that it drives.
So a hop that no fit has seen becomes a test of the whole: ratings, apex and frequency.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from legbench.design import LegDesign
from legbench.design.statics import GRAVITY
from legbench.errors import ConfigError
from legbench.experiment.data import Experiment
from legbench.experiment.run import run
from legbench.experiment.tables import read_tables
from legbench.imperfections import Imperfections
from legbench.metrics import Analysis, summarise
from legbench.plant.opening import PlantSettings
from legbench.plants import EMULATED, AnalyticChoice, CanChoice, SimChoice
from legbench.recording.reader import Recording

RATING_WITHIN: Final = 0.01
"""Largest difference of a rating P^r, stance and flight [-]."""
RISE_WITHIN: Final = 0.01
"""Largest share by which the rise of the centre of mass in flight may differ [-]."""
FREQ_WITHIN: Final = 0.003
"""Largest share by which the hopping frequency may differ [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HopFigures:
    """Figures of a hopping run, means over its limit cycle."""

    rating_stance: float
    """P^r in stance [-]."""
    rating_flight: float
    """P^r in flight [-]."""
    rise: float
    """Rise of the centre of mass in flight, g T^2 / 8 for a flight of length T [m]: drives know no
    trunk, so that its apex is told by the time between lift-off and touchdown alone."""
    hop_freq: float
    """Number of jumps per time [Hz]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeated:
    """Figures of a recorded hop, and of the same experiment with the identified leg."""

    run: str
    measured: HopFigures
    predicted: HopFigures

    @property
    def misses(self) -> tuple[str, ...]:
        """Figures that the identified leg does not predict, each with its bound."""
        one, two = self.measured, self.predicted
        found = [
            f"P^r {name} is off by {abs(off):.3f}, more than {RATING_WITHIN:g}"
            for name, off in (
                ("stance", two.rating_stance - one.rating_stance),
                ("flight", two.rating_flight - one.rating_flight),
            )
            if not abs(off) <= RATING_WITHIN
        ]
        found += [
            f"{name} is off by {abs(off):.2%}, more than {within:.1%}"
            for name, off, within in (
                ("rise by flight time", two.rise / one.rise - 1.0, RISE_WITHIN),
                ("frequency", two.hop_freq / one.hop_freq - 1.0, FREQ_WITHIN),
            )
            if not abs(off) <= within
        ]
        return tuple(found)

    @property
    def good(self) -> bool:
        """Whether the identified leg hops as the recorded one did."""
        return not self.misses

    @property
    def text(self) -> str:
        """Say what was measured and what was predicted."""
        one, two = self.measured, self.predicted
        return (
            f"{self.run}: P^r stance {one.rating_stance:.3f} (predicted {two.rating_stance:.3f}), "
            f"flight {one.rating_flight:.3f} ({two.rating_flight:.3f}), rise by flight time "
            f"{1e3 * one.rise:.2f} mm ({1e3 * two.rise:.2f} mm), {one.hop_freq:.4g} Hz "
            f"({two.hop_freq:.4g} Hz)"
        )


def flaws_of(built: LegDesign, believed: LegDesign) -> Imperfections:
    """Imperfections of a leg as it is, against the design that its controller believes.

    Raises:
        ConfigError: the legs differ in lengths, which no imperfection has.
    """
    if built.lengths != believed.lengths:
        raise ConfigError(
            f"lengths are {built.lengths} m and {believed.lengths} m; an identified leg has those "
            "of its design"
        )
    pairs = list(zip(built.segments, believed.segments, strict=True))

    def triple(values: list[float]) -> tuple[float, float, float]:
        return values[0], values[1], values[2]

    return Imperfections(
        stiffness_error=_shares(built.stiffness, believed.stiffness),
        damping_error=_shares(built.damping, believed.damping),
        trunk_mass_error=built.trunk_mass / believed.trunk_mass - 1.0,
        mass_error=triple([one.mass / other.mass - 1.0 for one, other in pairs]),
        com_error=triple([one.com - other.com for one, other in pairs]),
        inertia_error=triple([one.inertia / other.inertia - 1.0 for one, other in pairs]),
    )


def repeat(recording: Recording, identified: LegDesign) -> Repeated:
    """Run the experiment of a recorded hop again, with the identified leg in it.

    It runs in virtual time whatever the recording ran on: drives on a wire are emulated.

    Raises:
        ConfigError: the recording does not hop, names no experiment that can be run, or its
            experiment has the identified leg refused.
    """
    run_of, name = recording.description, recording.path.name
    if not run_of.jumps:
        raise ConfigError(f"{name} is in setup '{run_of.setup.kind}'; only a hop is repeated")
    experiment = read_tables(Experiment, dict(run_of.experiment), recording.path, json=True)
    again = run(
        replace(
            experiment,
            plant=_virtual(experiment.plant),
            imperfections=flaws_of(identified, run_of.design),
        )
    )
    return Repeated(run=name, measured=_hop(recording), predicted=_hop(again))


def _virtual(plant: PlantSettings) -> PlantSettings:
    """Plant of the same kind that moves nothing real."""
    if isinstance(plant, CanChoice):
        return replace(plant, interface=EMULATED, faults=(), read_only=False)
    return plant if isinstance(plant, SimChoice | AnalyticChoice) else SimChoice()


def _shares(one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    return one[0] / other[0] - 1.0, one[1] / other[1] - 1.0


def _hop(recording: Recording) -> HopFigures:
    figures = summarise(Analysis(recording))
    late = slice(figures.first, None)
    return HopFigures(
        rating_stance=_mean(figures.rating_stance[late]),
        rating_flight=_mean(figures.rating_flight[late]),
        rise=GRAVITY * figures.flight_time**2 / 8.0,
        hop_freq=figures.hop_freq,
    )


def _mean(values: Sequence[float]) -> float:
    known = [value for value in values if math.isfinite(value)]
    return sum(known) / len(known) if known else math.nan
